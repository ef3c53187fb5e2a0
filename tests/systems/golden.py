"""Solves that must not change: the accelerations that control systems chose for random flights, as stored.

A change here is a change of behaviour: write it into CHANGELOG.md, then store the solves anew with
``python -m tests.systems.golden``. Drones whose choice depends on rounding are stored as NaN.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import DynamicsConfig, FlockingConfig, GameConfig
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.systems.coverage import Coverage
from swarm_pz.systems.flocking import Flocking
from swarm_pz.systems.formation import Formation
from swarm_pz.systems.kernel_ergodic import KernelErgodic
from swarm_pz.systems.leader_follower import LeaderFollower
from swarm_pz.systems.potential_field import PotentialField
from tests.systems.flights import sampled

GOLDEN = Path(__file__).parents[1] / "golden" / "systems.npz"
COUNT = 15
SAME = 1e-4
"""Largest difference of an acceleration, as a share of the largest of its flight."""
FLOCK = FlockingConfig(
    alignment=4.0, cohesion=1.0, separation=0.04, communication_radius=0.25, max_turn=1.0, separation_radius=0.08,
    speed=0.15, migration=(0.5, 60.0),
)  # fmt: skip
SYSTEMS: dict[str, tuple[ControlSystem, ...]] = {
    "coverage": (
        Coverage(),
        Coverage(neighbours=False),
        Coverage(gain=2.0, floor=0.1, speed=0.2, response=0.5, grid=30, blend=2.0),
    ),
    "flocking": (Flocking(),),
    "formation": (Formation(), Formation(stiffness=7.0, damping=2.0, margin=0.1)),
    "kernel_ergodic": (KernelErgodic(), KernelErgodic(gain=1.0, length=0.1, softening=0.05, damping=0.5, horizon=2)),
    "leader_follower": (
        LeaderFollower(),
        LeaderFollower(leaders=1),
        LeaderFollower(appoint="lowest"),
        LeaderFollower(leaders=5, foresight=0.0, cohesion=3.0, alignment=1.0, leadership=0.8),
        LeaderFollower(leaders=3, stiffness=9.0, damping=1.0, separation=5.0, separation_radius=0.3, margin=0.2),
    ),
    "potential_field": (
        PotentialField(),
        PotentialField(strength=0.2, attraction=2.0, repulsion=0.5, wall=0.05, friction=0.3),
    ),
}
"""Variants of each by its name."""


def random_flight(generator: np.random.Generator, commands: NDArray[np.float64], own: int, age: float) -> Flight:
    """Draw one game of `own` drones and others, opponents or failed; `commands` (2, ...) are in force and former.

    In a third of the games drones hear all team-mates, in a third those within a radius, in a third some of these.
    """
    drones = own + int(generator.integers(10))
    mine = np.zeros(drones, np.bool_)
    mine[generator.permutation(drones)[:own]] = True
    spread = generator.choice([0.1, 0.5, 1.0])
    positions = (1.0 - spread) * generator.random(2) + spread * generator.random((drones, 2))
    heard = mine[:, None] & mine
    kind = generator.integers(3)
    if kind > 0:
        heard &= np.linalg.norm(positions[:, None] - positions, axis=-1) <= generator.uniform(0.1, 0.8)
    if kind > 1:
        heard &= (generator.random((drones, drones)) < 0.8) | np.eye(drones, dtype=np.bool_)
    shown = np.where(mine, 0.0, np.nan)[:, None]
    velocities = 0.3 * generator.normal(size=(drones, 2))
    places, speeds = ((values + shown).astype(np.float32)[None] for values in (positions, velocities))
    return Flight(places, speeds, mine[None], heard[None], commands[:1], commands[1:], np.array([age]))


def cases(name: str) -> Iterator[tuple[ControlSystem, Flight, GameConfig]]:
    """Draw the solves of a system."""
    generator, systems = np.random.default_rng(0), SYSTEMS[name]
    for number in range(COUNT):
        system, own = systems[number % len(systems)], 1 + 7 * number % 40
        dynamics = DynamicsConfig(speed_factor=1.0 if number % 2 else 0.8)
        config = GameConfig(dynamics=dynamics, flocking=FLOCK if number % 2 else FlockingConfig())
        commands = system.parse_all(sampled(system, config, generator, 2), 2, config, "commands")
        if number == 0:
            commands[0] = system.default(config)
        if name == "formation" and number % 3 == 2:
            points = generator.uniform(-1, 1, (int(generator.integers(1, 61)), 2))
            commands[0] = system.parse({"points": points, "centre": (0.3, 0.6), "size": 0.3, "turn": 1.0}, config)
        age = float(generator.choice([0.0, 0.35, 12.0, 100.0]))
        yield system, random_flight(generator, commands, own, age), config


def difference(found: NDArray[np.floating], expected: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the differences of accelerations (N, 2), as shares (N,) of the largest expected one."""
    return np.asarray(np.abs(found - expected).max(axis=1) / np.nanmax(np.abs(expected)))


def stored(name: str) -> list[NDArray[np.float32]]:
    """Return the accelerations (N, 2) of each solve of a system."""
    with np.load(GOLDEN) as arrays:
        return [arrays[f"{name}_{number}"] for number in range(COUNT)]


def main() -> None:
    """Store all solves."""
    arrays, generator = {}, np.random.default_rng(1)
    for name in SYSTEMS:
        left_out = 0
        for number, (system, flight, config) in enumerate(cases(name)):
            own = flight.own[0]
            found = np.where(own[:, None], system.solve(flight, config)[0], np.nan).astype(np.float32)
            for _ in range(5):
                places, speeds = (
                    (values * (1 + 1e-6 * generator.normal(size=values.shape))).astype(np.float32)
                    for values in flight[:2]
                )
                near = flight._replace(positions=places, velocities=speeds)
                depends = difference(system.solve(near, config)[0], found) > SAME
                found[depends] = np.nan
                left_out += int(depends.sum())
            arrays[f"{name}_{number}"] = found
        print(f"{name}: {left_out} drones depend on rounding")
    np.savez_compressed(GOLDEN, **arrays)


if __name__ == "__main__":
    main()
