"""Direct control: the player chooses every drone's acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem


@dataclass(frozen=True, kw_only=True)
class Direct(ControlSystem):
    """Each drone accelerates by its row of the command; rows of the other team's drones are ignored.

    Commands are in units of `controller.max_acceleration`, and drone i keeps row i for the whole game, even
    when captured.
    """

    name: ClassVar[str] = "direct"
    kernel: ClassVar[str] = "direct"
    takes: ClassVar[str] = "accelerations"
    turns: ClassVar[str] = "vectors"

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the accelerations (N, 2), each number in [-1, 1]; a vector longer than 1 counts as one of length 1."""
        return spaces.Box(-1.0, 1.0, (config.num_drones, 2), np.float32)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return no acceleration at all."""
        return np.zeros((config.num_drones, 2))
