"""Sampling-based model-predictive play: try many densities in the simulator, send the best.

Privileged: it copies the game's true state, which no seat may see. It shows how well the game can be
played, and is no fair opponent of policies that play from observations.

Every command is searched for by the cross-entropy method (Rubinstein, "The cross-entropy method for
combinatorial and continuous optimization", 1999) over images of log-densities, each held for a few seconds of a
copy of the game; the best is sent for one command period, and the search begins anew. What the opponent
does meanwhile is what its model would do: keep its last command, play a named policy, or play
whichever known policy would have given its latest commands.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import CONTROL_PERIOD, GRID_CELLS, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.kernels.game import Games
from swarm_pz.policy import Player, ask, load, registered
from swarm_pz.scenario import Seed
from swarm_pz.settings import Config, check_count, check_number
from swarm_pz.simulator import Simulator
from swarm_pz.target import interpolation_matrix

Array = NDArray[np.float64]

_FLOOR = -4.0
"""Smallest log-density of a candidate; the largest is 0."""
_ELITES = 0.1
"""Fraction of a round's candidates that the next round's descend from."""
_NOISE_CELLS = 5
"""Cells a side on which random log-densities are drawn: as coarse as a swarm can follow."""
_FEWEST, _MOST = 4, 64
"""Candidates of a round."""
GUESS = "guess"
"""The model that stands for whichever known policy explains the opponent best."""
_MEMORY = 0.8
"""How much an older command counts, beside the one after it, in what explains the opponent."""


@dataclass(frozen=True, kw_only=True)
class PlannerConfig(Config):
    """How long and how far a planner looks ahead.

    Attributes
    ----------
    drone_steps : int
        Simulated drone-steps that a decision may cost; the same budget gives the same decision.
    milliseconds : float, optional
        For live play: search for this long instead, however many drone-steps that allows. Decisions
        then depend on the machine.
    horizon : float
        Seconds of game that each candidate is tried for.
    promise : float
        Weight of what has not been captured yet: how close each side's drones are to capture at the
        horizon.
    """

    drone_steps: int = 200_000
    milliseconds: float | None = None
    horizon: float = 3.0
    promise: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count(self.drone_steps, "drone_steps", 1, 10**12)
        if self.milliseconds is not None:
            check_number(self.milliseconds, "milliseconds", 0.0, 1e6, open_low=True)
        check_number(self.horizon, "horizon", CONTROL_PERIOD, 1e4)
        check_number(self.promise, "promise", 0.0, 1e6)


class _Guess(NamedTuple):
    """What each model expects as the next command (n, A, A), and how wrong it has been (n,)."""

    expected: Array
    errors: Array


class Planner:
    """Plays the best density it finds in the simulator.

    Parameters
    ----------
    config : GameConfig
    model : str, optional
        Name of the policy that it takes its opponent for, or "guess" for the one of all scripts and
        learned tactics that explains the opponent's latest commands best; without one the opponent is
        taken to keep its last command. Models begin anew at every decision.
    settings : PlannerConfig, optional

    Attributes
    ----------
    milliseconds : list of float
        What each decision took.
    """

    def __init__(self, config: GameConfig, model: str | None = None, settings: PlannerConfig | None = None) -> None:
        self.settings = settings if settings is not None else PlannerConfig()
        self.name = "planner" if model is None else f"planner:{model}"
        self.milliseconds: list[float] = []
        self._config = config
        names = [] if model is None else _known() if model == GUESS else [model]
        self._models: list[Player | None] = [load(name, config) for name in names]
        if model in (None, GUESS):
            self._models.insert(0, None)  # keeps its last command
        self._ticks = max(1, round(self.settings.horizon / CONTROL_PERIOD)) * TICKS_PER_CONTROL_PERIOD
        trial = config.num_drones * self._ticks // TICKS_PER_CONTROL_PERIOD
        affordable = self.settings.drone_steps // trial
        self._candidates = min(max(affordable, _FEWEST), _MOST)
        self._rounds = max(affordable // self._candidates, 1)
        self._trials, self._present = BatchEnv(config, self._candidates), BatchEnv(config)
        self._generators: dict[int, np.random.Generator] = {}
        self._last: dict[int, Array] = {}
        self._guesses: dict[int, _Guess] = {}
        centres = (np.arange(config.command_cells) + 0.5) / config.command_cells
        self._x, self._y = np.meshgrid(centres, centres)
        self._finer = interpolation_matrix(config.command_cells, _NOISE_CELLS)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""
        for seed, row in zip(seeds, rows.tolist(), strict=True):
            self._generators[row] = np.random.default_rng(seed)
            self._last.pop(row, None)
            self._guesses.pop(row, None)

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> Array:
        """Answer the games in `rows` (n,), from the sides `teams` (n,), with densities (n, A, A)."""
        densities = []
        for team, row in zip(teams.tolist(), rows.tolist(), strict=True):
            began = time.perf_counter()
            self._last[row] = self._search(simulator, team, row, began)
            densities.append(np.exp(self._last[row]))
            self.milliseconds.append(1000.0 * (time.perf_counter() - began))
        return np.stack(densities)

    def _search(self, simulator: Simulator, team: int, row: int, began: float) -> Array:
        """Return the best log-density (A, A) found for one game."""
        generator, game = self._generators[row], simulator.snapshot([row])
        model = self._models[0] if len(self._models) == 1 else self._explain(game, team, row)
        candidates = self._propose(game, team, self._last.get(row), generator)
        best, highest = np.asarray(candidates[0]), -np.inf
        elites = max(2, round(_ELITES * self._candidates))
        done = 0
        while True:
            scores = self._try(game, team, candidates, model)
            order = np.argsort(-scores, kind="stable")
            if scores[order[0]] > highest:
                best, highest = candidates[order[0]], float(scores[order[0]])
            done += 1
            if self._is_over(done, began):
                return best
            candidates = self._breed(candidates[order[:elites]], 0.5 ** min(done - 1, 3), generator)

    def _is_over(self, rounds: int, began: float) -> bool:
        if self.settings.milliseconds is None:
            return rounds >= self._rounds
        spent = 1000.0 * (time.perf_counter() - began)
        return spent * (rounds + 1) / rounds > self.settings.milliseconds  # another round would not fit

    def _explain(self, game: Games, team: int, row: int) -> Player | None:
        """Return the model that would have given the opponent's latest commands; note what each says now."""
        given = game.targets[0, 1 - team]
        guess = self._guesses.get(row)
        errors = np.zeros(len(self._models))
        if guess is not None:
            errors = _MEMORY * guess.errors + np.abs(guess.expected - given).sum(axis=(1, 2))
        expected = [given]  # of the one that keeps its command
        self._present.simulator.restore(game)
        only, side = np.zeros(1, np.int64), np.array([1 - team])
        for model in self._models[1:]:
            assert model is not None  # noqa: S101  (only the first is)
            model.reset([0], only)
            density = ask(model, self._present, side, only)[0]
            expected.append(density / max(density.sum(), 1e-12))
        self._guesses[row] = _Guess(np.stack(expected), errors)
        return self._models[int(errors.argmin())]

    # --- candidates -----------------------------------------------------------------------------

    def _propose(self, game: Games, team: int, last: Array | None, generator: np.random.Generator) -> Array:
        """Return log-densities (n, A, A): simple tactics, the last command and variations of it, mixtures."""
        positions = game.positions[0].astype(np.float64)
        own, opposing = positions[game.teams[0] == team], positions[game.teams[0] != team]
        x, y = opposing.mean(axis=0)
        first = [
            np.zeros_like(self._x),
            self._ring(0.5, 0.5, 0.25, 0.15),
            self._ring(x, y, 0.25, 0.08),
            self._ring(x, y, 0.15, 0.08),
        ]
        if last is not None:
            first.insert(0, last)
        while len(first) < self._candidates:
            kind = generator.random()
            if last is not None and kind < 0.3:
                first.append(last + self._noise(1, generator)[0])
            elif kind < 0.45:
                first.append(2.0 * self._noise(1, generator)[0])
            else:
                first.append(self._mixture(own, opposing, generator))
        return _clip(np.stack(first[: self._candidates]))

    def _ring(self, x: float, y: float, radius: float, width: float) -> Array:
        return np.asarray(-(((np.hypot(self._x - x, self._y - y) - radius) / width) ** 2))

    def _mixture(self, own: Array, opposing: Array, generator: np.random.Generator) -> Array:
        """Return one to three rings or discs, most of them near drones, on some ground."""
        density = np.full_like(self._x, 10.0 ** generator.uniform(-3.0, -0.5))
        for _ in range(generator.integers(1, 4)):
            drones = opposing if generator.random() < 0.7 else own
            near = drones[generator.integers(len(drones))] + generator.normal(size=2) * 0.1
            x, y = near if generator.random() < 0.7 else generator.random(2)
            ring = self._ring(x, y, generator.uniform(0.0, 0.35), generator.uniform(0.06, 0.2))
            density += generator.uniform(0.2, 1.0) * np.exp(ring)
        return np.asarray(np.log(density))

    def _breed(self, elites: Array, spread: float, generator: np.random.Generator) -> Array:
        """Return as many candidates as before, between pairs of elites and around them."""
        parents = elites[generator.integers(len(elites), size=(self._candidates, 2))]
        mixed = generator.random((self._candidates, 1, 1)) < 0.5
        share = np.where(mixed, generator.random((self._candidates, 1, 1)), 1.0)
        between = share * parents[:, 0] + (1.0 - share) * parents[:, 1]
        return _clip(between + spread * self._noise(self._candidates, generator))

    def _noise(self, count: int, generator: np.random.Generator) -> Array:
        coarse = generator.normal(size=(count, _NOISE_CELLS, _NOISE_CELLS))
        return np.asarray(self._finer @ coarse @ self._finer.T)

    # --- trials -----------------------------------------------------------------------------------

    def _try(self, game: Games, team: int, candidates: Array, model: Player | None) -> Array:
        """Hold each candidate in a copy of the game to the horizon; return what each is worth (n,)."""
        simulator = self._trials.simulator
        simulator.restore(game)
        simulator.games.seeds[:] = 0  # what will happen by chance is not to be known
        simulator.command(team, np.exp(candidates))
        if model is None:
            simulator.advance(self._ticks)
        else:
            rows, left = np.arange(len(candidates)), self._ticks
            model.reset([0] * len(rows), rows)
            while left > 0 and len(live := np.flatnonzero(~simulator.decided)):
                answers = ask(model, self._trials, np.full(len(live), 1 - team), live)
                simulator.command(1 - team, answers, live)
                simulator.advance(min(left, self._config.step_ticks))
                left -= self._config.step_ticks
        return self._worth(team, int(game.ticks[0]))

    def _worth(self, team: int, start: int) -> Array:
        """Return the share of drones, a bonus for a win, the sooner the better, and the promise."""
        simulator = self._trials.simulator
        share = simulator.sizes[:, team] / self._config.num_drones
        early = 1.5 - 0.5 * (simulator.games.ticks - start) / self._ticks
        worth = share + np.where(share == 1.0, early, 0.0) - np.where(share == 0.0, early, 0.0)
        # A drone is captured where the opposing field exceeds a threshold: how near it is to that.
        fields = simulator.capture_field
        limits = self._config.capture.threshold * np.maximum(fields.max(axis=(2, 3)), 1e-9)
        cells = np.minimum((GRID_CELLS * simulator.positions).astype(np.int64), GRID_CELLS - 1)
        is_own = simulator.teams == team
        rows = np.arange(len(share))[:, None]
        danger = np.empty(is_own.shape)
        for side in (0, 1):
            values = fields[rows, 1 - side, cells[..., 1], cells[..., 0]] / limits[:, 1 - side, None]
            danger = np.where(simulator.teams == side, np.minimum(values, 1.0) ** 2, danger)
        promise = np.where(is_own, -danger, danger).sum(axis=1) / self._config.num_drones
        return np.asarray(worth + self.settings.promise * promise)


def _known() -> list[str]:
    """Return the names of the project's own scripts and learned tactics, best explanations first."""
    modules = ("swarm_pz.policies.zoo", "swarm_pz.policies.scripted")
    return [name for module in modules for name, point in sorted(registered().items()) if point.module == module]


def _clip(logs: Array) -> Array:
    return np.asarray(np.maximum(logs - logs.max(axis=(1, 2), keepdims=True), _FLOOR))


def planner(config: GameConfig, model: str | None = None) -> Planner:
    """Search the simulator for the best density; sees more than any seat (privileged)."""
    return Planner(config, model)
