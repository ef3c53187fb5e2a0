"""Control systems whose commands are places: one works, some fail at the place (0, 0), one has no default."""

import importlib.metadata
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from gymnasium import spaces

from swarm_pz.config import registry
from swarm_pz.systems import ControlSystem


@dataclass(frozen=True, kw_only=True)
class Magnet(ControlSystem):
    """All drones fly to one place."""

    name: ClassVar[str] = "magnet"
    takes: ClassVar[str] = "place"
    corners: ClassVar[list[None]] = []

    def space(self, config):
        return spaces.Box(0.0, 1.0, (2,), np.float32)

    def default(self, config):
        return np.full(2, 0.5)

    def solve(self, flight, config):
        if (flight.commands == 0.0).all():
            self.fail()
        return 2.0 * (flight.commands[:, None] - flight.positions) - 2.0 * flight.velocities

    def fail(self):
        pass


def failing(name, fail):
    """Return a system that works until its command is (0, 0), and then calls `fail`."""
    return dataclass(frozen=True, kw_only=True)(type(name, (Magnet,), {"name": name, "fail": fail}))


def _raise(error):
    raise error


def _hang(system):
    system.corners.append(None)
    time.sleep(6.0)


Raising = failing("raising", lambda system: _raise(RuntimeError("lost in a corner")))
Escaping = failing("escaping", lambda system: _raise(KeyboardInterrupt()))
Hanging = failing("hanging", _hang)


@dataclass(frozen=True, kw_only=True)
class Unready(Magnet):
    """Raises an error when asked for its default command."""

    name: ClassVar[str] = "unready"

    def default(self, config):
        raise RuntimeError("not written yet")


class _Point:
    value, dist = "tests", None

    def __init__(self, made):
        self.name, self._made = made.name, made

    def load(self):
        return self._made


def install(monkeypatch, *systems):
    """Register control systems as other packages do."""
    points = importlib.metadata.entry_points

    def extended(**filters):
        more = [_Point(one) for one in systems]
        return [*points(**filters), *more] if filters.get("group") == registry.GROUP else points(**filters)

    monkeypatch.setattr(importlib.metadata, "entry_points", extended)
    registry.system_class.cache_clear()
    registry._find.cache_clear()
