"""How each kind of command asks for a target of a few modes: one drawing where one will do, else one place in turn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import TARGETS, gaussian
from swarm_pz.config import RED, GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.simulator import Simulator

Array = NDArray[np.float64]
Modes = Sequence[tuple[float, float, float]]
"""x, y and sigma of Gaussians of equal mass; none of them is even coverage."""
Commands = Callable[[int, Simulator], Any]
"""From a second and the games to the commands (E, ...) of the team."""

DWELL_S = 8
"""Seconds at one mode, where there can be one at a time."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def density_of(modes: Modes) -> Array:
    """Return the target's density, its largest value 1."""
    if not modes:
        return TARGETS["uniform"]
    density = np.sum([gaussian(*mode) for mode in modes], axis=0)
    return np.asarray(density / density.max())


def commands_for(modes: Modes, system: ControlSystem, config: GameConfig) -> Commands | None:
    """Return what asks for a target; None if the system's kind of commands is not known here."""
    density, places = density_of(modes), np.array([[x, y] for x, y, _ in modes])
    match system.takes:
        case "density":
            return _in_turn([density])
        case "attraction":
            return _in_turn([np.stack([density, np.zeros_like(density)])])
        case "attractors":  # one mode after the other, the first with the least weight
            weights = np.linspace(*config.flocking.migration, len(modes))
            sent = [(*place, weight) for place, weight in zip(places, weights, strict=True)]
            return _in_turn([system.parse([attractor], config) for attractor in sent])
        case "formation":
            points = (spread(config.num_drones, modes) - 0.5) / 0.5
            return _in_turn([system.parse({"points": points, "centre": (0.5, 0.5), "size": 0.5}, config)])
        case "leaders":  # each to a mode; a single one to one after the other
            count = len(system.default(config))
            is_enough = count >= len(places)
            return _in_turn(
                [places[np.arange(count) % len(places)]] if is_enough else [place[None] for place in places]
            )
        case "accelerations":
            return _towards(spread(config.num_drones, modes))
    return None


def spread(count: int, modes: Modes) -> Array:
    """Return places (count, 2) spread over the modes as their Gaussians are, as many over each."""
    places = []
    for number, (x, y, sigma) in enumerate(modes):
        own = np.arange(number, count, len(modes)) // len(modes)
        radii = sigma * np.sqrt(-2.0 * np.log(1.0 - (own + 0.5) / max(len(own), 1)))
        angles = _GOLDEN * own
        places.append(np.stack([x + radii * np.cos(angles), y + radii * np.sin(angles)], axis=1))
    return np.concatenate(places).clip(0.02, 0.98)


def _in_turn(commands: Sequence[Array]) -> Commands:
    """Send all games one command after the other."""

    def send(second: int, simulator: Simulator) -> Array:
        command = commands[second // DWELL_S % len(commands)]
        return np.broadcast_to(command, (simulator.num_games, *command.shape))

    return send


def _towards(places: Array) -> Commands:
    """Fly every drone to a place of its own, by an acceleration a second."""

    def push(_: int, simulator: Simulator) -> Array:
        pushes = 1.2 * (places - simulator.positions) - 0.9 * simulator.velocities.astype(np.float64)
        return np.asarray(pushes.clip(-1.0, 1.0) * (simulator.teams == RED)[..., None])

    return push
