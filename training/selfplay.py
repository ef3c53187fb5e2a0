"""A league: one learner against a growing pool of scripts, its own snapshots and exploiters.

An opponent from which the learner takes a share p of the drones is drawn with weight (1 - p)^k (prioritised fictitious
self-play, Vinyals et al., "Grandmaster level in StarCraft II using multi-agent reinforcement learning", Nature 575,
2019). Scripts have a fixed share, since tactics are evaluated against them. Patterns have a fixed share, too, and
evolve: new ones replace those that the learner beats. Now and then an exploiter starts from the learner's weights and
learns to beat only the learner. If it ends with more than half of the drones, it joins the pool.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import asdict
from pathlib import Path

import numpy as np

from swarm_pz import policies
from swarm_pz.errors import CheckpointError, Stopped
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.workers import BackgroundTasks, SerialExecutor, never
from swarm_pz.files import write_json
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policies.pattern import KINDS, PatternPlayer, numbers_in
from swarm_pz.policy import Player
from swarm_pz.training.callbacks import Checkpoint, RunCallback, RunState
from swarm_pz.training.checkpoint import CHECKPOINT, is_begun
from swarm_pz.training.checkpoint import LEAGUE as STATE
from swarm_pz.training.config import MAY_CHANGE, LeagueConfig
from swarm_pz.training.exploit import respond
from swarm_pz.training.pool import Member, Pool
from swarm_pz.training.ppo import SETTINGS, Training

_PATTERNS = 24
"""Patterns in a pool."""
_EXPLOITED_GAMES = 100
"""Games that show whether an exploiter beats its target."""


class _Scores(RunCallback):
    """Counts finished games for the pool; `names` are the opponents' names, indexed by their numbers in infos."""

    def __init__(self, state: RunState, pool: Pool, names: Sequence[str]) -> None:
        super().__init__(state)
        self.members = {member.name: member for member in pool.members}
        self.names = names

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "outcome" in info and (name := self.names[info["opponent"]]) in self.members:
                self.members[name].count(float(info["share"]))
        return True


class League:
    """One league in a folder, which continues from its last checkpoint; raises the errors of `Training`.

    The folder holds ``config.json`` (its settings), ``league.json`` (a readable copy of the pool), ``main/`` (the
    learner's run, whose checkpoint holds the pool), ``pool/`` (snapshots) and ``exploiters/``. `workers` train
    exploiters; without them, this process does.
    """

    def __init__(
        self,
        config: LeagueConfig,
        folder: Path,
        *,
        say: Callable[[str], None] = print,
        command: str = "",
        workers: Executor | None = None,
    ) -> None:
        is_begun(folder, STATE)
        self.config, self.folder, self._say = config, folder, say
        self._game = config.learner.game
        self._background = BackgroundTasks(workers if workers is not None else SerialExecutor())
        self.main = Training(config.learner, folder / "main", say=say, command=command)
        settings = config.replace(learner=config.learner.replace(**MAY_CHANGE))
        stored = self.main.stored.get("pool")
        if stored is not None:
            try:
                self.pool = Pool.from_dict(stored)
            except (LookupError, TypeError, ValueError) as error:
                raise CheckpointError(f"{self.main.folder / CHECKPOINT} is corrupt or foreign: {error!r}") from error
            if settings.hash != self.pool.config_hash:
                raise CheckpointError(
                    f"{folder} holds a league with other settings: give those, or another folder (--out)"
                )
        else:
            invited = [Member(name, name, "script") for name in config.scripts]
            invited += [Member(name, name, "initial") for name in config.initial_opponents]
            self.pool = Pool(invited, config_hash=settings.hash)
        write_json(folder / SETTINGS, config.to_dict())
        if stored is None:
            self._snapshot()

    def run(self, should_stop: Callable[[], bool] = never) -> LearnedPolicy:
        """Play the league to its end, write the learner's tactic and return it.

        Stopped is raised after a checkpoint if `should_stop` returns True.
        """
        total = self.config.learner.total_steps
        if self.main.is_finished:
            self.main.say_finished()
        is_dealt = False
        with closing(self.main.logger), self._background:
            while self._follow_up(should_stop) < total:
                step = self.main.model.num_timesteps
                if step >= self.pool.until or not is_dealt:
                    self._deal()
                    is_dealt = True
                    self.pool.until = step + self.config.cycle
                began = time.monotonic()
                stops = Checkpoint(self.main.state, self._save, should_stop, self.main.standing)
                scores = _Scores(self.main.state, self.pool, self.main.env.opponent_names)
                self.main.learn(min(self.pool.until, total), scores, stops)
                self._report((self.main.model.num_timesteps - step) / (time.monotonic() - began))
                self._save()
        learner = self.main.policy()
        league = self.config.to_dict()
        training = league.pop("learner")
        del training["opponents"]  # the league names the opponents
        card = learner.card | {"training": training, "league": league}
        policy = LearnedPolicy(card, learner.weights(), self._game, self.folder.name)
        policy.write(self.folder)
        self.main.env.close()
        return policy

    def _follow_up(self, should_stop: Callable[[], bool]) -> int:
        """Take a snapshot or begin an exploiter if due, wait for one that joins now, and return the learner's steps."""
        step, total, after = self.main.model.num_timesteps, self.config.learner.total_steps, self.config.async_delay
        is_over = step >= min(self.pool.until, total)
        since = step - self.pool.snapshot_step
        is_beaten = self.pool.newest().beaten >= self.config.snapshot_score
        if is_over and since and (is_beaten or since >= self.config.snapshot_every):
            self._snapshot()
        if is_over and since:
            self.main.logger.dump(step)
        wants_exploiter = self.config.exploiter_steps > 0 and (
            step - self.pool.exploiter_step >= self.config.exploiter_every
        )
        if wants_exploiter and is_over and not self.pool.target:
            if self.pool.snapshot_step != step:
                self._snapshot()
            self.pool.target = self.pool.newest().source
            self.pool.exploiter_step = step
            self._save()
        if should_stop():
            raise Stopped(self.main.standing())
        if self.pool.target:
            name = f"exploiter_{self.pool.exploiters:03d}"
            if name not in self._background:
                self._begin_exploiter(name, should_stop)
            # It joins between two deals, at a step that does not depend on the workers.
            if after == 0 or step >= total or (step >= self.pool.until and step >= self.pool.exploiter_step + after):
                self._end_exploiter(name, should_stop)
        return step

    def _report(self, rate: float) -> None:
        step = self.main.model.num_timesteps
        by_score = sorted(self.pool.members, key=lambda member: member.beaten)
        mean = float(np.mean([member.beaten for member in by_score]))
        self._say(
            f"{step / self.config.learner.total_steps:4.0%} {step:>10,} steps {rate:6,.0f}/s  pool {len(by_score)}  "
            f"mean {mean:.2f}  hardest "
            + ", ".join(f"{member.name[:20]} {member.beaten:.2f}" for member in by_score[:4])
        )
        logger = self.main.logger
        logger.record("league/pool", len(by_score))
        logger.record("league/mean_score", mean)
        logger.record("league/lowest_score", by_score[0].beaten)

    def _deal(self) -> None:
        generator = np.random.default_rng([self.config.learner.seed, self.main.model.num_timesteps])
        shares = {"script": self.config.script_share, "pattern": self.config.pattern_share}
        if self.config.pattern_share:
            self.pool.renew_patterns(_PATTERNS, generator)
        weights = self.pool.weights(self.config.pfsp_exponent, self.config.floor, **shares)
        # Systematic sampling: as random as needed, with less variance than independent draws.
        places = (generator.random() + np.arange(self.config.seats)) / self.config.seats
        chosen = [self.pool.members[i].name for i in np.searchsorted(np.cumsum(weights), places * 0.999999)]
        order = [chosen[i] for i in generator.permutation(len(chosen))]
        is_pattern = {member.name: member.kind == "pattern" for member in self.pool.members}
        # One player for all patterns is faster. It has numbers for every seat, since both are dealt to games in turn.
        numbers = [numbers_in(name) if is_pattern[name] else [*KINDS["spot"].values()] for name in order]
        partners = {name: self._partner(name) for name in dict.fromkeys(chosen) if not is_pattern[name]}
        patterns = PatternPlayer(np.array(numbers), self._game)
        self.main.env.deal([partners.get(name, patterns) for name in order], order)

    def _partner(self, name: str) -> Player:
        """Return the policy of a member of the pool."""
        member = next(member for member in self.pool.members if member.name == name)
        is_installed = member.kind in ("script", "initial")
        player = policies.load(member.source if is_installed else self.folder / member.source, self._game)
        if isinstance(player, LearnedPolicy) and not is_installed:
            # The learner explores: without noise, an equally good opponent would always beat it.
            player.noise = self.main.state.exploration(self.main.model.num_timesteps)
        return player

    def _snapshot(self) -> None:
        """Put the learner into the pool, and save the league before anyone plays against the snapshot."""
        number = sum(member.kind == "snapshot" for member in self.pool.members)
        source = f"pool/snapshot_{number:03d}"
        self.main.policy().write(self.folder / source)
        self.pool.members.append(Member(Path(source).name, source, "snapshot"))
        self.pool.snapshot_step = self.main.model.num_timesteps
        self._save()

    def _begin_exploiter(self, name: str, should_stop: Callable[[], bool]) -> None:
        """Send the training of a best response to the pool's target to the workers."""
        learner, steps = self.config.learner, self.config.exploiter_steps
        self._say(f"{name} trains for {steps:,} steps against {Path(self.pool.target).name}")
        target, digest, bundle = self.folder / self.pool.target, None, None
        if self._background.is_elsewhere:
            digest, bundle = LearnedPolicy.read(target, self._game).digest, PolicyBundle.of(target)
        self._background.send(
            name,
            respond,
            str(target),
            self.folder / "exploiters" / name,
            learner.replace(evaluate_every=steps),
            steps,
            learner.seed + 1000 + self.pool.exploiters,
            _EXPLOITED_GAMES,
            should_stop if self._background.is_here else never,
            digest,
            bundle,
        )

    def _end_exploiter(self, name: str, should_stop: Callable[[], bool]) -> None:
        """Wait for the exploiter; if it ends with more than half of the drones, it joins the pool."""
        match, bundle = self._background.fetch(name, should_stop)
        bundle.unpack(self.folder / "exploiters")
        self._say(f"{name} against {Path(self.pool.target).name}: {match.standing()}, share {match.share():.2f}")
        if match.share() > 0.5:
            member = Member(name, f"exploiters/{name}", "exploiter")
            member.score = (1 - match.share()) * member.games
            self.pool.members.append(member)
        self.pool.exploiters += 1
        self.pool.target = ""
        self._save()

    def _save(self) -> None:
        # The pool must be of the same moment as the learner, so it is in the same file.
        plain = asdict(self.pool)
        self.main.save_checkpoint(pool=plain)
        write_json(self.folder / STATE, plain)
