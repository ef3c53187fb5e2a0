"""An opponent-model planner: it plans against the policies that it recognises, and plays a learned tactic otherwise.

It sees drones, and nothing else. From the first command on it predicts where each policy that it knows would fly its
drones; the one whose drones come there, to within a small tolerance, is the opponent. It plans against that one by the
search of `planner`, in a game of its own, which is exact for as long as the predictions hold. An opponent whose drones
once come where no known policy would fly them is a stranger to the game's end, and meets the learned tactic. So does
every opponent where commands come into force later than they are asked for, as on the server, and where chance decides
flights: failures, lost messages.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.kernels.game import Games
from swarm_pz.policies.drone_tracker import DroneTracker, checked_drones, split_drones
from swarm_pz.policies.lookahead import Array, Lookahead, search
from swarm_pz.policies.planner import PlannerConfig, known_tactics
from swarm_pz.policy import Player, Policy, PrivilegedPolicy, kind_of, load, name_of
from swarm_pz.simulator.spawn import Seed

TACTIC = "veteran"
"""What strangers meet."""
_NEAR = 0.004
"""How far a side's drones may be from their predicted places, on average: a share of the way that they make from
rest in a command period, or of half the map. Another tactic's are ten times as far off."""


class _Meeting:
    """What is known of one game's opponent."""

    def __init__(self, seed: Seed) -> None:
        self.generator = np.random.default_rng(seed)
        self.is_stranger = False
        self.number: int | None = None
        """Which of the known ones it is, as far as was seen."""
        self.predicted: Games | None = None
        """The game a command period on, one for each of the known ones."""
        self.last: Array | None = None
        """The log-density sent last, if it was planned."""


class Master:
    """Recognises the opponent by how its drones fly, and plans against it; plays a learned tactic against strangers.

    Parameters
    ----------
    config : GameConfig
        The games' rules.
    tactic : str, Path or Policy
        What strangers meet.
    known : sequence of str, optional
        Names of the policies that it recognises; all scripts and learned tactics of this project if not given. Where
        control systems from outside of the kernels fly, it recognises nobody.
    settings : PlannerConfig
        How long and how far it plans.

    Raises
    ------
    PolicyError
        If there is no such tactic, or it is privileged; if one that is known does not answer densities, or if it were
        to plan by the clock.

    Attributes
    ----------
    plays_as : str
        The learned tactic that strangers meet; a search for the master's weaknesses may begin there.
    digest : str
        A hash of the policies that it knows, of all learned weights that it plays with, and of how it plans.
    """

    answers = "density"
    observation = ObservationConfig(kind="drones")

    def __init__(
        self,
        config: GameConfig,
        tactic: str | Path | Policy = TACTIC,
        known: Sequence[str] | None = None,
        settings: PlannerConfig = PlannerConfig(drone_steps=40_000),  # noqa: B008  (frozen)
    ) -> None:
        self.name, self.plays_as = "master", str(tactic) if isinstance(tactic, str | Path) else ""
        is_given = any(system.kernel != "ergodic" for system in config.team_systems)
        if is_given:
            config = config.replace(controllers="ergodic")  # any that takes densities: no flight is predicted
        self._config = config
        if settings.milliseconds is not None:
            raise PolicyError(f"a master plans for drone_steps, not for milliseconds, got {settings}")
        learned = load(tactic, config)
        if isinstance(learned, PrivilegedPolicy):
            raise PolicyError(f"strangers must meet a policy that plays by what it sees, got {name_of(learned)}")
        self._tactic = learned
        acceleration = config.controller.max_acceleration * config.dynamics.speed_factor
        self._near = _NEAR * min(0.5 * acceleration * config.command_period**2, 0.5)
        self._tracker = DroneTracker(config)
        names = [] if is_given else known_tactics() if known is None else list(known)
        if isinstance(known, str) or any(kind_of(name) != self.answers for name in names):
            raise PolicyError(f"known must be names of policies that answer densities, got {known!r}")
        self._known = [load(name, config) for name in names]
        """Each in step with the games."""
        self._models: list[Player] = [load(name, config) for name in names]
        """The same, begun anew with every plan."""
        learned_parts = [str(getattr(player, "digest", "")) for player in (self._tactic, *self._known)]
        story = "\n".join([self.name, name_of(self._tactic), repr(settings), *names, *learned_parts])
        self.digest = hashlib.sha256(story.encode()).hexdigest()[:32]
        self._future = BatchEnv(config, max(len(names), 1))
        self._lookahead = Lookahead(config, settings.horizon, settings.drone_steps, settings.promise)
        self._met: dict[int, _Meeting] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""
        self._met |= {row: _Meeting(seed) for seed, row in zip(seeds, rows.tolist(), strict=True)}
        self._tracker.forget(rows)
        self._tactic.reset(seeds, rows)
        for policy in self._known:
            policy.reset([0] * len(rows), rows)

    def act(self, observations: NDArray[np.float32], rows: NDArray[np.int64]) -> Array:
        """Answer observations (n, N, 5) of the games in `rows` with densities (n, A, A).

        Raises
        ------
        PolicyError
            If no drones can be as is observed; what is known of games stays as it was.
        """
        observations = checked_drones(observations, len(rows), self._config.num_drones)
        densities = np.empty((len(rows), self._config.command_cells, self._config.command_cells))
        if not len(rows):
            return densities
        env = self._tracker.env
        came = np.array([self._matches_prediction(observations[place], row) for place, row in enumerate(rows.tolist())])
        self._tracker.look(observations[~came], rows[~came])
        is_known = np.array([self._met[row].number is not None for row in rows.tolist()])
        if len(others := rows[~is_known]):
            densities[~is_known] = self._tactic.act(env.observe(self._tactic.observation, RED, others), others)
        for place in np.flatnonzero(is_known).tolist():
            densities[place] = np.exp(self._plan(int(rows[place])))
        simulator, name = env.simulator, f"policy {self.name}'s answer"
        commands = simulator.control.read(densities, simulator.games, rows, RED, self.answers, name)
        env.simulator.command_checked(RED, commands, rows, holds=True)
        self._predict(np.array([row for row in rows.tolist() if not self._met[row].is_stranger], np.int64))
        return densities

    def _matches_prediction(self, drones: NDArray[np.float32], row: int) -> bool:
        """Find the known policy that a game's drones (N, 5) were flown by; return whether there is one."""
        met = self._met[row]
        future, met.predicted, met.number = met.predicted, None, None
        if future is None:
            return False
        positions, _, teams = split_drones(drones)
        off = np.abs(future.positions - positions)
        apart = np.max([off[:, teams == side].mean(axis=(1, 2)) for side in (RED, BLUE) if side in teams], axis=0)
        apart[(future.teams != teams).any(axis=1)] = np.inf
        nearest = int(apart.argmin())
        if apart[nearest] > self._near:
            met.is_stranger = True
            return False
        met.number = nearest
        came: list[Any] = [array[nearest : nearest + 1] for array in future]
        self._tracker.adopt(Games(*came), drones, row)
        return True

    def _plan(self, row: int) -> Array:
        """Return the best log-density (A, A) that is found against a game's recognised opponent."""
        met = self._met[row]
        assert met.number is not None  # noqa: S101
        game = self._tracker.env.simulator.snapshot([row])
        met.last = search(self._lookahead, game, RED, self._models[met.number], met.last, met.generator)
        return met.last

    def _predict(self, rows: NDArray[np.int64]) -> None:
        """Play games on for a command period, against each known policy."""
        if not len(rows) or not self._known:
            return
        env, future = self._tracker.env, self._future.simulator
        sides, everybody = np.full(len(rows), BLUE), np.arange(len(self._known))
        answers = np.stack([env.ask(policy, sides, rows) for policy in self._known], axis=1)
        for row, commands in zip(rows.tolist(), answers, strict=True):
            future.restore(env.simulator.snapshot([row]))
            future.command_checked(BLUE, commands, everybody, holds=True)
            future.advance(self._config.step_ticks)
            self._met[row].predicted = future.snapshot()


def master(config: GameConfig) -> Master:
    """Recognise the opponent by how its drones fly, and plan against it; play as veteran against strangers."""
    return Master(config)
