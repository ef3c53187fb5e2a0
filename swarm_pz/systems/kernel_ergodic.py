"""Ergodic control with kernels in place of Fourier modes: go where the density asks, away from where the team goes.

After Sun, Gupta, Abraham, Murphey and others, "Fast ergodic search with kernel functions" (IEEE Transactions on
Robotics, 2025); `swarm_pz.kernels.controllers.kernel_ergodic` flies.
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
    r"""Each drone flies down the kernel ergodic metric of its team's next moments.

    If they coasted, the n drones that a drone hears, itself among them, would come to the m = n (H + 1) points

    .. math:: x_{j,h} = p_j + h \Delta g v_j, \qquad h = 0, \dots, H,

    each number cut to [0, 1], with the control period :math:`\Delta` = 0.1 s, the speed factor g and H = `horizon`.
    The metric compares these points with the density :math:`\varphi` of mean 1:

    .. math:: E = \frac{1}{m^2} \sum_{a,b} k(x_a, x_b) - \frac{2}{m} \sum_a \int k(x_a, q)\, \varphi(q)\, dq, \qquad
        k(a, b) = \ell\, e^{-r / \ell}, \qquad r = \sqrt{\|a - b\|^2 + \varepsilon^2}

    The integral is a sum over the centres of the command's cells. An empty command asks for the uniform density.
    Each drone steers by the gradient at its own last point x:

    .. math:: u = -\frac{\kappa}{g}\, \nabla_x \left[\frac{1}{m} \sum_a k(x, x_a)
        - \int k(x, q)\, \varphi(q)\, dq\right] - \nu v

    The sum drives drones away from each other and from the points on their own way: so they keep moving. The source
    has a Gaussian kernel. The spectrum of this one, for :math:`\ell = 1 / \pi` and
    :math:`\varepsilon = 0`, is that of the Fourier metric, :math:`(1 + \|k\|^2)^{-3/2}`, up to a factor.

    Attributes
    ----------
    gain : float
        :math:`\kappa`, the largest pull of the density, in map widths per second squared.
    length : float
        :math:`\ell`, in which the kernel falls to 1/e, in map widths.
    softening : float
        :math:`\varepsilon`, in map widths: makes the kernel smooth at 0.
    damping : float
        :math:`\nu`, the share of its velocity that a drone loses, per second. With 0.5, drones come to rest.
    horizon : int
        H, in control periods.
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
        parameters = KernelErgodicParameters(
            gain=float(self.gain),
            length=float(self.length),
            softening=float(self.softening),
            damping=float(self.damping),
            speed_factor=factor,
        )
        descend(*flight[:5], ahead, parameters, accelerations)
        return accelerations
