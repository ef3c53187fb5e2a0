"""Tactics written by hand, which play from observations alone.

A tactic is one function from a `View` of n games to n densities; `tactic` makes a policy of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CHANNELS, GameConfig, ObservationConfig
from swarm_pz.config.values import check_values
from swarm_pz.errors import CommandError, PolicyError
from swarm_pz.policy import constant
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces import densities as shapes

Array = NDArray[np.float64]

TRAITS = 16
"""Number of random traits that each game keeps to its end."""


class View:
    """The observations of n games, and the grids for their densities.

    Attributes
    ----------
    x, y : float64 array (A, A)
        Centres of the command's cells, `[row = y, column = x]`, in map widths.
    steps : int64 array (n,)
        Commands given before this one.
    generators : list of Generator
        A random stream for each game.
    traits : float64 array (n, TRAITS)
        Uniform random numbers of each game that stay the same to its end.
    """

    def __init__(
        self,
        images: NDArray[np.uint8],
        channels: tuple[str, ...],
        cells: int,
        steps: NDArray[np.int64],
        generators: list[np.random.Generator],
        traits: Array,
    ) -> None:
        self._images = images
        self._channels = channels
        self.steps = steps
        self.generators = generators
        self.traits = traits
        self.x, self.y = shapes.cell_centres(cells)

    def __getitem__(self, channel: str) -> Array:
        """Return a channel as float64 (n, G', G'), brightness 0 to 255."""
        if channel not in self._channels:
            raise PolicyError(f"the tactic looks at {channel!r} but sees only {self._channels}: add it to `sees`")
        return self._images[:, self._channels.index(channel)].astype(np.float64)

    def mean_position(self, side: str) -> Array:
        """Return the mean position (n, 2) of the "own" or "opposing" drones; the centre if none."""
        if side not in ("own", "opposing"):
            raise PolicyError(f"side must be 'own' or 'opposing', got {side!r}")
        weights = self[f"{side}_positions"]
        cells = weights.shape[-1]
        # Twice the distance in cells: sums of whole numbers are exact in any order. With fractions, rounding
        # in the product over all games would depend on the number of games.
        places = 2.0 * np.arange(cells) + 1.0
        rows = weights @ np.ones(cells)
        totals = rows.sum(axis=1)
        sums = np.stack([(weights @ places).sum(axis=1), rows @ places], axis=1)
        return np.where(totals[:, None] > 0, sums / np.maximum(2.0 * cells * totals, 1.0)[:, None], 0.5)

    def distance_from(self, points: Array) -> Array:
        """Return the distance (n, A, A) of the command's cells from points (n, 2)."""
        x, y = self.x - points[:, 0, None, None], self.y - points[:, 1, None, None]
        return np.asarray(np.sqrt(x * x + y * y))

    def every(self, density: Array) -> Array:
        """Return the same density (A, A) for every game."""
        return np.broadcast_to(density, (len(self.steps), *density.shape))

    def random(self) -> Array:
        """Return uniform random numbers (n, A, A), from each game's own stream."""
        return np.stack([generator.random(self.x.shape) for generator in self.generators])


class ScriptedPolicy:
    """A policy that plays a tactic."""

    def __init__(self, tactic: Tactic, config: GameConfig) -> None:
        self.name = tactic.__name__
        self.observation = tactic.observation
        self._tactic = tactic
        self._cells = config.command_cells
        self._steps: dict[int, int] = {}
        self._generators: dict[int, np.random.Generator] = {}
        self._traits: dict[int, Array] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""
        for seed, row in zip(seeds, rows.tolist(), strict=True):
            self._steps[row] = 0
            self._generators[row] = np.random.default_rng(seed)
            stream = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
            child = np.random.SeedSequence(stream.entropy, spawn_key=(*stream.spawn_key, 1))
            self._traits[row] = np.random.default_rng(child).random(TRAITS)

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Return densities (n, A, A), with largest value 1, for observations (n, C, G', G')."""
        games = rows.tolist()
        view = View(
            observations,
            self.observation.channels,
            self._cells,
            np.array([self._steps[row] for row in games], np.int64),
            [self._generators[row] for row in games],
            np.stack([self._traits[row] for row in games]),
        )
        for row in games:
            self._steps[row] += 1
        densities = self._check(self._tactic.play(view), len(games))
        peaks = densities.max(axis=(1, 2), keepdims=True)
        return np.asarray(densities / np.where(peaks > 0, peaks, 1.0))

    def _check(self, returned: Array, games: int) -> Array:
        shape = (games, self._cells, self._cells)
        try:
            return check_values(returned, shape, 0.0, np.inf, f"what tactic {self.name!r} returns for {games} games")
        except CommandError as error:
            raise PolicyError(str(error)) from error


class Tactic:
    """A named tactic; calling it with a game makes a policy that plays it.

    `play` maps a `View` of n games, with the channels of `observation`, to densities (n, A, A), not negative.
    """

    def __init__(self, play: Callable[[View], Array], observation: ObservationConfig) -> None:
        self.play = play
        self.observation = observation
        self.__name__, self.__doc__ = play.__name__, play.__doc__
        self.__module__ = play.__module__

    def __reduce__(self) -> str:
        """Pickle by name, as Python would pickle the decorated function."""
        return self.__name__

    def __call__(self, config: GameConfig) -> ScriptedPolicy:
        """Make a policy for a game."""
        return ScriptedPolicy(self, config)


@overload
def tactic(play: Callable[[View], Array], /) -> Tactic: ...


@overload
def tactic(*, sees: tuple[str, ...] = CHANNELS, grid: int = 10) -> Callable[[Callable[[View], Array]], Tactic]: ...


def tactic(
    play: Callable[[View], Array] | None = None, /, *, sees: tuple[str, ...] = CHANNELS, grid: int = 10
) -> Tactic | Callable[[Callable[[View], Array]], Tactic]:
    """Turn a function from a `View` to densities into a tactic that makes policies, with or without parentheses.

    `sees` are the channels of the view, on a grid of `grid` cells a side; naming only those used saves time. Raises a
    PolicyError if something other than a function is decorated.
    """

    def decorate(play: Callable[[View], Array]) -> Tactic:
        if not callable(play):
            raise PolicyError(
                "tactic decorates a function from a View to densities, as @tactic or @tactic(sees=..., grid=...), "
                f"got {play!r}"
            )
        return Tactic(play, ObservationConfig(grid=grid, channels=sees))

    return decorate if play is None else decorate(play)


CLOCK, OPPONENTS = ("time_left",), ("opposing_positions",)


@tactic(sees=CLOCK)
@constant
def uniform(view: View) -> Array:
    """Cover the square evenly: the fixed opponent of the benchmark."""
    return view.every(np.ones_like(view.x))


@tactic(sees=CLOCK)
def noise(view: View) -> Array:
    """Send a new random density in every command."""
    return view.random()


@tactic(sees=CLOCK)
def restless(view: View) -> Array:
    """Cover evenly with slight new noise in every command: it shows what re-sending alone is worth."""
    return 1.0 + 0.001 * view.random()


@tactic(sees=CLOCK)
def blind_ring(view: View) -> Array:
    """Make a ring around a random place, a new one in every command."""
    return shapes.ring(view.distance_from(np.stack([generator.random(2) for generator in view.generators])))


@tactic(sees=CLOCK)
@constant
def centre(view: View) -> Array:
    """Send everyone to the middle."""
    return view.every(shapes.disc(np.hypot(view.x - 0.5, view.y - 0.5), 0.1))


@tactic(sees=CLOCK)
@constant
def halo(view: View) -> Array:
    """Make a broad ring around the centre, and never change it."""
    return view.every(shapes.ring(np.hypot(view.x - 0.5, view.y - 0.5), width=0.15))


@tactic(sees=CLOCK)
@constant
def corners(view: View) -> Array:
    """Send everyone to the four corners."""
    return view.every(shapes.corner_discs(view.x, view.y))


@tactic(sees=OPPONENTS, grid=25)
def chase(view: View) -> Array:
    """Send everyone to the opponents' mean position."""
    return shapes.disc(view.distance_from(view.mean_position("opposing")), 0.1)


@tactic(sees=OPPONENTS, grid=25)
def ring(view: View) -> Array:
    """Make a ring around the opponents' mean position."""
    return shapes.ring(view.distance_from(view.mean_position("opposing")))


@tactic(sees=OPPONENTS, grid=25)
def lasso(view: View) -> Array:
    """Make a broad ring around a place between the centre and the opponents' mean position.

    With `halo` the best of the scripts against uniform coverage: it leans towards the opponents
    without leaving ground to those that are elsewhere.
    """
    place = 0.5 + 0.3 * (view.mean_position("opposing") - 0.5)
    return shapes.ring(view.distance_from(place), width=0.15)


@tactic(sees=OPPONENTS, grid=25)
def evade(view: View) -> Array:
    """Send everyone as far as possible from the opponents' mean position."""
    distance = view.distance_from(view.mean_position("opposing"))
    return np.asarray(np.exp(8.0 * (distance - distance.max(axis=(1, 2), keepdims=True))))


@tactic(sees=OPPONENTS, grid=25)
def wavefront(view: View) -> Array:
    """Gather at the wall that is farther from the opponents, then sweep to the other side as a wave.

    Twelve seconds a wave: the ground ahead of the front is empty, that behind it is covered.
    """
    gathers_left = view.mean_position("opposing")[:, 0] > 0.5
    ahead = np.where(gathers_left[:, None, None], view.x, 1.0 - view.x)
    front = 0.25 + 0.75 * np.clip((view.steps % 12 - 4) / 8, 0.0, 1.0)
    return shapes.front(ahead - front[:, None, None])


SCRIPTS = (blind_ring, centre, chase, corners, evade, halo, lasso, noise, restless, ring, uniform, wavefront)
"""All tactics of this file."""
