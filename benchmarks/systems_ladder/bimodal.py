"""How each kind of command asks for two modes: one drawing where one will do, else one place after the other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import BIMODAL, TARGETS
from swarm_pz.config import RED, GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.simulator import Simulator

Array = NDArray[np.float64]
Commands = Callable[[int, Simulator], Any]
"""From a second and the games to the commands (E, ...) of the team; None for those that it has."""

DWELL_S = 8
"""Seconds at one mode, where there can be one at a time."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def bimodal_commands(system: ControlSystem, config: GameConfig) -> Commands | None:
    """Return what asks for the bimodal target; None if its kind of commands is not known here."""
    make = _KINDS.get(system.takes)
    return make(system, config) if make is not None else None


def spread(count: int) -> Array:
    """Return places (count, 2) spread over both modes as their Gaussians are, half of them over each."""
    places = []
    for number, (x, y, sigma) in enumerate(BIMODAL):
        own = np.arange(number, count, len(BIMODAL)) // len(BIMODAL)
        radii = sigma * np.sqrt(-2.0 * np.log(1.0 - (own + 0.5) / max(len(own), 1)))
        angles = _GOLDEN * own
        places.append(np.stack([x + radii * np.cos(angles), y + radii * np.sin(angles)], axis=1))
    return np.concatenate(places).clip(0.02, 0.98)


def _all(command: Array, simulator: Simulator) -> Array:
    """Return the same command for every game."""
    return np.broadcast_to(command, (simulator.num_games, *command.shape))


def _once(command: Array) -> Commands:
    return lambda _, simulator: _all(command, simulator)


def _in_turn(commands: Sequence[Array]) -> Commands:
    return lambda second, simulator: _all(commands[second // DWELL_S % len(commands)], simulator)


def _drawing(system: ControlSystem, config: GameConfig) -> Commands:
    return _once(TARGETS["bimodal"])


def _attraction(system: ControlSystem, config: GameConfig) -> Commands:
    return _once(np.stack([TARGETS["bimodal"], np.zeros_like(TARGETS["bimodal"])]))


def _attractors(system: ControlSystem, config: GameConfig) -> Commands:
    """Send the flock to one mode and to the other, the wider one with the least weight."""
    weights = config.flocking.migration
    return _in_turn(
        [system.parse([(x, y, weight)], config) for (x, y, _), weight in zip(BIMODAL, weights, strict=True)]
    )


def _points(system: ControlSystem, config: GameConfig) -> Commands:
    points = (spread(config.num_drones) - 0.5) / 0.5
    return _once(system.parse({"points": points, "centre": (0.5, 0.5), "size": 0.5}, config))


def _leaders(system: ControlSystem, config: GameConfig) -> Commands:
    """Send a leader to each mode; a single one to one after the other."""
    places = np.array([[x, y] for x, y, _ in BIMODAL])
    count = len(system.default(config))
    if count >= len(places):
        return _once(places[np.arange(count) % len(places)])
    return _in_turn([place[None] for place in places])


def _accelerations(system: ControlSystem, config: GameConfig) -> Commands:
    """Fly every drone to a place of its own, by an acceleration a second."""
    places = spread(config.num_drones)

    def towards(_: int, simulator: Simulator) -> Array:
        pushes = 1.2 * (places - simulator.positions) - 0.9 * simulator.velocities.astype(np.float64)
        return np.asarray(pushes.clip(-1.0, 1.0) * (simulator.teams == RED)[..., None])

    return towards


_KINDS: dict[str, Callable[[ControlSystem, GameConfig], Commands]] = {
    "density": _drawing,
    "attraction": _attraction,
    "attractors": _attractors,
    "formation": _points,
    "leaders": _leaders,
    "accelerations": _accelerations,
}
