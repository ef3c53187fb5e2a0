"""A league: one learner against a growing pool of scripts, its own snapshots and exploiters.

Opponents are drawn by how seldom the learner beats them (prioritised fictitious self-play, Vinyals et
al., "Grandmaster level in StarCraft II using multi-agent reinforcement learning", Nature 575, 2019): with
weight (1 - p)^k for an opponent that is beaten in a share p of the games. A learner that forgets how
to beat somebody meets them again. Scripts have a fixed share, however many snapshots there are: they
are what tactics are measured against. Exploiters start from the learner's weights and learn to beat
just that tactic; what they find joins the pool.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, Stopped
from swarm_pz.evaluation.ratings import rate
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.files import draft_of
from swarm_pz.policies.learned import CARD, WEIGHTS, LearnedPolicy
from swarm_pz.policy import Player
from swarm_pz.training.callbacks import Checkpoint
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.config import LeagueConfig
from swarm_pz.training.exploit import make_exploiter, play_exploiter
from swarm_pz.training.flight import Opponent
from swarm_pz.training.folders import LEAGUE as STATE
from swarm_pz.training.folders import LEARNER, check_folder
from swarm_pz.training.pool import Member, Pool
from swarm_pz.training.ppo import Training, never

_EXPLOITED_GAMES = 100
"""Games that show whether an exploiter beats its target."""
_RATED, _RATING_GAMES = 4, 10
"""Latest snapshots, and latest exploiters, that a new snapshot is rated among; and the games of every two."""


class _Scores(BaseCallback):
    """Counts finished games for the pool."""

    def __init__(self, pool: Pool, names: Sequence[str]) -> None:
        super().__init__()
        self.members = {member.name: member for member in pool.members}
        self.names = names
        """Of opponents, by the numbers in infos."""

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "outcome" in info and (name := self.names[info["opponent"]]) in self.members:
                self.members[name].count(0.5 + 0.5 * info["outcome"])
        return True


class League:
    """One league in a folder, begun afresh or taken up where it was.

    The folder holds ``league.json`` (the pool, for readers), ``main/`` (the learner's run, whose checkpoint holds
    the pool, too), ``pool/`` (snapshots), ``exploiters/``, and ``ratings/``, a tournament of the latest of
    them. As with `Training`, a league that is taken up is the league that never stopped.

    Parameters
    ----------
    config : LeagueConfig
    folder : Path
    resume, overwrite : bool
        Go on with the folder's league, or replace it.
    say : callable, optional
        Where lines of progress go.
    command : str
        What was called to begin the league; it stands on the card of the policy.

    Raises
    ------
    CheckpointError
        If there is nothing to resume, or it is corrupt or of other settings; or if a fresh league would
        replace another.
    """

    def __init__(
        self,
        config: LeagueConfig,
        folder: Path,
        *,
        resume: bool = False,
        overwrite: bool = False,
        say: Callable[[str], None] = print,
        command: str = "",
    ) -> None:
        check_folder(folder, resume=resume, overwrite=overwrite, marks=(STATE,))
        self.config = config
        self.folder = folder
        self._say = say
        self.main = Training(
            config.learner,
            folder / LEARNER,
            resume=resume,
            overwrite=not resume,
            say=say,
            command=command,
            load_opponent=self._partner,
        )
        settings = config.replace(learner=config.learner.replace(total_steps=1, threads=1))
        if resume:
            self.pool = self._read_pool()
            if not settings.has_hash(self.pool.config_hash):
                raise CheckpointError(
                    f"{folder} holds a league with other settings: give those, or another folder (--out)"
                )
        else:
            for name in ("pool", "exploiters", "ratings"):
                shutil.rmtree(folder / name, ignore_errors=True)
            for name in (WEIGHTS, CARD):
                (folder / name).unlink(missing_ok=True)
            invited = [Member(name, name, "script") for name in config.scripts]
            invited += [Member(name, name, "rival") for name in config.rivals]
            self.pool = Pool(invited, config_hash=settings.hash)
            self._snapshot()

    def _read_pool(self) -> Pool:
        """Return the pool as of the learner's checkpoint; leagues of an earlier version have it beside."""
        try:
            told = self.main.found.get("pool")
            return Pool.from_dict(told if told is not None else json.loads((self.folder / STATE).read_text()))
        except (LookupError, TypeError, ValueError) as error:
            raise CheckpointError(f"{self.folder / STATE} is corrupt or foreign: {error!r}") from error

    def run(self, asked: Callable[[], bool] = never) -> LearnedPolicy:
        """Play the league to its end, write the learner's tactic and return it.

        Parameters
        ----------
        asked : callable, optional
            Says now and then whether to stop there.

        Raises
        ------
        Stopped
            If asked to stop; all that is needed to go on has been written.
        """
        total = self.config.learner.total_steps
        if self.main.is_finished:
            self._say(
                f"the learner of {self.folder} is finished, and not trained any further: it has had "
                f"{self.main.model.num_timesteps:,} of {total:,} steps; ask for more to go on"
            )
        try:
            while self._follow_up(asked) < total:
                step = self.main.model.num_timesteps
                if step >= self.pool.until or step == 0:  # at 0 a checkpoint holds no games, and so no deal
                    self._deal()
                    self.pool.until = step + self.config.cycle
                began = time.monotonic()
                stops = Checkpoint(self.main.state, self._save, asked, self.main.standing)
                scores = _Scores(self.pool, self.main.env.opponent_names)
                self.main.learn(min(self.pool.until, total), scores, stops)
                self._report((self.main.model.num_timesteps - step) / (time.monotonic() - began))
                self._save()
        finally:
            self.main.logger.close()
        learner = self.main.policy()
        league = self.config.to_dict()
        training = league.pop("learner")
        del training["opponents"]  # the league says whom it met
        card = learner.card | {"training": training, "league": league}
        policy = LearnedPolicy(card, learner.weights(), self.config.learner.game, self.folder.name)
        policy.write(self.folder)
        self.main.env.close()
        return policy

    def _follow_up(self, asked: Callable[[], bool]) -> int:
        """Take the snapshot and train the exploiter that are due, if any; return the learner's steps.

        What has been done is not due again, so a league that was killed here goes on where it was.
        """
        step = self.main.model.num_timesteps
        is_over = step >= min(self.pool.until, self.config.learner.total_steps)
        since = step - self.pool.snapshot_step
        if is_over and since:
            if self.pool.newest().beaten >= self.config.snapshot_score or since >= self.config.snapshot_every:
                self._snapshot()
                self.main.logger.record("league/rating", self._rate())
            self.main.logger.dump(step)
        if self._wants_exploiter(step) and is_over and not self.pool.target:
            if self.pool.snapshot_step != step:
                self._snapshot()
            self.pool.target = self.pool.newest().source
            self._save()
        if asked():
            raise Stopped(self.main.standing())
        if self.pool.target:
            self._exploit(asked)
        return step

    def _wants_exploiter(self, step: int) -> bool:
        return self.config.exploiter_steps > 0 and step - self.pool.exploiter_step >= self.config.exploiter_every

    def _report(self, rate: float) -> None:
        step = self.main.model.num_timesteps
        by_score = sorted(self.pool.members, key=lambda member: member.beaten)
        mean = float(np.mean([member.beaten for member in by_score]))
        self._say(
            f"{step / self.config.learner.total_steps:4.0%} {step:>10,} steps {rate:6,.0f}/s  pool {len(by_score)}  "
            f"mean {mean:.2f}  hardest " + ", ".join(f"{member.name} {member.beaten:.2f}" for member in by_score[:4])
        )
        logger = self.main.logger
        logger.record("league/pool", len(by_score))
        logger.record("league/mean_score", mean)
        logger.record("league/lowest_score", by_score[0].beaten)

    def _deal(self) -> None:
        weights = self.pool.weights(self.config.hardness, self.config.floor, self.config.script_share)
        generator = np.random.default_rng([self.config.learner.seed, self.main.model.num_timesteps])
        # Systematic sampling: as random as needed, with less variance than independent draws.
        places = (generator.random() + np.arange(self.config.seats)) / self.config.seats
        chosen = [self.pool.members[i].name for i in np.searchsorted(np.cumsum(weights), places * 0.999999)]
        # A partner that did not explore would beat the learner that does, whatever it had learned.
        noise = self.main.exploration()
        partners = {
            name: self._partner(Opponent(name, noise), self.config.learner.game) for name in dict.fromkeys(chosen)
        }
        order = [chosen[i] for i in generator.permutation(len(chosen))]
        self.main.deal([partners[name] for name in order], order)

    def _partner(self, opponent: Opponent, game: GameConfig) -> Player:
        """Return a member of the pool; learned ones with noise."""
        member = next(member for member in self.pool.members if member.name == opponent.name)
        player = policies.load(self._locate(member.source, member.kind), game)
        if isinstance(player, LearnedPolicy):
            player.noise = opponent.noise
        return player

    def _locate(self, source: str, kind: str) -> str:
        return source if kind in ("script", "rival") else str(self.folder / source)

    def _snapshot(self) -> None:
        """Put the learner as it stands into the pool, and save the league before anybody plays it."""
        number = sum(member.kind == "snapshot" for member in self.pool.members)
        name = f"snapshot_{number:03d}"
        source = f"pool/{name}"
        self.main.policy().write(self.folder / source)
        self.pool.members.append(Member(name, source, "snapshot"))
        self.pool.snapshot_step = self.main.model.num_timesteps
        self._save()

    def _exploit(self, asked: Callable[[], bool]) -> None:
        """Train a best response to the pool's target, or finish one; whoever beats it joins the pool."""
        name = f"exploiter_{self.pool.exploiters:03d}"
        self._say(f"{name} trains for {self.config.exploiter_steps:,} steps against {Path(self.pool.target).name}")
        folder = self.folder / "exploiters" / name
        target = str(self.folder / self.pool.target)
        run = make_exploiter(
            target,
            folder,
            steps=self.config.exploiter_steps,
            learner=self.config.learner.replace(evaluate_every=self.config.exploiter_steps),
            seed=self.config.learner.seed + 1000 + self.pool.exploiters,
            threads=self.config.learner.threads,
            resume=(folder / CHECKPOINT).exists(),
            say=lambda _: None,
        )
        run.run(asked)
        match, *_ = play_exploiter(run, target, games=_EXPLOITED_GAMES)
        self._say(f"{name} against {Path(self.pool.target).name}: {match.standing()}")
        if match.score() > 0.5:
            member = Member(name, f"exploiters/{name}", "exploiter")
            member.score = (1 - match.score()) * member.games
            self.pool.members.append(member)
        self.pool.exploiters += 1
        self.pool.exploiter_step = self.main.model.num_timesteps
        self.pool.target = ""
        self._save()

    def _rate(self) -> float:
        """Return the newest snapshot's rating among the latest of the pool, from matches of their own."""
        kinds = {kind: [m for m in self.pool.members if m.kind == kind] for kind in ("script", "snapshot", "exploiter")}
        snapshots = kinds["snapshot"]
        latest = [*snapshots[:1], *snapshots[1:][-_RATED:], *kinds["exploiter"][-_RATED:]]
        rated = {member.source: member for member in (*kinds["script"], *latest)}
        names = list(rated)
        tournament = Tournament(
            names,
            TournamentConfig(games=_RATING_GAMES, game=self.config.learner.game, budget_ms=1e6),
            self.folder / "ratings",
            lambda name, config: policies.load(self._locate(name, rated[name].kind), config),
        )
        tournament.play()
        anchor = "uniform" if "uniform" in names else names[0]
        ratings = rate(tournament.results(), anchor)
        return float(ratings.values[names.index(snapshots[-1].source)])

    def _save(self) -> None:
        # The pool must be of the same moment as the learner, so it is in the same file.
        self.main.save_checkpoint(pool=asdict(self.pool))
        with draft_of(self.folder / STATE) as draft:
            draft.write_text(self.pool.to_json() + "\n")
