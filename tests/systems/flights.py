"""Control systems in states made by hand or at random: one solve, through the simulator."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.simulator import Simulator

PEACE = CaptureConfig(enabled=False)
SOFT = ControllerConfig(control_weight=20.0, max_acceleration=100.0)
"""Hardly an acceleration is saturated: nothing is hidden."""


class State(NamedTuple):
    """Games before a solve."""

    positions: NDArray[np.float32]
    """(n, N, 2)"""
    velocities: NDArray[np.float32]
    """(n, N, 2)"""
    teams: NDArray[np.int8]
    """(n, N)"""


def random_states(generator: np.random.Generator, games: int, drones: int) -> State:
    """Draw states such as games come to."""
    teams = np.arange(drones) % 2
    return State(
        (0.05 + 0.9 * generator.random((games, drones, 2))).astype(np.float32),
        (0.2 * generator.normal(size=(games, drones, 2))).astype(np.float32),
        np.broadcast_to(teams.astype(np.int8), (games, drones)).copy(),
    )


def extreme_states(generator: np.random.Generator, games: int, drones: int) -> State:
    """Draw states that games come to seldom: crowds at a point, a wall or a corner, at rest, too fast, one team."""
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


def sampled(name: str, config: GameConfig, generator: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Draw commands (n, ...) of a system, as learners do."""
    system = system_of(name)
    space = system.learner_space(config)
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    shares = generator.random((count, *space.shape)) ** (3 if system.takes == "density" else 1)
    return low + (high - low) * shares


def game_of(name: str | tuple[str, str], drones: int, **options: Any) -> GameConfig:
    """Return rules without captures for so many drones in all, flown by a system."""
    return GameConfig(**({"drones_per_team": (drones, 0), "capture": PEACE, "controllers": name} | options))


def put(simulator: Simulator, state: State) -> None:
    """Start all games of a simulator from states."""
    simulator.reset(range(simulator.num_games))
    for name, values in state._asdict().items():
        getattr(simulator.games, name)[:] = values


def solve(
    name: str, state: State, commands: list[NDArray[np.float64]] | None = None, seconds: float = 0.0, **options: Any
) -> NDArray[np.float32]:
    """Return the accelerations (n, N, 2) that a system chooses for both teams, some seconds into its commands.

    `commands` are red's and blue's, (n, ...) each; the system's default if not given.
    """
    games, drones = state.teams.shape
    simulator = Simulator(game_of(name, drones, **options), games)
    put(simulator, state)
    for team in range(2):
        if commands is not None:
            simulator.command(team, commands[team])
    simulator.games.commanded[:] = -int(30 * seconds)
    simulator.advance(1)
    return simulator.games.accelerations.copy()


def find_not_finite(name: str, states: int, seed: int) -> int:
    """Let a system solve for so many extreme states; return in how many an acceleration is not finite, or too large."""
    generator, found, left = np.random.default_rng(seed), 0, states
    while left > 0:
        drones = int(generator.choice([1, 2, 5, 12]))
        talk = generator.choice([None, 0.0, 0.2])
        options: dict[str, Any] = {"communication_radius": talk, "message_loss": float(generator.choice([0.0, 0.3]))}
        config = game_of(name, drones, controller=ControllerConfig(**options))
        simulator = Simulator(config, min(200, left))
        for _ in range(5):
            count = min(simulator.num_games, left)
            if count < simulator.num_games or not count:
                break
            put(simulator, extreme_states(generator, count, drones))
            for team in range(2):
                simulator.command(team, sampled(name, config, generator, count))
            simulator.advance(1)
            lengths = np.linalg.norm(simulator.games.accelerations, axis=2)
            found += int((~(lengths <= 1.0 + 1e-5)).any(axis=1).sum())
            left -= count
    return found
