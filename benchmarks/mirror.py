"""Compares kernels with slow references: rules over many long games, the controller over many random states.

python -m benchmarks.mirror
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.kernels.controllers.ergodic import room_for, saturate
from swarm_pz.kernels.step import solve
from swarm_pz.simulator import Simulator
from tests.reference import ControllerReference, RuleReference, target_coefficients
from tests.reference import saturate as saturate_reference


@njit
def saturate_all(accelerations: NDArray[np.float32], limit: np.float32) -> None:
    """Call the kernel, which Python cannot call directly."""
    saturate(accelerations, limit)


def mismatches(seed: int, seconds: int, largest_team: int = 40) -> int:
    """Play a game with random commands and team sizes, tick by tick, and compare it with the slow rules.

    Returns the number of drones whose team differs, summed over ticks: it must be 0.
    """
    generator = np.random.default_rng(seed)
    red, blue = (int(size) for size in generator.integers(1, largest_team + 1, size=2))
    simulator = Simulator(GameConfig(drones_per_team=(red, blue)))
    simulator.reset([seed])
    reference = RuleReference(simulator.teams[0])
    wrong = 0
    for tick in range(30 * seconds):
        if tick % 30 == 0:
            for team in range(2):
                simulator.command(team, generator.random((1, 10, 10)) ** 4)
        simulator.advance(1)
        reference.tick(simulator.positions[0])
        wrong += int((simulator.teams[0] != reference.teams).sum())
        np.testing.assert_array_equal(simulator.occupancy[0], reference.occupancy)
        np.testing.assert_array_equal(simulator.games.captures[0], reference.captures)
        np.testing.assert_array_equal(simulator.games.recaptures[0], reference.recaptures)
        if simulator.decided[0]:
            break
    return wrong


def controller_errors(
    states: int, seed: int, largest_swarm: int = 30
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Solve random states with the kernel and with the slow float64 controller.

    Returns the largest difference of an acceleration, divided by the reference's largest one (states,), before and
    after saturation.
    """
    generator = np.random.default_rng(seed)
    simulator = Simulator()
    reference = ControllerReference()
    errors = np.zeros((2, states))
    for state in range(states):
        count = int(generator.integers(1, largest_swarm + 1))
        positions = generator.random((count, 2)).astype(np.float32)
        velocities = (generator.normal(size=(count, 2)) * 0.4).astype(np.float32)
        teams = generator.integers(2, size=count).astype(np.int8)
        weight = (generator.random(count) * 40).astype(np.float32)
        # A possible memory: sums of the basis over random places.
        k = np.arange(10)
        places = generator.random((count, 8, 2))
        basis = np.einsum("nra,nrb->nab", np.cos(np.pi * places[..., :1] * k), np.cos(np.pi * places[..., 1:] * k))
        memory = (basis / 8 * weight[:, None, None]).astype(np.float32)
        targets = np.stack([target_coefficients(generator.random((10, 10)) ** 3) for _ in range(2)])
        targets = targets.astype(np.float32)
        expected, expected_memory, _ = reference.solve(
            positions.astype(float),
            velocities.astype(float),
            teams,
            memory.astype(float),
            weight.astype(float),
            targets.astype(float),
        )
        accelerations = np.zeros((count, 2), np.float32)
        by_drone = np.zeros((10, 10, room_for(count)), np.float32)
        by_drone[..., :count] = np.moveaxis(memory, 0, -1)
        game = simulator.games._replace(
            positions=positions[None],
            velocities=velocities[None],
            teams=teams[None],
            memory=by_drone[None],
            memory_weight=weight[None],
            accelerations=accelerations[None],
            coefficients=targets[None],
        )
        solve(game, simulator.controller)
        errors[0, state] = np.abs(accelerations - expected).max() / np.abs(expected).max()
        saturate_all(accelerations, simulator.controller.max_acceleration)
        limited = saturate_reference(expected)
        errors[1, state] = np.abs(accelerations - limited).max() / np.abs(limited).max()
        np.testing.assert_allclose(np.moveaxis(by_drone[..., :count], -1, 0), expected_memory, atol=1e-4)
    return errors[0], errors[1]


def main() -> None:
    """Run both comparisons and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=200)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--states", type=int, default=1000)
    options = parser.parse_args()
    before, after = controller_errors(options.states, seed=1)
    print(
        f"controller, {options.states} random states: largest difference {before.max():.1e} of the largest "
        f"acceleration before saturation, {after.max():.1e} after",
        flush=True,
    )
    began = time.monotonic()
    wrong = 0
    for seed in range(options.games):
        wrong += mismatches(seed, options.seconds)
        if (seed + 1) % max(options.games // 10, 1) == 0:
            print(f"{seed + 1} games, {wrong} differences, {time.monotonic() - began:.0f} s", flush=True)
    print(f"rules, {options.games} games of up to {options.seconds} s, 1 to 40 drones a team: {wrong} differences")


if __name__ == "__main__":
    main()
