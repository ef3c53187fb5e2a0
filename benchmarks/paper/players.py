"""Players of figures: a fixed command, a person's drawings at a person's pace, and a tactic of two commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.drawings import painted
from benchmarks.paper.figure import Setting
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.policy import Policy, load
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.densities import disc

Array = NDArray[np.float64]
Way = Literal["person", "program"]
WAYS: tuple[Way, ...] = ("person", "program")
PACE = 3
"""Seconds between two commands of a person."""


class Fixed:
    """Send one command (A, A), in [0, 1], which never changes."""

    name = "fixed"
    observation = ObservationConfig(grid=2, channels=("time_left",))

    def __init__(self, density: Array) -> None:
        self._density = density

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games; nothing is remembered."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with the command (n, A, A)."""
        return np.broadcast_to(self._density, (len(rows), *self._density.shape))


class Person:
    """Play a player's tactic as a person does: paint its density, and send the drawing every few seconds.

    The player acts at every step, but only one answer in `steps` is sent. So a tactic that counts its commands still
    counts seconds.
    """

    def __init__(
        self, player: Policy, paint: Callable[[Array], Array] = lambda density: density, steps: int = PACE
    ) -> None:
        self.name = f"{getattr(player, 'name', type(player).__name__)}, every {steps} steps"
        self.observation = player.observation
        self._player, self._paint, self._steps = player, paint, steps
        self._answered: dict[int, int] = {}
        self._commands: dict[int, Array] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games: their first command is the player's first."""
        self._player.reset(seeds, rows)
        self._answered.update(dict.fromkeys(rows.tolist(), 0))

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with the commands (n, A, A) in force."""
        for row, answer in zip(rows.tolist(), self._player.act(observations, rows), strict=True):
            if self._answered[row] % self._steps == 0:
                self._commands[row] = self._paint(np.array(answer, np.float64))
            self._answered[row] += 1
        return np.stack([self._commands[row] for row in rows.tolist()])


def player(name: str, way: Way, setting: Setting, *, repels: bool = False) -> Policy:
    """Load a player: a program, which sends densities each second, or a person, who draws the same tactic."""
    tactic = cast("Policy", load(name, setting.config))
    if way == "program":
        return tactic
    return Person(tactic, lambda density: painted(density, setting.mapping, repels=repels))


class Ensemble:
    """Command one shape: in the centre, and around the opposing drones once at most `last` of them are left.

    `make` turns places (n, 2) into densities (n, A, A); by default into discs.
    """

    name = "ensemble"
    observation = ObservationConfig(grid=25, channels=("opposing_positions", "own_share"))

    def __init__(self, config: GameConfig, make: Callable[[Array], Array] | None = None, last: int = 1) -> None:
        self._most = 1.0 - (last + 0.5) / config.num_drones
        self._make = make if make is not None else shaped(config)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games; nothing is remembered."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with densities (n, A, A)."""
        positions, share = observations[:, 0].astype(np.float64), observations[:, 1, 0, 0] / 255
        # Sums of whole numbers depend neither on their order nor on the number of games.
        odd = 2.0 * np.arange(positions.shape[-1]) + 1.0
        weight = 2.0 * len(odd) * np.maximum(positions.sum(axis=(1, 2)), 1.0)
        places = np.stack([positions.sum(axis=axis) @ odd for axis in (1, 2)], axis=1) / weight[:, None]
        return self._make(np.where((share > self._most)[:, None], places, 0.5))


def shaped(
    config: GameConfig, shape: Callable[[Array], Array] = lambda distance: disc(distance, 0.1)
) -> Callable[[Array], Array]:
    """Return a function from places to densities; `shape` takes the distances (n, A, A) of cells from the places."""
    centres = (np.arange(config.command_cells) + 0.5) / config.command_cells

    def make(places: Array) -> Array:
        offset = centres[None, :] - places[:, :, None]
        density = shape(np.hypot(offset[:, 0, None, :], offset[:, 1, :, None]))
        return np.asarray(density / density.max(axis=(1, 2), keepdims=True))

    return make


class Captures:
    """Captures so far of red and of blue, (2,) after every step of every game."""

    def __init__(self, games: int) -> None:
        self.totals: list[list[NDArray[np.int64]]] = [[np.zeros(2, np.int64)] for _ in range(games)]

    def __call__(self, rollout: Rollout) -> None:
        """Add the captures of the running games."""
        captures = rollout.simulator.games.captures
        for row in rollout.rows.tolist():
            self.totals[row].append(captures[row].astype(np.int64))


def most_within(totals: Sequence[NDArray[np.int64]], steps: int) -> NDArray[np.int64]:
    """Return the most captures of red and of blue (2,) within `steps` steps of a game."""
    counts = np.array(totals)
    later = counts[np.minimum(np.arange(len(counts)) + steps, len(counts) - 1)]
    return np.asarray((later - counts).max(axis=0))
