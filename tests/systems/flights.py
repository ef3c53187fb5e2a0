"""Control systems in states made by hand or at random: one solve, through the simulator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.config.system import ControlSystem
from swarm_pz.simulator import Simulator


class State(NamedTuple):
    """Games before a solve."""

    positions: NDArray[np.float32]
    """(n, N, 2)"""
    velocities: NDArray[np.float32]
    """(n, N, 2)"""
    teams: NDArray[np.int8]
    """(n, N)"""


def random_states(generator: np.random.Generator, games: int, drones: int) -> State:
    """Draw states like those in games."""
    return State(
        (0.05 + 0.9 * generator.random((games, drones, 2))).astype(np.float32),
        (0.2 * generator.normal(size=(games, drones, 2))).astype(np.float32),
        np.tile((np.arange(drones) % 2).astype(np.int8), (games, 1)),
    )


def extreme_states(generator: np.random.Generator, games: int, drones: int) -> State:
    """Draw states that are rare in games: crowds at a point, wall or corner; drones at rest or too fast; one team."""
    spread = generator.choice([0.0, 1e-30, 1e-7, 0.01, 1.0], (games, 1, 1))
    positions = generator.random((games, 1, 2)) * (1 - spread) + spread * generator.random((games, drones, 2))
    crowded = generator.random((games, drones, 1)) < generator.choice([0.0, 0.5], (games, 1, 1))
    positions = np.where(crowded, np.round(positions), positions)
    speeds = generator.choice([0.0, 1e-30, 1e-3, 0.3, 10.0], (games, drones, 1))
    shares = generator.choice([0.0, 0.1, 0.5, 1.0], (games, 1))
    return State(
        positions.astype(np.float32),
        (speeds * generator.uniform(-1, 1, (games, drones, 2))).astype(np.float32),
        (generator.random((games, drones)) < shares).astype(np.int8),
    )


def sampled(
    choice: str | ControlSystem, config: GameConfig, generator: np.random.Generator, count: int
) -> NDArray[np.float64]:
    """Draw commands (n, ...) of a system, as learners do."""
    system = system_of(choice)
    space = system.learner_space(config)
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    shares = generator.random((count, *space.shape)) ** (3 if system.takes == "density" else 1)
    return low + (high - low) * shares


def game_of(name: str | tuple[str, str], drones: int, **options: Any) -> GameConfig:
    """Return rules without captures for so many drones in all, flown by a system."""
    peace = CaptureConfig(enabled=False)
    return GameConfig(**({"drones_per_team": (drones, 0), "capture": peace, "controllers": name} | options))


def solve(
    config: GameConfig, state: State, commands: list[NDArray[np.float64] | None], seconds: float = 0.0
) -> NDArray[np.float32]:
    """Return the accelerations (n, N, 2) that systems choose for both teams, some seconds into their commands.

    `commands` are red's and blue's, (n, ...) each; None for the system's default.
    """
    simulator = Simulator(config, len(state.teams))
    simulator.reset(range(simulator.num_games))
    for name, values in state._asdict().items():
        getattr(simulator.games, name)[:] = values
    for team, command in enumerate(commands):
        if command is not None:
            simulator.command(team, command)
    simulator.games.commanded[:] = -int(30 * seconds)
    simulator.advance(1)
    return simulator.games.accelerations.copy()


def find_not_finite(name: str, states: int, seed: int) -> int:
    """Return in how many of some extreme states a system's acceleration is not finite, or too large."""
    generator, found = np.random.default_rng(seed), 0
    for first in range(0, states, 20):
        count, drones = min(20, states - first), int(generator.choice([1, 2, 5, 12]))
        radius = generator.choice([None, 0.0, 0.2])
        config = game_of(name, drones, controller=ControllerConfig(communication_radius=radius))
        commands = [sampled(name, config, generator, count) for _ in range(2)]
        lengths = np.linalg.norm(solve(config, extreme_states(generator, count, drones), commands), axis=2)
        found += int((~(lengths <= 1.0 + 1e-5)).any(axis=1).sum())
    return found
