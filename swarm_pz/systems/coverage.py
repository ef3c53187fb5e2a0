"""Coverage control: every drone flies to the centroid of its Voronoi cell, while the density changes.

After Diaz-Mercado, Lee and Egerstedt, "Distributed dynamic density coverage for human-swarm interactions" (American
Control Conference 2015); `swarm_pz.kernels.controllers.coverage` implements it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Range
from swarm_pz.config.system import Flight
from swarm_pz.kernels.controllers.coverage import CoverageParameters, Grid, cover
from swarm_pz.systems.ergodic import Densities

_NODES = 4
"""Points of the Gauss-Legendre quadrature along an edge between two cells."""


@dataclass(frozen=True, kw_only=True)
class Coverage(Densities):
    """Lloyd's algorithm for a changing density: each drone follows its Voronoi cell's centroid.

    Attributes
    ----------
    gain : float
        How fast drones close in on their centroids, per second.
    blend : float
        Seconds in which a new command replaces the former one.
    floor : float
        Share of the density that is uniform, whatever the command, so that every cell has a centroid.
    neighbours : bool
        Whether drones anticipate how their neighbours' motion changes their own cells (TVD-D1) or not (TVD-D0).
    speed : float
        Largest speed that the law commands, in map widths per second.
    response : float
        Time constant, in seconds, with which a drone reaches the commanded velocity.
    grid : int
        Points a side over which masses and centroids are summed.
    """

    name: ClassVar[str] = "coverage"
    shares: ClassVar[str] = "its position"

    gain: Annotated[float, Range(0.0, 100.0)] = 1.0
    blend: Annotated[float, Range(0.01, 1e3)] = 1.0
    floor: Annotated[float, Range(1e-6, 1.0)] = 0.02
    neighbours: bool = True
    speed: Annotated[float, Range(1e-3, 10.0)] = 0.3
    response: Annotated[float, Range(0.01, 1e3)] = 0.3
    grid: Annotated[int, Range(2, 200)] = 50

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float64]:
        """Steer towards the centroids; see `swarm_pz.kernels.controllers.coverage.cover`."""
        accelerations = np.zeros(flight.positions.shape)
        numbers = {name: float(getattr(self, name)) for name in ("gain", "blend", "floor", "speed", "response")}
        factor = float(config.dynamics.speed_factor)
        parameters = CoverageParameters(**numbers, neighbours=self.neighbours, speed_factor=factor)
        cover(flight, make_grid(self.grid, config.command_cells), parameters, accelerations)
        return accelerations


@cache
def make_grid(side: int, cells: int) -> Grid:
    """Return the grid on which densities of `cells` cells a side are integrated."""
    centres = (np.arange(side) + 0.5) / side
    across = np.clip(centres * cells - 0.5, 0.0, cells - 1.0)
    left = np.minimum(across.astype(np.int64), cells - 2)
    return Grid(centres, left, across - left, *np.polynomial.legendre.leggauss(_NODES))
