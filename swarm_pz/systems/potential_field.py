"""Potential fields: forces between drones, from walls, and from two images: what attracts and what repels.

After Howard, Matarić and Sukhatme, "Mobile sensor network deployment using potential fields: a distributed, scalable
solution to the area coverage problem" (Distributed Autonomous Robotic Systems 5, 2002);
`swarm_pz.kernels.controllers.potential_field` implements it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Range
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.kernels.controllers.potential_field import PotentialParameters, repel
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands

Charge = Annotated[float, Range(0.0, 1e3)]


@dataclass(frozen=True, kw_only=True)
class PotentialField(ControlSystem):
    """Drones are charges that repel each other; the charges of the command attract and repel them.

    Attributes
    ----------
    strength : float
        Force of a team's whole charge one map width away, in map widths per second squared.
    attraction, repulsion : float
        Charge of all that attracts, and of all that repels, if the team's is 1.
    wall : float
        Charge of each wall.
    friction : float
        Share of its velocity that a drone loses, per second.
    softening : float
        Map widths added in quadrature to the distances between drones and from walls, which keeps
        forces finite.
    """

    name: ClassVar[str] = "potential_field"
    takes: ClassVar[str] = "attraction"
    turns: ClassVar[str] = "images"
    shares: ClassVar[str] = "its position"

    strength: Charge = 0.1
    attraction: Charge = 1.0
    repulsion: Charge = 1.0
    wall: Charge = 0.01
    friction: Charge = 1.0
    softening: Annotated[float, Range(1e-3, 1e3)] = 0.05

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the images (2, A, A) of attraction and repulsion, `[row = y, column = x]`; only their shapes count."""
        return spaces.Box(0.0, 1.0, (2, config.command_cells, config.command_cells), np.float32)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return two empty images: cover evenly."""
        return np.zeros((2, config.command_cells, config.command_cells))

    def from_densities(self, densities: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Attract as densities (n, A, A) ask, and repel nowhere."""
        return np.stack([densities, np.zeros_like(densities)], axis=1)

    def to_densities(self, commands: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return attraction minus repulsion, each scaled to a largest value of 1, cut off below 0."""
        attracts, repels = commands[:, 0], commands[:, 1]
        pictures = []
        for one, other in zip(attracts, repels, strict=True):
            wanted = one / one.max() if one.max() > 0.0 else np.ones_like(one)
            spared = other / other.max() if other.max() > other.min() else np.zeros_like(other)
            left = np.clip(wanted - spared, 0.0, 1.0)
            pictures.append(left)
        return np.asarray(pictures).reshape(attracts.shape)

    def named(self, config: GameConfig) -> Mapping[str, NDArray[np.float64]]:
        """Return attraction to the densities of `swarm_pz.spaces.densities`."""
        return dict(zip(COMMAND_NAMES, self.from_densities(named_commands(config.command_cells), config), strict=True))

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float64]:
        """Add up the forces; see `swarm_pz.kernels.controllers.potential_field.repel`."""
        accelerations = np.zeros(flight.positions.shape)
        parameters = PotentialParameters(**{field.name: float(getattr(self, field.name)) for field in fields(self)})
        repel(flight, parameters, accelerations)
        return accelerations
