"""The ergodic controller, the paper's own: over time, a team covers the square as its command's density asks.

Its parameters are `GameConfig.controller`; `swarm_pz.kernels.controllers.ergodic` runs in the simulator's own loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands


@dataclass(frozen=True, kw_only=True)
class Densities(ControlSystem):
    """Base of the systems that take densities."""

    takes: ClassVar[str] = "density"
    turns: ClassVar[str] = "images"

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the images (A, A), `[row = y, column = x]`; only their shape counts."""
        return spaces.Box(0.0, 1.0, (config.command_cells, config.command_cells), np.float32)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return the uniform density."""
        return np.ones((config.command_cells, config.command_cells))

    def named(self, config: GameConfig) -> Mapping[str, NDArray[np.float64]]:
        """Return the densities of `swarm_pz.spaces.densities`."""
        return dict(zip(COMMAND_NAMES, named_commands(config.command_cells), strict=True))


@dataclass(frozen=True, kw_only=True)
class Ergodic(Densities):
    """Decentralized receding-horizon control towards a density, by its Fourier coefficients."""

    name: ClassVar[str] = "ergodic"
    kernel: ClassVar[str] = "ergodic"
    shares: ClassVar[str] = "the Fourier coefficients of its past and of its look-ahead"
