"""A slow formation, from the equations of docs/control_systems.md, drone by drone in float64."""

from __future__ import annotations

import math

import numpy as np

from swarm_pz.config import DynamicsConfig, GameConfig
from swarm_pz.systems.formation import Formation
from tests.systems.drawn_flights import MOST_DRONES, random_flight

NAMES = ["ring", "disc", "line", "wedge", "grid"]


def frame_of(shape: str, m: int) -> list[tuple[float, float]]:
    """Return the slots of m drones in the formation's own frame."""
    t = [0.0 if m == 1 else (2 * i - m + 1) / (m - 1) for i in range(m)]
    if shape == "ring":
        return circle(1.0, m)
    if shape == "disc":
        g = 0
        while 3 * g * (g + 1) < m - 1:
            g += 1
        slots, before = [(0.0, 0.0)], 0
        for r in range(1, g + 1):
            up_to = math.floor((m - 1) * r * (r + 1) / (g * (g + 1)) + 0.5)
            slots += circle(r / g, up_to - before)
            before = up_to
        return slots
    if shape == "line":
        return [(one, 0.0) for one in t]
    if shape == "wedge":
        return [(1 - 1.5 * abs(one), math.sin(math.radians(120)) * one) for one in t]
    a = math.ceil(math.sqrt(m))
    gap = 2.0 if a == 1 else 2 / (a - 1)
    ranks = [min(a, m - first) for first in range(0, m, a)]
    slots = []
    for number, files in enumerate(ranks):
        x = gap * ((len(ranks) - 1) / 2 - number)
        slots += [(x, gap * (file - (files - 1) / 2)) for file in range(files)]
    return slots


def circle(radius: float, m: int) -> list[tuple[float, float]]:
    return [(radius * math.cos(2 * math.pi * i / m), radius * math.sin(2 * math.pi * i / m)) for i in range(m)]


def slots_of(command: dict, m: int, margin: float) -> list[tuple[float, float]]:
    if "points" in command:
        points = command["points"]
        whole = len(points)
        frame = [points[i * whole // m] if m <= whole else points[i % whole] for i in range(m)]
    else:
        frame = frame_of(command["shape"], m)
    (x, y), size = command["centre"], command["size"]
    cosine, sine = math.cos(command["turn"]), math.sin(command["turn"])
    slots = [(x + size * (cosine * a - sine * b), y + size * (sine * a + cosine * b)) for a, b in frame]
    return [(min(max(a, margin), 1 - margin), min(max(b, margin), 1 - margin)) for a, b in slots]


def assign(costs: list[list[float]]) -> list[int]:
    """Return the column of each row in the cheapest assignment: shortest augmenting paths, row after row."""
    count = len(costs)
    of_row, of_column, row_of = [0.0] * count, [0.0] * (count + 1), [-1] * (count + 1)
    for new in range(count):
        row_of[count], column = new, count
        least, came_from = [math.inf] * count, [count] * count
        done = [False] * (count + 1)
        while row_of[column] >= 0:
            done[column] = True
            row, step, best = row_of[column], math.inf, -1
            for other in range(count):
                if done[other]:
                    continue
                slack = costs[row][other] - of_row[row] - of_column[other]
                if slack < least[other]:
                    least[other], came_from[other] = slack, column
                if least[other] < step:
                    step, best = least[other], other
            for other in range(count + 1):
                if done[other]:
                    of_row[row_of[other]] += step
                    of_column[other] -= step
                elif other < count:
                    least[other] -= step
            column = best
        while column != count:
            row_of[column] = row_of[came_from[column]]
            column = came_from[column]
    taken = [-1] * count
    for column in range(count):
        taken[row_of[column]] = column
    return taken


def accelerations(flight, row: int, command: dict, system: Formation, speed_factor: float) -> np.ndarray:
    """Return what each drone of a game does, (N, 2); 0 for drones of others."""
    positions, velocities = flight.positions[row].astype(float), flight.velocities[row].astype(float)
    found, known = np.zeros(positions.shape), {}
    for i in np.flatnonzero(flight.own[row]).tolist():
        members = tuple(np.flatnonzero(flight.heard[row, i]).tolist())
        slots = slots_of(command, len(members), system.margin)
        if members not in known:
            places = positions[list(members)].tolist()
            known[members] = assign([[(x - a) ** 2 + (y - b) ** 2 for a, b in slots] for x, y in places])
        slot = slots[known[members][members.index(i)]]
        pull = system.stiffness / speed_factor * (np.array(slot) - positions[i])
        found[i] = pull - system.damping * velocities[i]
    return found


def random_command(generator: np.random.Generator, drones: int) -> dict:
    command = {
        "centre": tuple(generator.random(2)),
        "size": generator.uniform(0.0, 0.5),
        "turn": generator.uniform(-math.pi, math.pi),
    }
    number = generator.integers(6)
    if number < 5:
        return {"shape": NAMES[number]} | command
    count = generator.integers(1, 2 * drones + 1) if drones < 30 else drones
    return {"points": generator.uniform(-1, 1, (count, 2))} | command


def compare(states: int, seed: int) -> float:
    """Compare the system with this one in random states; return the worst error over the largest acceleration."""
    generator, worst = np.random.default_rng(seed), 0.0
    for number in range(states):
        own = int(generator.integers(1, MOST_DRONES + 1))
        system = Formation() if number % 2 else Formation(stiffness=7.0, damping=2.0, margin=0.1)
        config = GameConfig(controllers=system, dynamics=DynamicsConfig(speed_factor=1.0 if number % 3 else 0.8))
        command = random_command(generator, own)
        flight = random_flight(generator, system.parse(command, config), own, int(generator.integers(10)))
        expected = accelerations(flight, 0, command, system, config.dynamics.speed_factor)
        error = np.abs(system.solve(flight, config)[0] - expected)[flight.own[0]].max()
        worst = max(worst, float(error / np.abs(expected).max()))
    return worst
