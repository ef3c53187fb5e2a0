"""Sampling-based model-predictive play: try many densities in the simulator, send the best.

Privileged: it copies the game's true state, so it is no fair opponent of policies that play from observations.

Every command is the best of many images of log-densities (`lookahead`), each held for a few seconds in a copy of the
game. There a model replaces the opponent: it keeps the last command, plays a named policy, or plays the known policy
that explains the opponent's latest commands best.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.config.base import Config, Range, ToMillion
from swarm_pz.config.system import ControlSystem, serves_densities
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import KindError
from swarm_pz.kernels.game import Games
from swarm_pz.policies.lookahead import Array, Lookahead, search
from swarm_pz.policy import Player, kind_of, load, registered
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import Seed

GUESS = "guess"
"""Stands for the known policy that explains the opponent best."""
_MEMORY = 0.8
"""Weight of a command in a model's error, relative to the command after it."""


@dataclass(frozen=True, kw_only=True)
class PlannerConfig(Config):
    """Budget and horizon of a planner."""

    drone_steps: Annotated[int, Range(1, 10**12)] = 200_000
    """Simulated drone-steps of a decision; the same budget gives the same decision."""
    milliseconds: Annotated[float, Range(1e-3, 1e6)] | None = None
    """For live play: time limit of a decision, instead of steps; decisions then depend on the machine."""
    horizon: Annotated[float, Range(CONTROL_PERIOD, 1e4)] = 3.0
    """Seconds of game for each candidate."""
    promise: ToMillion = 0.5
    """Weight of the drones' closeness to capture at the horizon."""


class _Guess(NamedTuple):
    """Each model's next command (n, A, A), and past error (n,)."""

    expected: Array
    errors: Array


class _Bench(NamedTuple):
    """A planner's tools for one set of rules."""

    lookahead: Lookahead
    present: BatchEnv
    """One game, which models observe."""
    models: dict[ControlSystem, list[Player | None]]
    """By the opponent's system; None is an opponent that keeps its last command."""


class Planner:
    """Plays the best density that it finds in the simulator, by the rules of the game.

    `model` is the policy that stands for the opponent, or "guess" for the known one that explains the opponent's latest
    commands best. Without a model, the opponent keeps its last command. Models are reset at every decision;
    `milliseconds` lists the times of decisions. Raises a KindError if no team's control system serves densities, or if
    the model cannot command any opposing system.
    """

    def __init__(self, config: GameConfig, model: str | None = None, settings: PlannerConfig | None = None) -> None:
        self.settings = settings if settings is not None else PlannerConfig()
        self.name = "planner" if model is None else f"planner:{model}"
        self.milliseconds: list[float] = []
        self._model = model
        self._benches: dict[GameConfig, _Bench] = {}
        self._generators: dict[int, np.random.Generator] = {}
        self._last: dict[int, Array] = {}
        self._guesses: dict[int, _Guess] = {}
        self._config = config
        self._check_systems(config.team_systems)

    def for_system(self, system: ControlSystem) -> Planner:
        """Return itself; raise a KindError if it cannot command the system, or its model that of the other team."""
        self._check_systems([system])
        return self

    def _check_systems(self, systems: Sequence[ControlSystem]) -> None:
        """Raise a KindError if it can play with none of these systems."""
        first, second = self._config.team_systems
        faults = []
        for system in systems:
            try:
                if not serves_densities(system, self._config):
                    raise KindError(
                        f"{self.name} searches for densities, but the control system {system.name} takes commands of "
                        f"kind {system.takes!r}: choose another policy, or another system by GameConfig.controllers"
                    )
                self._models(self._bench(self._config), second if system == first else first)
            except KindError as error:
                faults.append(error)
        if faults and len(faults) == len(systems):
            raise faults[0]

    def _bench(self, config: GameConfig) -> _Bench:
        if config not in self._benches:
            settings = self.settings
            lookahead = Lookahead(config, settings.horizon, settings.drone_steps, settings.promise)
            self._benches[config] = _Bench(lookahead, BatchEnv(config), {})
        return self._benches[config]

    def _models(self, bench: _Bench, opposing: ControlSystem) -> list[Player | None]:
        """Return the models of an opponent with a control system."""
        if opposing not in bench.models:
            config, guesses = bench.present.config, self._model == GUESS
            names = known_tactics(opposing, config) if guesses else [] if self._model is None else [self._model]
            made: list[Player | None] = [None] if guesses or self._model is None else []
            try:
                bench.models[opposing] = made + [load(name, config, opposing) for name in names]
            except KindError as error:
                raise KindError(f"{self.name} cannot take its opponent for {self._model!r}: {error}") from error
        return bench.models[opposing]

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""
        for seed, row in zip(seeds, rows.tolist(), strict=True):
            self._generators[row] = np.random.default_rng(seed)
            self._last.pop(row, None)
            self._guesses.pop(row, None)

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> Array:
        """Return densities (n, A, A) for the sides `teams` (n,) of the games in `rows` (n,)."""
        bench = self._bench(simulator.config)
        densities = []
        for team, row in zip(teams.tolist(), rows.tolist(), strict=True):
            began = time.perf_counter()
            game = simulator.snapshot([row])
            game.seeds[:] = 0  # the planner must not foresee random events
            self._last[row] = self._search(bench, game, team, row, began)
            densities.append(np.exp(self._last[row]))
            self.milliseconds.append(1000.0 * (time.perf_counter() - began))
        return np.stack(densities)

    def _search(self, bench: _Bench, game: Games, team: int, row: int, began: float) -> Array:
        """Return the best log-density (A, A) found for one game."""
        control = bench.present.simulator.control
        models = self._models(bench, control.systems[int(game.flown_by[0, 1 - team])])
        model = models[0] if len(models) == 1 else self._explain(bench, models, game, team, row)
        return search(
            bench.lookahead,
            game,
            team,
            model,
            self._last.get(row),
            self._generators[row],
            lambda done: self._is_over(done, bench.lookahead.rounds, began),
        )

    def _is_over(self, rounds: int, affordable: int, began: float) -> bool:
        if self.settings.milliseconds is None:
            return rounds >= affordable
        spent = 1000.0 * (time.perf_counter() - began)
        return spent * (rounds + 1) / rounds > self.settings.milliseconds  # another round would not fit

    def _explain(
        self, bench: _Bench, models: Sequence[Player | None], game: Games, team: int, row: int
    ) -> Player | None:
        """Return the model that explains the opponent's latest commands best; keep each one's next command."""
        given = game.targets[0, 1 - team]
        guess = self._guesses.get(row)
        errors = np.zeros(len(models))
        if guess is not None:
            errors = _MEMORY * guess.errors + np.abs(guess.expected - given).sum(axis=(1, 2))
        expected = [given]  # for the opponent that keeps its command
        bench.present.simulator.restore(game)
        only, side = np.zeros(1, np.int64), np.array([1 - team])
        for model in models[1:]:
            assert model is not None  # noqa: S101  (only the first is)
            model.reset([0], only)
            answer = bench.present.ask(model, side, only)
            simulator = bench.present.simulator
            density = simulator.control.pictures(simulator.games, answer[:, None], only, side)[0, 0]
            expected.append(density / max(density.sum(), 1e-12))
        self._guesses[row] = _Guess(np.stack(expected), errors)
        return models[int(errors.argmin())]


def known_tactics(system: ControlSystem, config: GameConfig) -> list[str]:
    """Return the project's own learned tactics and scripts that command a system, learned ones first."""
    takes = "density" if serves_densities(system, config) else system.takes
    modules = ("swarm_pz.policies.zoo", "swarm_pz.policies.scripted", "swarm_pz.policies.commanders")
    known = [name for module in modules for name, point in sorted(registered().items()) if point.module == module]
    return [name for name in known if kind_of(name) == takes]


def planner(config: GameConfig, model: str | None = None) -> Planner:
    """Search the simulator for the best density, with the game's true state (privileged)."""
    return Planner(config, model)
