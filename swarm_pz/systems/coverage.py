"""Coverage control: every drone flies to the middle of what is its to cover, while the density changes.

After Diaz-Mercado, Lee and Egerstedt, "Distributed dynamic density coverage for human-swarm interactions" (American
Control Conference 2015); `swarm_pz.kernels.controllers.coverage` flies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import check, check_count, check_number
from swarm_pz.config.system import Flight
from swarm_pz.kernels.controllers.coverage import CoverageParameters, Grid, cover
from swarm_pz.systems.ergodic import Densities

_NODES = 4
"""Points of the Gauss-Legendre quadrature along an edge between two cells."""


@dataclass(frozen=True, kw_only=True)
class Coverage(Densities):
    """Lloyd's way to cover a density that changes: fly to your Voronoi cell's centroid, and with it.

    Attributes
    ----------
    gain : float
        How fast drones close in on their centroids, per second.
    blend : float
        Seconds in which a new command takes the place of the former.
    floor : float
        Share of the density that is uniform, whatever the command: a cell where nothing is asked for has a middle, too.
    neighbours : bool
        Whether drones fly ahead of what their neighbours' motion does to their own cells (TVD-D1) or not (TVD-D0).
    speed : float
        Largest speed that is asked for, in map widths per second.
    response : float
        Seconds in which a drone takes up the velocity that is asked for.
    grid : int
        Points a side at which a cell's mass and centroid are summed up.
    """

    name: ClassVar[str] = "coverage"
    shares: ClassVar[str] = "its position"

    gain: float = 1.0
    blend: float = 1.0
    floor: float = 0.02
    neighbours: bool = True
    speed: float = 0.3
    response: float = 0.3
    grid: int = 50

    def __post_init__(self) -> None:
        """Check every field."""
        super().__post_init__()
        check_number(self.gain, "coverage.gain", 0.0, 100.0)
        check_number(self.blend, "coverage.blend", 0.01, 1e3)
        check_number(self.floor, "coverage.floor", 1e-6, 1.0)
        check_number(self.speed, "coverage.speed", 1e-3, 10.0)
        check_number(self.response, "coverage.response", 0.01, 1e3)
        check(isinstance(self.neighbours, bool), "coverage.neighbours", self.neighbours, "True or False")
        check_count(self.grid, "coverage.grid", 2, 200)

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float64]:
        """Steer towards the centroids; see `swarm_pz.kernels.controllers.coverage.cover`."""
        accelerations = np.zeros(flight.positions.shape)
        parameters = CoverageParameters(
            gain=float(self.gain),
            blend=float(self.blend),
            floor=float(self.floor),
            neighbours=bool(self.neighbours),
            speed=float(self.speed),
            response=float(self.response),
            speed_factor=float(config.dynamics.speed_factor),
        )
        cover(*flight, make_grid(self.grid, config.command_cells), parameters, accelerations)
        return accelerations


@cache
def make_grid(side: int, cells: int) -> Grid:
    """Return where densities of some cells a side are summed and integrated."""
    centres = (np.arange(side) + 0.5) / side
    across = np.clip(centres * cells - 0.5, 0.0, cells - 1.0)
    left = np.minimum(across.astype(np.int64), cells - 2)
    return Grid(centres, left, across - left, *np.polynomial.legendre.leggauss(_NODES))
