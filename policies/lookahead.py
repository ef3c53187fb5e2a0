"""The planner's search: candidates for the next command, each tried in a copy of the game."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GRID_CELLS, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.kernels.game import Games
from swarm_pz.policy import Player
from swarm_pz.simulator.commands import CheckedCommands, interpolation_matrix

Array = NDArray[np.float64]

_FLOOR = -4.0
"""Smallest log-density of a candidate; the largest is 0."""
_NOISE_CELLS = 5
"""Cells a side on which random log-densities are drawn: as coarse as a swarm can follow."""
_FEWEST, _MOST = 4, 64
"""Bounds on the candidates of a round."""
_ELITES = 0.1
"""Fraction of a round's candidates that are parents of the next round's."""


class Lookahead:
    """Proposes commands and tries them under one game's rules; arguments are those of `PlannerConfig`.

    A round has `candidates` candidates; a decision can afford `rounds` rounds.
    """

    def __init__(self, config: GameConfig, horizon: float, drone_steps: int, promise: float) -> None:
        self._config, self._promise = config, promise
        self._ticks = max(1, round(horizon / CONTROL_PERIOD)) * TICKS_PER_CONTROL_PERIOD
        affordable = drone_steps // (config.num_drones * self._ticks // TICKS_PER_CONTROL_PERIOD)
        self.candidates = min(max(affordable, _FEWEST), _MOST)
        self.rounds = max(affordable // self.candidates, 1)
        self._trials = BatchEnv(config, self.candidates)
        centres = (np.arange(config.command_cells) + 0.5) / config.command_cells
        self._x, self._y = np.meshgrid(centres, centres)
        self._finer = interpolation_matrix(config.command_cells, _NOISE_CELLS)

    def propose(self, game: Games, team: int, last: Array | None, generator: np.random.Generator) -> Array:
        """Return log-densities (n, A, A): simple tactics, the last command and variations of it, mixtures."""
        positions = game.positions[0].astype(np.float64)
        is_own = game.teams[0] == team
        # All drones stand in for a side without drones.
        own, opposing = (positions[side] if side.any() else positions for side in (is_own, ~is_own))
        x, y = opposing.mean(axis=0)
        first = [
            np.zeros_like(self._x),
            self._ring(0.5, 0.5, 0.25, 0.15),
            self._ring(x, y, 0.25, 0.08),
            self._ring(x, y, 0.15, 0.08),
        ]
        if last is not None:
            first.insert(0, last)
        while len(first) < self.candidates:
            kind = generator.random()
            if last is not None and kind < 0.3:
                first.append(last + self._noise(1, generator)[0])
            elif kind < 0.45:
                first.append(2.0 * self._noise(1, generator)[0])
            else:
                first.append(self._mixture(own, opposing, generator))
        return _clip(np.stack(first[: self.candidates]))

    def _ring(self, x: float, y: float, radius: float, width: float) -> Array:
        return np.asarray(-(((np.hypot(self._x - x, self._y - y) - radius) / width) ** 2))

    def _mixture(self, own: Array, opposing: Array, generator: np.random.Generator) -> Array:
        """Return one to three rings or discs, most of them near drones, on a uniform background."""
        density = np.full_like(self._x, 10.0 ** generator.uniform(-3.0, -0.5))
        for _ in range(generator.integers(1, 4)):
            drones = opposing if generator.random() < 0.7 else own
            near = drones[generator.integers(len(drones))] + generator.normal(size=2) * 0.1
            x, y = near if generator.random() < 0.7 else generator.random(2)
            ring = self._ring(x, y, generator.uniform(0.0, 0.35), generator.uniform(0.06, 0.2))
            density += generator.uniform(0.2, 1.0) * np.exp(ring)
        return np.asarray(np.log(density))

    def breed(self, elites: Array, spread: float, generator: np.random.Generator) -> Array:
        """Return a round's candidates: elites, or mixtures of two elites, with noise added."""
        parents = elites[generator.integers(len(elites), size=(self.candidates, 2))]
        mixed = generator.random((self.candidates, 1, 1)) < 0.5
        share = np.where(mixed, generator.random((self.candidates, 1, 1)), 1.0)
        between = share * parents[:, 0] + (1.0 - share) * parents[:, 1]
        return _clip(between + spread * self._noise(self.candidates, generator))

    def _noise(self, count: int, generator: np.random.Generator) -> Array:
        coarse = generator.normal(size=(count, _NOISE_CELLS, _NOISE_CELLS))
        return np.asarray(self._finer @ coarse @ self._finer.T)

    def try_out(self, game: Games, team: int, candidates: Array, model: Player | None) -> Array:
        """Hold each candidate in a copy of the game up to the horizon; return their values (n,)."""
        simulator = self._trials.simulator
        simulator.restore(game)
        rows = np.arange(len(candidates))
        commands = simulator.control.read(np.exp(candidates), simulator.games, rows, team, "density", "candidates")
        simulator.command(team, CheckedCommands(commands), rows, holds=True)  # as in a step
        if model is None:
            simulator.advance(self._ticks)
        else:
            left = self._ticks
            model.reset([0] * len(rows), rows)
            while left > 0 and len(live := np.flatnonzero(~simulator.decided)):
                answers = self._trials.ask(model, np.full(len(live), 1 - team), live)
                simulator.command(1 - team, CheckedCommands(answers), live, holds=True)
                simulator.advance(min(left, self._config.step_ticks))
                left -= self._config.step_ticks
        return self._worth(team, int(game.ticks[0]))

    def _worth(self, team: int, start: int) -> Array:
        """Return the share of drones, plus a bonus for a win (minus one for a loss), larger if early, plus promise."""
        simulator = self._trials.simulator
        share = simulator.sizes[:, team] / self._config.num_drones
        early = 1.5 - 0.5 * (simulator.games.ticks - start) / self._ticks
        worth = share + np.where(share == 1.0, early, 0.0) - np.where(share == 0.0, early, 0.0)
        # Danger: how close the opposing field at a drone is to the threshold at which it captures.
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
        return np.asarray(worth + self._promise * promise)


def search(
    lookahead: Lookahead,
    game: Games,
    team: int,
    model: Player | None,
    last: Array | None,
    generator: np.random.Generator,
    is_over: Callable[[int], bool],
) -> Array:
    """Return the best log-density (A, A) that is found for one game.

    The cross-entropy method (Rubinstein, 1999): the best of a round's candidates are parents of the next round's.
    Without a model the opponent keeps its command. `last` is the previous log-density; `is_over` takes the rounds done.
    """
    candidates = lookahead.propose(game, team, last, generator)
    best, highest = np.asarray(candidates[0]), -np.inf
    elites = max(2, round(_ELITES * lookahead.candidates))
    done = 0
    while True:
        scores = lookahead.try_out(game, team, candidates, model)
        order = np.argsort(-scores, kind="stable")
        if scores[order[0]] > highest:
            best, highest = candidates[order[0]], float(scores[order[0]])
        done += 1
        if is_over(done):
            return best
        candidates = lookahead.breed(candidates[order[:elites]], 0.5 ** min(done - 1, 3), generator)


def _clip(logs: Array) -> Array:
    return np.asarray(np.maximum(logs - logs.max(axis=(1, 2), keepdims=True), _FLOOR))
