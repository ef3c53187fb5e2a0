"""Flocking: alignment, cohesion, separation, and migration to an attractor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from swarm_pz.systems.ergodic import Densities


@dataclass(frozen=True, kw_only=True)
class Flocking(Densities):
    """Everybody flies to one place, as a flock."""

    name: ClassVar[str] = "flocking"
    kernel: ClassVar[str] = "flocking"
    shares: ClassVar[str] = "its position and velocity"
