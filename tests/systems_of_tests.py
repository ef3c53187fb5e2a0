"""Control systems that stand in for those of other packages."""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from gymnasium import spaces

from swarm_pz.config import registry
from swarm_pz.systems import ControlSystem


@dataclass(frozen=True, kw_only=True)
class Magnet(ControlSystem):
    """Everybody flies to one place, whatever the others do."""

    name: ClassVar[str] = "magnet"
    takes: ClassVar[str] = "place"
    gain: float = 4.0

    def space(self, config):
        return spaces.Box(np.array([0.0, 0.25], np.float32), np.array([1.0, 0.75], np.float32))

    def default(self, config):
        return np.array([0.5, 0.5])

    def named(self, config):
        return {"left": np.array([0.1, 0.5]), "right": np.array([0.9, 0.5])}

    def from_densities(self, densities, config):
        cells = densities.reshape(len(densities), -1).argmax(axis=1)
        rows, columns = np.divmod(cells, config.command_cells)
        places = (np.stack([columns, rows], axis=1) + 0.5) / config.command_cells
        return np.clip(places, [0.0, 0.25], [1.0, 0.75])

    def to_densities(self, commands, config):
        densities = np.zeros((len(commands), config.command_cells, config.command_cells))
        places = np.minimum((commands * config.command_cells).astype(int), config.command_cells - 1)
        densities[np.arange(len(commands)), places[:, 1], places[:, 0]] = 1.0
        return densities

    def solve(self, flight, config):
        return self.gain * (flight.commands[:, None] - flight.positions) - 3.0 * flight.velocities


def install(monkeypatch: pytest.MonkeyPatch, *systems: type[ControlSystem]) -> None:
    """Register control systems as an installed package would, for the time of a test."""
    own = registry.registered()
    points = {
        one.name: importlib.metadata.EntryPoint(one.name, f"{one.__module__}:{one.__qualname__}", registry.GROUP)
        for one in systems
    }
    monkeypatch.setattr(registry, "registered", lambda: own | points)
    for cached in (registry.system_class, registry._find):
        monkeypatch.setattr(registry, cached.__name__, cached.__wrapped__)
