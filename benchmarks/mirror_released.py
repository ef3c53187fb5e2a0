"""Whole games by the preset `released` beside the slow reference of them, tick by tick.

python -m benchmarks.mirror_released
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator
from tests.reference import move, saturate
from tests.reference_released import ReleasedReference

NEAR = 1e-5
"""Where the opposing field is this near the threshold, rounding decides whether a drone is captured."""
NEAR_LIMIT = 1e-5
"""Where a control is this near 1, in units of its solve's largest, rounding decides whether it is limited."""
UNLIMITED = 100.0
"""A limit that hardly an acceleration of these games reaches, so that saturation hides nothing.

With a warm start, the unlimited simulator looks ahead along the limited controls of the other, in each single solve.
"""
Command = NDArray[np.float64]
"""A density (10, 10), row = y, column = x."""


@dataclass
class Mirrored:
    """Numbers of comparisons, and the largest differences.

    Attributes
    ----------
    solves, commands, resent, captures : int
        Numbers of what there was; `resent` are those of the commands that were in force already.
    acceleration : float
        Difference of an acceleration before saturation, over the largest acceleration of its solve.
    flown : float
        The same after saturation.
    kept : float
        Difference of a control that drones keep for the next solve, over the largest; 0 without a warm start.
    field : float
        Difference of a capture field, whose values reach from 0 to 1.
    mismatches : int
        Drones captured in only one of the two, though the reference's field says clearly which is right.
    undecided : int
        Those where it does not; their game is not played on.
    """

    solves: int = 0
    commands: int = 0
    resent: int = 0
    captures: int = 0
    acceleration: float = 0.0
    flown: float = 0.0
    kept: float = 0.0
    field: float = 0.0
    mismatches: int = 0
    undecided: int = 0

    def add_solve(self, expected: NDArray[np.float64], unlimited: Simulator, flown: Simulator, field: float) -> None:
        """Count a solve in which the reference wants these accelerations (N, 2)."""
        limited = saturate(expected)
        self.solves += 1
        self.acceleration = max(self.acceleration, _difference(unlimited.games.accelerations[0], expected))
        self.flown = max(self.flown, _difference(flown.games.accelerations[0], limited))
        self.field = max(self.field, field)


def _difference(given: NDArray[np.float32], expected: NDArray[np.float64]) -> float:
    return float(np.abs(given - expected).max() / np.abs(expected).max())


def random_command(generator: np.random.Generator, opponents: NDArray[np.float32]) -> Command:
    """Draw a density: noise, a disc around the opponents (n, 2) or at a wall, or uniform coverage."""
    kind = generator.choice(4, p=[0.4, 0.3, 0.2, 0.1])
    if kind == 0:
        return generator.random((10, 10)) ** 4
    if kind == 3:
        return np.full((10, 10), generator.choice([0.0, 0.3]))
    place = opponents.mean(axis=0) if kind == 1 else generator.choice([0.02, 0.5, 0.98], size=2)
    centres = (np.arange(10) + 0.5) / 10
    squares = (centres[:, None] - place[1]) ** 2 + (centres - place[0]) ** 2
    return np.asarray(np.exp(-squares / 2 / generator.uniform(0.05, 0.3) ** 2))


def send(
    generator: np.random.Generator,
    simulator: Simulator,
    reference: ReleasedReference,
    in_force: list[Command | None],
    found: Mirrored,
) -> None:
    """Send each team a command now and then: a new one, or that in force again, as bright or not."""
    for team in np.flatnonzero(generator.random(2) < 1 / 25):
        command = in_force[team]
        again = command is not None and generator.random() < 0.4
        if command is None or not again:
            command = random_command(generator, simulator.positions[0, simulator.teams[0] != team])
        in_force[team] = command
        density = command * generator.choice([1.0, generator.uniform(0.1, 1.0)])
        simulator.command(int(team), density[None])
        reference.command(int(team), density)
        found.commands += 1
        found.resent += again


def compare_controls(simulator: Simulator, reference: ReleasedReference, found: Mirrored) -> None:
    """Compare the controls that drones keep, (N, H, 2), just after a solve; the reference goes on with the simulator's.

    From solve to solve small differences can grow, as near walls. A control with a component of 1 jumps: a little more,
    and it is made a unit vector. Where rounding decides that, either is right.
    """
    kept, wanted = simulator.games.plans[0], reference.wanted
    largest = np.abs(wanted).max(axis=-1)
    for drone, h in np.argwhere(np.abs(largest - 1.0) <= NEAR_LIMIT * max(1.0, largest.max())):
        free = wanted[drone, h]
        choices = [free, free / np.linalg.norm(free)]
        reference.controls[drone, h] = min(choices, key=lambda choice: np.abs(kept[drone, h] - choice).max())
    found.kept = max(found.kept, _difference(kept, reference.controls))
    reference.controls[:] = kept


def compare_pasts(simulator: Simulator, reference: ReleasedReference) -> None:
    """Compare what a tick left of memories, trails and counts."""
    games, rules = simulator.games, reference.rules
    np.testing.assert_array_equal(games.memory_weight[0], reference.memory_weight)
    memory = np.moveaxis(games.memory[0], -1, 0)
    np.testing.assert_allclose(memory, reference.memory, atol=1e-5 * max(1.0, reference.memory_weight.max()))
    np.testing.assert_array_equal(simulator.teams[0], rules.teams)
    np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
    np.testing.assert_array_equal(games.captures[0], rules.captures)
    np.testing.assert_array_equal(games.recaptures[0], rules.recaptures)


def play(seed: int, seconds: int, found: Mirrored, largest_team: int = 20) -> None:
    """Play a game of random commands and team sizes beside the slow reference.

    Positions and velocities are taken from the simulator in every tick, and after every solve the controls that drones
    keep, once they were compared; all else is the reference's own. Numbers and differences are added to `found`; other
    faults than those that it counts are an AssertionError.
    """
    generator = np.random.default_rng(seed)
    red, blue = (int(size) for size in generator.integers(1, largest_team + 1, size=2))
    config = GameConfig.preset("released").replace(drones_per_team=(red, blue), time_limit=float(seconds))
    simulator = Simulator(config)
    unlimited = Simulator(config.replace(controller=config.controller.replace(max_acceleration=UNLIMITED)))
    simulator.reset([seed])
    warm_start = config.controller.warm_start
    reference = ReleasedReference(simulator.teams[0], warm_start=warm_start)
    in_force: list[Command | None] = [None, None]
    for tick in range(30 * seconds):
        if tick % 3 == 0 or generator.random() < 0.5:
            send(generator, simulator, reference, in_force, found)
        before = simulator.snapshot()
        simulator.advance(1)
        if tick % 3 == 0:
            expected = reference.solve(before.positions[0], before.velocities[0])
            unlimited.restore(before)
            unlimited.advance(1)
            np.testing.assert_allclose(simulator.games.coefficients[0], reference.phi, atol=1e-5)
            field = float(np.abs(simulator.capture_field[0] - reference.fields).max())
            found.add_solve(expected, unlimited, simulator, field)
            if warm_start:
                compare_controls(simulator, reference, found)
        flown = move(before.positions[0], before.velocities[0], simulator.games.accelerations[0], speed_factor=0.8)
        np.testing.assert_allclose(simulator.positions[0], flown[0], atol=1e-6)
        np.testing.assert_allclose(simulator.velocities[0], flown[1], atol=1e-5)
        clear = np.abs(reference.values(simulator.positions[0]) - config.capture.threshold) > NEAR
        captured = np.isin(np.arange(red + blue), reference.tick(simulator.positions[0]))
        went = simulator.teams[0] != before.teams[0]
        found.captures += int(went.sum())
        if (went != captured).any():
            found.mismatches += int((clear & (went != captured)).sum())
            found.undecided += int((~clear & (went != captured)).sum())
            return
        compare_pasts(simulator, reference)
        if simulator.decided[0]:
            return


def main() -> None:
    """Play the games and print what differed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=12)
    parser.add_argument("--seconds", type=int, default=12)
    options = parser.parse_args()
    began, found = time.monotonic(), Mirrored()
    for seed in range(options.games):
        play(seed, options.seconds, found)
        print(f"{seed + 1} games, {time.monotonic() - began:.0f} s: {found}", flush=True)
    print(
        f"{found.solves:,} solves in {options.games} games of 1 to 20 drones a team, with {found.commands} commands of "
        f"which {found.resent} were in force already: accelerations differ by at most {found.acceleration:.1e} of "
        f"the largest before saturation, {found.flown:.1e} after, controls kept by {found.kept:.1e}; fields by "
        f"{found.field:.1e}; of {found.captures} captures {found.mismatches} differ, {found.undecided} are left to "
        f"rounding"
    )


if __name__ == "__main__":
    main()
