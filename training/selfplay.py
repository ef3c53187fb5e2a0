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
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz import policies
from swarm_pz.errors import CheckpointError
from swarm_pz.policies.learned import LearnedPolicy, write_atomically
from swarm_pz.ratings import rate
from swarm_pz.tournament import Tournament, TournamentConfig
from swarm_pz.training.config import LeagueConfig
from swarm_pz.training.exploit import exploit
from swarm_pz.training.ppo import Training

STATE = "league.json"
_PRIOR_GAMES = 10.0
"""Games at an even score that a new opponent starts with."""
_REMEMBERED_GAMES = 200.0
"""Older games fade: the learner changes."""
_RATED, _RATING_GAMES = 4, 10
"""Latest snapshots, and latest exploiters, that a new snapshot is rated among; and the games of every two."""


@dataclass
class Member:
    """An opponent of the pool, and how the learner has done against it lately.

    Attributes
    ----------
    name : str
    source : str
        Name of the policy, or its folder within the league's.
    kind : {"script", "rival", "snapshot", "exploiter"}
    games, score : float
        Games of late, and the learner's score in them; a draw is half a win.
    """

    name: str
    source: str
    kind: str
    games: float = _PRIOR_GAMES
    score: float = _PRIOR_GAMES / 2

    @property
    def beaten(self) -> float:
        """The learner's share of the points."""
        return self.score / self.games

    def count(self, points: float) -> None:
        """Count a game of the learner against it."""
        self.games, self.score = self.games + 1.0, self.score + points
        if self.games > _REMEMBERED_GAMES:
            self.score *= _REMEMBERED_GAMES / self.games
            self.games = _REMEMBERED_GAMES


@dataclass
class Pool:
    """The members of a league and what has been done so far.

    Attributes
    ----------
    members : list of Member
    config_hash : str
        Of the settings that the league is played under.
    snapshot_step, exploiter_step : int
        Steps of the learner at the latest of each.
    exploiters : int
        How many have been trained.
    target : str
        The snapshot that an exploiter is being trained against, or none.
    """

    members: list[Member] = field(default_factory=list)
    config_hash: str = ""
    snapshot_step: int = 0
    target: str = ""
    exploiters: int = 0
    exploiter_step: int = 0

    def newest(self) -> Member:
        """Return the newest snapshot; a league begins with one."""
        return next(member for member in reversed(self.members) if member.kind == "snapshot")

    def weights(self, exponent: float, floor: float, scripts: float) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return each member's probability of being dealt; `scripts` is what all scripts share."""
        hard = np.array([(1.0 - member.beaten) ** exponent for member in self.members]) + floor
        is_script = np.array([member.kind == "script" for member in self.members])
        if is_script.any() and not is_script.all():
            hard[is_script] *= scripts / hard[is_script].sum()
            hard[~is_script] *= (1.0 - scripts) / hard[~is_script].sum()
        return np.asarray(hard / hard.sum())

    def to_json(self) -> str:
        """Return the pool as JSON."""
        return json.dumps(asdict(self), indent=2)

    @classmethod
    def from_json(cls, text: str) -> Pool:
        """Read what `to_json` wrote."""
        plain = json.loads(text)
        members = [Member(**entry) for entry in plain.pop("members")]
        return cls(members=members, **plain)


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

    The folder holds ``league.json`` (the pool), ``main/`` (the learner's run), ``pool/`` (snapshots)
    ``exploiters/``, and ``ratings/``, a tournament of the latest of them.

    Parameters
    ----------
    config : LeagueConfig
    folder : Path
    resume : bool
    say : callable, optional
        Where lines of progress go.
    command : str
        What was called to begin the league; it stands on the card of the policy.
    """

    def __init__(
        self,
        config: LeagueConfig,
        folder: Path,
        *,
        resume: bool = False,
        say: Callable[[str], None] = print,
        command: str = "",
    ) -> None:
        self.config = config
        self.folder = folder
        self._say = say
        has_league = (folder / STATE).exists()
        if has_league and not resume:
            raise CheckpointError(f"{folder} holds a league: go on with it (--resume), or give another folder (--out)")
        self.main = Training(config.learner, folder / "main", resume=has_league, say=say, command=command)
        identity = config.replace(learner=config.learner.replace(total_steps=1, threads=1)).hash
        if has_league:
            try:
                self.pool = Pool.from_json((folder / STATE).read_text())
            except (LookupError, TypeError, ValueError) as error:
                raise CheckpointError(f"{folder / STATE} is corrupt or foreign: {error!r}") from error
            if self.pool.config_hash != identity:
                raise CheckpointError(
                    f"{folder} holds a league with other settings: give those, or another folder (--out)"
                )
        else:
            for name in ("pool", "exploiters", "ratings"):  # of a league that was killed before it was first saved
                shutil.rmtree(folder / name, ignore_errors=True)
            invited = [Member(name, name, "script") for name in config.scripts]
            invited += [Member(name, name, "rival") for name in config.rivals]
            self.pool = Pool(invited, config_hash=identity)
            self._snapshot()
        self._generator = np.random.default_rng([config.learner.seed, self.main.model.num_timesteps])

    def run(self) -> LearnedPolicy:
        """Play the league to its end, write the learner's tactic and return it."""
        total = self.config.learner.total_steps
        if self.pool.target:
            self._exploit()
        while self.main.model.num_timesteps < total:
            self._deal()
            began, before = time.monotonic(), self.main.model.num_timesteps
            self.main.learn(min(before + self.config.cycle, total), _Scores(self.pool, self.main.env.opponent_names))
            spent = time.monotonic() - began
            self.main.history.seconds += spent
            step = self.main.model.num_timesteps
            self._report(step, (step - before) / spent)
            self._save()
            since = step - self.pool.snapshot_step
            newest = self.pool.newest()
            if newest.beaten >= self.config.snapshot_score or since >= self.config.snapshot_every:
                self._snapshot()
                self.main.model.logger.record("league/rating", self._rate())
            self.main.model.logger.dump(step)
            if self.config.exploiter_steps and step - self.pool.exploiter_step >= self.config.exploiter_every:
                if self.pool.snapshot_step != step:
                    self._snapshot()
                self.pool.target = self.pool.newest().source
                self._save()
                self._exploit()
        learner = self.main.policy()
        league = self.config.to_dict()
        training = league.pop("learner")
        del training["opponents"]  # the league says whom it met
        card = learner.card | {"training": training, "league": league}
        policy = LearnedPolicy(card, learner.weights(), self.config.learner.game, self.folder.name)
        policy.write(self.folder)
        self.main.env.close()
        return policy

    def _report(self, step: int, rate: float) -> None:
        by_score = sorted(self.pool.members, key=lambda member: member.beaten)
        mean = float(np.mean([member.beaten for member in by_score]))
        self._say(
            f"{step / self.config.learner.total_steps:4.0%} {step:>10,} steps {rate:6,.0f}/s  pool {len(by_score)}  "
            f"mean {mean:.2f}  hardest " + ", ".join(f"{member.name} {member.beaten:.2f}" for member in by_score[:4])
        )
        logger = self.main.model.logger
        logger.record("league/pool", len(by_score))
        logger.record("league/mean_score", mean)
        logger.record("league/lowest_score", by_score[0].beaten)

    def _deal(self) -> None:
        weights = self.pool.weights(self.config.hardness, self.config.floor, self.config.script_share)
        # Systematic sampling: as random as needed, with less variance than independent draws.
        places = (self._generator.random() + np.arange(self.config.seats)) / self.config.seats
        chosen = [self.pool.members[i] for i in np.searchsorted(np.cumsum(weights), places * 0.999999)]
        seated = {}
        for member in chosen:
            if member.name not in seated:
                player = policies.load(self._locate(member.source, member.kind), self.config.learner.game)
                # A partner that did not explore would beat the learner that does, whatever it had learned.
                if isinstance(player, LearnedPolicy):
                    player.noise = self.main.exploration()
                seated[member.name] = player
        order = [chosen[i].name for i in self._generator.permutation(len(chosen))]
        self.main.env.deal([seated[name] for name in order], order)

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

    def _exploit(self) -> None:
        """Train a best response to the pool's target, or finish one; whoever beats it joins the pool."""
        name = f"exploiter_{self.pool.exploiters:03d}"
        self._say(f"{name} trains for {self.config.exploiter_steps:,} steps against {Path(self.pool.target).name}")
        match, *_ = exploit(
            str(self.folder / self.pool.target),
            self.folder / "exploiters" / name,
            steps=self.config.exploiter_steps,
            games=100,
            learner=self.config.learner.replace(evaluate_every=self.config.exploiter_steps),
            seed=self.config.learner.seed + 1000 + self.pool.exploiters,
            threads=self.config.learner.threads,
            say=lambda _: None,
        )
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
        self.main.save_checkpoint()
        write_atomically(self.folder / STATE, lambda path: path.write_text(self.pool.to_json() + "\n"))
