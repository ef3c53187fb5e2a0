"""Ergodic control with kernels in place of Fourier modes: seek the density, and avoid the team's next points.

After Sun, Gupta, Abraham, Murphey and others, "Fast ergodic search with kernel functions" (IEEE Transactions on
Robotics, 2025); `swarm_pz.kernels.controllers.kernel_ergodic` implements it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.config.base import Range
from swarm_pz.config.system import Flight
from swarm_pz.kernels.controllers.kernel_ergodic import KernelErgodicParameters, descend
from swarm_pz.systems.ergodic import Densities


@dataclass(frozen=True, kw_only=True)
class KernelErgodic(Densities):
    """Each drone descends the kernel ergodic metric of its team; docs/control_systems.md has the equations.

    Attributes
    ----------
    gain : float
        Largest pull of the density, in map widths per second squared.
    length : float
        Map widths in which the kernel falls to 1/e.
    softening : float
        Map widths over which the kernel is smoothed at 0.
    damping : float
        Share of its velocity that a drone loses, per second. With 0.5, drones come to rest.
    horizon : int
        Control periods of look-ahead.
    """

    name: ClassVar[str] = "kernel_ergodic"
    shares: ClassVar[str] = "its position and velocity"

    gain: Annotated[float, Range(0.0, 1e3)] = 8.0
    length: Annotated[float, Range(0.01, 100.0)] = 0.87
    softening: Annotated[float, Range(1e-3, 10.0)] = 0.17
    damping: Annotated[float, Range(0.0, 1e3)] = 0.0
    horizon: Annotated[int, Range(0, 100)] = 6

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float64]:
        """Steer down the metric; see `swarm_pz.kernels.controllers.kernel_ergodic.descend`."""
        accelerations = np.zeros(flight.positions.shape)
        factor = float(config.dynamics.speed_factor)
        ahead: NDArray[np.float64] = factor * CONTROL_PERIOD * np.arange(self.horizon + 1.0)
        numbers = {name: float(getattr(self, name)) for name in ("gain", "length", "softening", "damping")}
        descend(flight, ahead, KernelErgodicParameters(**numbers, speed_factor=factor), accelerations)
        return accelerations
