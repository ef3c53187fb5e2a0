"""Random states of one game, and a simulator's solve from them, to compare with slow references."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.reference import ControllerReference, saturate

MODES = 10
PEACE = CaptureConfig(enabled=False)
SOFT = ControllerConfig(control_weight=20.0, max_acceleration=100.0)
"""Gains so low that hardly any acceleration is saturated: saturation would hide errors."""


class State(NamedTuple):
    """State before a solve; N drones, K modes."""

    positions: NDArray[np.float32]
    """(N, 2)"""
    velocities: NDArray[np.float32]
    """(N, 2)"""
    teams: NDArray[np.int8]
    """(N,)"""
    memory: NDArray[np.float32]
    """(N, K, K)"""
    memory_weight: NDArray[np.float32]
    """(N,)"""
    commands: NDArray[np.float64]
    """(2, 10, 10) densities of red and blue."""


def random_state(generator: np.random.Generator, drones: int, spread: float = 1.0) -> State:
    """Draw a state; the drones lie in a square of width `spread`, and their memories are possible ones."""
    corner = generator.random(2) * (1.0 - spread)
    weight = generator.random(drones) * 40
    k, places = np.arange(MODES), generator.random((drones, 8, 2))
    basis = np.einsum("nra,nrb->nab", np.cos(np.pi * places[..., :1] * k), np.cos(np.pi * places[..., 1:] * k))
    return State(
        (corner + spread * generator.random((drones, 2))).astype(np.float32),
        (generator.normal(size=(drones, 2)) * 0.3).astype(np.float32),
        generator.integers(2, size=drones).astype(np.int8),
        (basis / 8 * weight[:, None, None]).astype(np.float32),
        weight.astype(np.float32),
        generator.random((2, 10, 10)) ** 3,
    )


def put(simulator: Simulator, state: State, seeds: Any = None) -> None:
    """Start all games of a simulator from a state."""
    scenario = {"positions": state.positions, "velocities": state.velocities, "teams": state.teams}
    simulator.reset(range(simulator.num_games) if seeds is None else seeds, scenario=scenario)
    simulator.games.memory[..., : len(state.teams)] = np.moveaxis(state.memory, 0, -1)
    simulator.games.memory_weight[:] = state.memory_weight
    for team in range(2):
        simulator.command(team, np.repeat(state.commands[None, team], simulator.num_games, axis=0))


def solved(state: State, failed: NDArray[np.bool_] | None = None, **options: Any) -> Simulator:
    """Return a game without captures, one tick after a state; `options` are fields of the configuration."""
    drones = len(state.teams)
    simulator = Simulator(GameConfig(drones_per_team=(drones, 0), capture=PEACE, **options))
    put(simulator, state)
    if failed is not None:
        simulator.games.failed[0] = failed
    simulator.advance(1)
    return simulator


def assert_mirrored(simulator: Simulator, state: State, reference: ControllerReference, **communication: Any) -> None:
    """Compare a solve's memories with the reference's, and its accelerations to 1e-3 of the largest."""
    expected, memory, memory_weight = reference.solve(
        state.positions,
        state.velocities,
        state.teams,
        state.memory,
        state.memory_weight,
        simulator.games.coefficients[0],
        **communication,
    )
    expected = saturate(expected, simulator.config.controller.max_acceleration)
    games, largest = simulator.games, np.abs(expected).max()
    np.testing.assert_allclose(games.accelerations[0], expected, atol=1e-3 * largest)
    np.testing.assert_allclose(np.moveaxis(games.memory[0, ..., : len(memory)], -1, 0), memory, atol=1e-4)
    np.testing.assert_allclose(games.memory_weight[0], memory_weight, rtol=1e-5)
