"""Slow leaders and followers, from the equations of docs/control_systems.md, drone by drone in float64."""

from __future__ import annotations

import numpy as np

from swarm_pz.config import DynamicsConfig, GameConfig
from swarm_pz.systems.leader_follower import LeaderFollower
from tests.systems.drawn_flights import MOST_DRONES, random_flight


def appoint(heard: list[int], positions, velocities, places, system: LeaderFollower, speed_factor: float) -> dict:
    """Return the leaders among those heard, by number, with the place that each leads to."""
    led, free = {}, list(heard)
    for place in places[: len(heard)]:
        if system.appoint == "lowest":
            chosen = free[0]
        else:
            foreseen = {j: positions[j] + system.foresight * speed_factor * velocities[j] for j in free}
            chosen = min(free, key=lambda j: (sum((foreseen[j] - place) ** 2), j))
        led[chosen] = place
        free.remove(chosen)
    return led


def accelerations(flight, row: int, places, system: LeaderFollower, speed_factor: float) -> np.ndarray:
    """Return what each drone of a game does, (N, 2); 0 for drones of others."""
    positions, velocities = flight.positions[row].astype(float), flight.velocities[row].astype(float)
    found = np.zeros(positions.shape)
    for i in np.flatnonzero(flight.own[row]).tolist():
        heard = np.flatnonzero(flight.heard[row, i]).tolist()
        led = appoint(heard, positions, velocities, places, system, speed_factor)
        others = [j for j in heard if j != i]
        if i in led:
            goal = np.clip(led[i], system.margin, 1 - system.margin)
            found[i] = system.stiffness / speed_factor * (goal - positions[i]) - system.damping * velocities[i]
            near = [j for j in others if j in led]
        else:
            leaders, followers = [j for j in others if j in led], [j for j in others if j not in led]
            share = system.leadership if followers else 1.0
            for group, weight in ((leaders, share), (followers, 1.0 - share)):
                for j in group:
                    agree = system.cohesion / speed_factor * (positions[j] - positions[i])
                    agree = agree + system.alignment * (velocities[j] - velocities[i])
                    found[i] += weight / len(group) * agree
            near = others
        for j in near:
            away = positions[i] - positions[j]
            distance = np.sqrt(sum(away**2))
            strength = max(0.0, 1.0 - distance / system.separation_radius)
            found[i] += system.separation * strength * away / max(distance, 1e-6)
    return found


SYSTEMS = [
    LeaderFollower(),
    LeaderFollower(leaders=1),
    LeaderFollower(appoint="lowest"),
    LeaderFollower(leaders=5, foresight=0.0, cohesion=3.0, alignment=1.0, leadership=0.8),
    LeaderFollower(leaders=3, stiffness=9.0, damping=1.0, separation=5.0, separation_radius=0.3, margin=0.2),
]


def compare(states: int, seed: int) -> float:
    """Compare the system with this one in random states; return the worst error over the largest acceleration."""
    generator, worst = np.random.default_rng(seed), 0.0
    for number in range(states):
        system = SYSTEMS[number % len(SYSTEMS)]
        config = GameConfig(controllers=system, dynamics=DynamicsConfig(speed_factor=1.0 if number % 3 else 0.8))
        places = generator.random((system.leaders, 2))
        own = int(generator.integers(1, MOST_DRONES + 1))
        flight = random_flight(generator, places, own, int(generator.integers(10)))
        expected = accelerations(flight, 0, places, system, config.dynamics.speed_factor)
        error = np.abs(system.solve(flight, config)[0] - expected)[flight.own[0]].max()
        worst = max(worst, float(error / np.abs(expected).max()))
    return worst
