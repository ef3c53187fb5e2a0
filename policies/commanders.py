"""Scripts for control systems that take other commands than densities.

A script is a function from a `GameState` to a command that the system's `parse` reads; `commander` makes it a policy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.policy.protocol import ANY
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces import densities as shapes

Array = NDArray[np.float64]

CLUSTER = 0.2
"""Largest distance from a drone to others in its cluster, in map widths."""
CLOSING_S = 12
"""Seconds in which a ring closes."""
WIDE, TIGHT = 0.32, 0.14
"""Radii of an open and of a closed ring."""


@dataclass(frozen=True)
class GameState:
    """One game as one side sees it."""

    own: Array
    """float64 (n, 2): positions of the side's own drones, in map widths."""
    opposing: Array
    """float64 (m, 2): positions of the other side's drones, in map widths."""
    velocities: Array
    """float64 (n, 2): velocities of its own drones."""
    numbers: NDArray[np.int64]
    """int64 (n,): numbers of its own drones in the game."""
    step: int
    """Commands before this one."""
    system: ControlSystem
    """The control system of the team."""
    config: GameConfig

    @property
    def seconds(self) -> float:
        """Time since the start."""
        return self.step * self.config.command_period

    def largest_cluster(self) -> Array:
        """Return the middle (2,) of the largest cluster of opposing drones."""
        if not len(self.opposing):
            return np.full(2, 0.5)
        near = _distances(self.opposing, self.opposing) < CLUSTER
        return np.asarray(self.opposing[near[near.sum(axis=1).argmax()]].mean(axis=0))

    def weakest(self) -> Array:
        """Return the position (2,) of the opposing drone with the fewest teammates nearby; of several, the nearest."""
        if not len(self.opposing):
            return np.full(2, 0.5)
        helpers = (_distances(self.opposing, self.opposing) < CLUSTER).sum(axis=1)
        away = _distances(self.opposing, self.own).mean(axis=1) if len(self.own) else np.zeros(len(self.opposing))
        return np.asarray(self.opposing[np.lexsort((away, helpers))[0]])

    def refuge(self) -> Array:
        """Return the point (2,) of a grid off the walls whose nearest opposing drone is farthest away."""
        line = np.linspace(0.1, 0.9, 9)
        places = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
        if not len(self.opposing):
            return np.full(2, 0.5)
        return np.asarray(places[_distances(places, self.opposing).min(axis=1).argmax()])

    def closing(self) -> float:
        """Return the radius of a ring that closes repeatedly."""
        return WIDE + (TIGHT - WIDE) * (self.seconds % CLOSING_S) / CLOSING_S

    def ring(self, centre: Array, radius: float, count: int, turn: float = 0.0) -> Array:
        """Return places (count, 2) on a circle, clipped to the square."""
        angles = turn + 2.0 * np.pi * np.arange(count) / max(count, 1)
        places = centre + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return np.asarray(places.clip(0.02, 0.98))

    def image(self, density: Callable[[Array], Array], place: Array) -> Array:
        """Return an image (A, A) of a function of the distance from a place, scaled to a largest value of 1."""
        x, y = shapes.cell_centres(self.config.command_cells)
        values = density(np.hypot(x - place[0], y - place[1]))
        return np.asarray(values / values.max())


def _distances(one: Array, other: Array) -> Array:
    """Return the distances (n, m) of points (n, 2) from points (m, 2)."""
    apart = one[:, None] - other[None]
    return np.asarray(np.sqrt((apart * apart).sum(axis=2)))


Play = Callable[[GameState], Any]


class Commander:
    """A policy that plays a script for a control system; if none is given, for the game's first."""

    observation = ObservationConfig(kind="drones")

    def __init__(self, script: Script, config: GameConfig, system: ControlSystem | None = None) -> None:
        self.name = script.__name__
        self._script, self._config, self._system = script, config, system
        self.answers = script.answers if system is None else system.takes
        self._steps: dict[int, int] = {}

    def for_system(self, system: ControlSystem) -> Commander:
        """Return the policy for a team with a control system; itself, if it has that one already."""
        return self if system == self._system else Commander(self._script, self._config, system)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows."""
        self._steps |= dict.fromkeys(rows.tolist(), 0)

    def act(self, observations: NDArray[np.float32], rows: NDArray[np.int64]) -> Array:
        """Return commands (n, ...) for observations (n, N, 5)."""
        system = self._system if self._system is not None else self._config.team_systems[0]
        commands = np.empty((len(rows), *system.space(self._config).shape))
        for place, (row, drones) in enumerate(zip(rows.tolist(), observations.astype(np.float64), strict=True)):
            own = drones[:, 4] > 0
            state = GameState(
                own=drones[own, :2],
                opposing=drones[~own, :2],
                velocities=drones[own, 2:4],
                numbers=np.flatnonzero(own),
                step=self._steps[row],
                system=system,
                config=self._config,
            )
            self._steps[row] += 1
            commands[place] = system.parse(self._script.play(state), self._config, f"what {self.name} asks for")
        return commands


class Script:
    """A named script; calling it with a game makes a policy that plays it.

    `play` maps a `GameState` to a command of the kind `answers`, as of `ControlSystem.takes`.
    """

    def __init__(self, play: Play, answers: str) -> None:
        self.play, self.answers = play, answers
        self.__name__, self.__doc__, self.__module__ = play.__name__, play.__doc__, play.__module__

    def __reduce__(self) -> str:
        """Pickle by name, as Python would pickle the decorated function."""
        return self.__name__

    def __call__(self, config: GameConfig) -> Commander:
        """Make a policy for a game."""
        return Commander(self, config)


def commander(answers: str) -> Callable[[Play], Script]:
    """Turn a function from a `GameState` to commands of a kind into a script that makes policies."""
    return lambda play: Script(play, answers)


@commander(ANY)
def hold(state: GameState) -> Any:
    """Send the control system's default command, of whatever kind."""
    return state.system.default(state.config)


# --- attraction: two images, one attracts and one repels --------------------------------------------


@commander("attraction")
def besiege(state: GameState) -> Any:
    """Attract everybody to a broad ring around a place between the centre and the opponents' largest cluster."""
    place = 0.5 + 0.3 * (state.largest_cluster() - 0.5)
    ring = state.image(lambda distance: shapes.ring(distance, width=0.15), place)
    return np.stack([ring, np.zeros_like(ring)])


@commander("attraction")
def strangle(state: GameState) -> Any:
    """Attract everybody to a ring that closes repeatedly around the opponents' largest cluster; its middle repels."""
    cluster, radius = state.largest_cluster(), state.closing()
    ring = state.image(lambda distance: shapes.ring(distance, radius, 0.1), cluster)
    return np.stack([ring, 0.3 * state.image(lambda distance: shapes.disc(distance, radius / 3), cluster)])


@commander("attraction")
def shun(state: GameState) -> Any:
    """Repel drones from the opponents' largest cluster, and attract them to the place farthest from all opponents."""
    cluster, refuge = state.largest_cluster(), state.refuge()
    return np.stack(
        [
            state.image(lambda distance: shapes.disc(distance, 0.15), refuge),
            state.image(lambda distance: shapes.disc(distance, 0.2), cluster),
        ]
    )


# --- attractors: where the flock flies ----------------------------------------------------------------


@commander("attractors")
def pounce(state: GameState) -> Any:
    """Fly to the opponents' largest cluster, all together."""
    return _attractor(state, state.largest_cluster(), 1.0)


@commander("attractors")
def pick_off(state: GameState) -> Any:
    """Fly to the opposing drone that has the fewest teammates nearby."""
    return _attractor(state, state.weakest(), 1.0)


@commander("attractors")
def prowl(state: GameState) -> Any:
    """Circle the opponents' largest cluster, and repeatedly come closer."""
    turn = 2.0 * np.pi * state.seconds / 8.0
    return _attractor(state, state.ring(state.largest_cluster(), state.closing(), 1, turn)[0], 0.5)


@commander("attractors")
def slip_away(state: GameState) -> Any:
    """Fly to the place that is farthest from every opposing drone."""
    return _attractor(state, state.refuge(), 0.5)


def _attractor(state: GameState, place: Array, share: float) -> list[tuple[float, float, float]]:
    """Return one attractor, its weight a share of the way from the least to the largest."""
    least, largest = state.config.flocking.migration
    return [(float(place[0]), float(place[1]), least + share * (largest - least))]


# --- formation: a shape, its centre, size and turn ----------------------------------------------------


@commander("formation")
def encircle(state: GameState) -> Any:
    """Stand in a ring that closes repeatedly around the opponents' largest cluster."""
    return {"shape": "ring", "centre": tuple(state.largest_cluster()), "size": state.closing(), "turn": 0.0}


@commander("formation")
def corral(state: GameState) -> Any:
    """Stand in a wide, turning ring around a place between the centre and the opponents' largest cluster."""
    place = 0.5 + 0.3 * (state.largest_cluster() - 0.5)
    return {"shape": "ring", "centre": tuple(place), "size": 0.3, "turn": _turn(state)}


@commander("formation")
def smother(state: GameState) -> Any:
    """Stand in a disc around the opposing drone that has the fewest teammates nearby."""
    return {"shape": "disc", "centre": tuple(state.weakest()), "size": 0.12, "turn": _turn(state)}


def _turn(state: GameState) -> float:
    """Return an angle that makes a full turn in 15 s."""
    return float((2.0 * np.pi * state.seconds / 15.0) % (2.0 * np.pi) - np.pi)


# --- leaders: where they fly, the rest follows --------------------------------------------------------


@commander("leaders")
def pincer(state: GameState) -> Any:
    """Lead the team to opposite sides of the opponents' largest cluster, and close in."""
    return state.ring(state.largest_cluster(), state.closing(), len(state.system.default(state.config)), _turn(state))


@commander("leaders")
def lead_in(state: GameState) -> Any:
    """Lead everybody to the opposing drone that has the fewest teammates nearby."""
    return state.ring(state.weakest(), 0.05, len(state.system.default(state.config)))


@commander("leaders")
def lead_away(state: GameState) -> Any:
    """Lead everybody to the place that is farthest from every opposing drone."""
    return state.ring(state.refuge(), 0.05, len(state.system.default(state.config)))


# --- accelerations: each drone by its number ----------------------------------------------------------


@commander("accelerations")
def tighten(state: GameState) -> Any:
    """Send each drone to its place on a ring that closes repeatedly around the opponents' largest cluster."""
    return _towards(state, _own_places(state, state.largest_cluster(), state.closing(), -np.pi))


@commander("accelerations")
def hem_in(state: GameState) -> Any:
    """Send each drone to its place on a wide, turning ring between the centre and the opponents' largest cluster."""
    centre = 0.5 + 0.3 * (state.largest_cluster() - 0.5)
    return _towards(state, _own_places(state, centre, 0.3, -np.pi + 0.3))


@commander("accelerations")
def scatter(state: GameState) -> Any:
    """Send each drone away from the nearest opposing drone, and from the walls."""
    if not len(state.own) or not len(state.opposing):
        return _towards(state, state.own)
    nearest = state.opposing[_distances(state.own, state.opposing).argmin(axis=1)]
    away = state.own - nearest
    away /= np.maximum(np.sqrt((away * away).sum(axis=1, keepdims=True)), 1e-6)
    return _towards(state, (state.own + 0.3 * away).clip(0.1, 0.9))


def _own_places(state: GameState, centre: Array, radius: float, turn: float) -> Array:
    """Return a place (n, 2) on a ring for each own drone, in the order of their angles around its centre."""
    apart = state.own - centre
    order = np.argsort(np.argsort(np.arctan2(apart[:, 1], apart[:, 0]), kind="stable"), kind="stable")
    return state.ring(centre, radius, len(state.own), turn)[order]


def _towards(state: GameState, places: Array) -> Array:
    """Return accelerations (N, 2), of length 1 at most, that bring the own drones to places (n, 2)."""
    period = state.config.command_period
    pushes = (0.6 * (places - state.own) / period - 0.9 * state.velocities) / max(period, 1.0)
    lengths = np.sqrt((pushes * pushes).sum(axis=1, keepdims=True))
    commands = np.zeros((state.config.num_drones, 2))
    commands[state.numbers] = pushes / np.maximum(lengths, 1.0)
    return commands


SCRIPTS = (
    *(besiege, strangle, shun),
    *(pounce, pick_off, prowl, slip_away),
    *(encircle, corral, smother),
    *(pincer, lead_in, lead_away),
    *(tighten, hem_in, scatter),
)
"""All scripts of this file but `hold`."""
