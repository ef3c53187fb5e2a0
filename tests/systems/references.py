"""The control systems once more, slow: float64, drone by drone, from the equations of docs/control_systems.md.

Each `compare_...` draws a state of 1 to 40 drones, that hear all or some of their team, solves it, and returns the
largest difference of an acceleration as a share of the largest of its state.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from swarm_pz.config import ControllerConfig, DynamicsConfig, FlockingConfig, GameConfig
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.systems.coverage import Coverage
from swarm_pz.systems.flocking import Flocking
from swarm_pz.systems.formation import Formation
from swarm_pz.systems.kernel_ergodic import KernelErgodic
from swarm_pz.systems.leader_follower import LeaderFollower
from swarm_pz.systems.potential_field import PotentialField
from swarm_pz.systems.shapes import SHAPES, unit_slots
from tests.systems.flights import game_of, random_states, solve

Floats = NDArray[np.float64]
Generator = np.random.Generator


def random_flight(generator: Generator, commands: Floats, own: int, age: float = 0.0) -> Flight:
    """Draw one game of `own` drones among some of the other team or failed; `commands` (2, ...) in force and former.

    In a third of them all hear all, in a third those within a radius, and in a third some of these.
    """
    drones = own + int(generator.integers(10))
    mine = np.zeros(drones, np.bool_)
    mine[generator.permutation(drones)[:own]] = True
    spread = generator.choice([0.1, 0.5, 1.0])
    positions = (1.0 - spread) * generator.random(2) + spread * generator.random((drones, 2))
    heard = mine[:, None] & mine
    kind = generator.integers(3)
    if kind > 0:
        distance = np.linalg.norm(positions[:, None] - positions, axis=-1)
        heard &= distance <= generator.uniform(0.1, 0.8)
    if kind > 1:
        heard &= (generator.random((drones, drones)) < 0.8) | np.eye(drones, dtype=np.bool_)
    shown = np.where(mine, 0.0, np.nan)[:, None]
    velocities = 0.3 * generator.normal(size=(drones, 2))
    places, speeds = ((values + shown).astype(np.float32)[None] for values in (positions, velocities))
    return Flight(places, speeds, mine[None], heard[None], commands[:1], commands[1:], np.array([age]))


def error(found: NDArray[np.floating], expected: Floats, chosen: NDArray[np.bool_]) -> float:
    assert np.isfinite(found[chosen]).all() and np.isfinite(expected[chosen]).all()
    return float(np.abs(found - expected)[chosen].max() / np.abs(expected[chosen]).max()) if chosen.any() else 0.0


def error_of(system: ControlSystem, flight: Flight, config: GameConfig, expected: Callable[..., Floats]) -> float:
    """Compare a system's solve with what each drone of it is expected to do, `expected(i, heard, p, v)`."""
    p, v = flight.positions[0].astype(float), flight.velocities[0].astype(float)
    slow = np.zeros(p.shape)
    for i in np.flatnonzero(flight.own[0]).tolist():
        slow[i] = expected(i, np.flatnonzero(flight.heard[0, i]).tolist(), p, v)
    return error(system.solve(flight, config)[0], slow, flight.own[0])


def some_speed(number: int) -> DynamicsConfig:
    return DynamicsConfig(speed_factor=1.0 if number % 3 else 0.8)


# --- direct and flocking ----------------------------------------------------------------------------------------------


def compare_direct(generator: Generator, number: int) -> float:
    drones, largest = int(generator.integers(1, 41)), 1.0 if number % 2 else 0.3
    state, commands = random_states(generator, 1, drones), generator.uniform(-1, 1, (2, 1, drones, 2))
    config = game_of("direct", drones, controller=ControllerConfig(max_acceleration=largest))
    rows = commands[state.teams[0], 0, np.arange(drones)]
    expected = largest * rows / np.maximum(1.0, np.linalg.norm(rows, axis=1, keepdims=True))
    return error(solve(config, state, list(commands))[0], expected, np.ones(drones, np.bool_))


def compare_flocking(generator: Generator, number: int) -> float:
    """Drones within rounding of where the control jumps do as they do."""
    numbers = dict(zip(("alignment", "cohesion", "separation"), generator.uniform(0, [5, 5, 0.05]), strict=True))
    numbers |= {"communication_radius": generator.uniform(0.05, 0.3), "max_turn": generator.uniform(0.1, 3.0)}
    numbers |= {"separation_radius": generator.uniform(0.01, 0.1), "speed": generator.uniform(0.1, 0.5)}
    flock = FlockingConfig(migration=(0.5, 60.0), **numbers)
    command = np.column_stack([generator.random((4, 2)), generator.uniform(0.5, 60.0, 4)])
    age = float(generator.uniform(0.0, 30.0))
    flight = random_flight(generator, np.stack([command, command]), 1 + number % 40, age)
    x, y, weight = command[min(int(age / flock.dwell), 3)]
    found = Flocking().solve(flight, GameConfig(flocking=flock))[0]

    def expected(i, heard, p, v):
        others = [j for j in heard if j != i]
        distance = {j: math.hypot(*(p[i] - p[j])) for j in others}
        near = [j for j in others if distance[j] <= flock.communication_radius]
        urge = weight * (np.array([x, y]) - p[i])
        if near:
            urge += flock.alignment * (np.mean(v[near], axis=0) - v[i])
            urge += flock.cohesion * (np.mean(p[near], axis=0) - p[i])
        for j in others:
            if distance[j] < flock.separation_radius:
                urge += flock.separation * (p[i] - p[j]) / max(distance[j], 0.001) ** 2
        turn = math.atan2(v[i, 0] * urge[1] - v[i, 1] * urge[0], v[i] @ urge)
        jumps = [math.pi - abs(turn) < 1e-3, math.hypot(*urge) < 0.05, abs(math.hypot(*v[i]) - 0.001) < 1e-4]
        radii = (flock.communication_radius, flock.separation_radius)
        if any(jumps) or any(abs(one - radius) < 1e-6 for one in distance.values() for radius in radii):
            return found[i]
        heading = math.atan2(v[i, 1], v[i, 0]) + float(np.clip(turn, -flock.max_turn, flock.max_turn))
        if math.hypot(*v[i]) < 0.001:
            heading = math.atan2(urge[1], urge[0])
        return (flock.speed * np.array([math.cos(heading), math.sin(heading)]) - v[i]) / 0.1

    return error_of(Flocking(), flight, GameConfig(flocking=flock), expected)


# --- coverage: every grid point to its nearest drone, every cell a polygon --------------------------------------------


def shares(cells: int, place: float) -> Floats:
    """Return the weights of a row's cells at a place, by linear interpolation."""
    at = min(max(place * cells - 0.5, 0.0), cells - 1.0)
    return np.maximum(0.0, 1.0 - np.abs(np.arange(cells) - at))


def value(image: Floats, x: float, y: float) -> float:
    """Return an image's bilinear interpolation at a place."""
    return float(shares(len(image), y) @ image @ shares(len(image), x))


def densities(system: Coverage, flight: Flight) -> tuple[Floats, Floats]:
    """Return the density in force and its change per second, as images."""
    new, old = (
        image / image.mean() if image.any() else np.ones_like(image) for image in (flight.commands[0], flight.former[0])
    )
    share = min(flight.age[0] / system.blend, 1.0)
    density = (1 - system.floor) * ((1 - share) * old + share * new) + system.floor
    rate = (1 - system.floor) * (new - old) / system.blend if share < 1 else np.zeros_like(new)
    return density, rate


def spread(image: Floats, side: int) -> Floats:
    """Return an image at the centres (side, side) of the grid."""
    along = np.array([shares(len(image), centre) for centre in (np.arange(side) + 0.5) / side])
    return along @ image @ along.T


class Cells:
    """The cells among some drones."""

    def __init__(self, places: Floats, density: Floats, rate: Floats, gain: float) -> None:
        side = len(density)
        centres = (np.arange(side) + 0.5) / side
        x, y = (axis.ravel() for axis in np.meshgrid(centres, centres))
        squared = (x - places[:, :1]) ** 2 + (y - places[:, 1:]) ** 2
        nearest = squared <= squared.min(axis=0) + 1e-12
        shares = nearest / nearest.sum(axis=0)
        self.places = places
        self.masses = shares @ density.ravel() / side**2
        self.centroids, self.first = places.copy(), np.zeros_like(places)
        for j in np.flatnonzero(self.masses):
            here, mass = shares[j] / side**2, self.masses[j]
            for axis, points in enumerate((x, y)):
                centroid = self.centroids[j, axis] = here @ (points * density.ravel()) / mass
                drift = here @ ((points - centroid) * rate.ravel()) / mass
                self.first[j, axis] = gain * (centroid - places[j, axis]) + drift

    def edges(self, i: int) -> list[tuple[int, Floats, Floats]]:
        """Return the sides of the cell of i that lie between it and others: the other, and the two ends.

        The square, cut along each bisector in turn.
        """
        corners = [np.array(corner, float) for corner in ((0, 0), (1, 0), (1, 1), (0, 1))]
        polygon = [(-1, corners[k], corners[(k + 1) % 4]) for k in range(4)]
        for j, place in enumerate(self.places):
            normal = place - self.places[i]
            if normal @ normal <= 1e-12:
                continue
            normal = normal / np.sqrt(normal @ normal)
            middle = (place + self.places[i]) / 2
            kept, ends = [], []
            for other, start, end in polygon:
                before, after = (start - middle) @ normal, (end - middle) @ normal
                if before <= 0 and after <= 0:
                    kept.append((other, start, end))
                elif before <= 0 or after <= 0:
                    crossing = start + (end - start) * (before / (before - after))
                    kept.append((other, start, crossing) if before <= 0 else (other, crossing, end))
                    ends.append(crossing)
            if len(ends) == 2:
                kept.append((j, *ends))
            polygon = kept
        return [side for side in polygon if side[0] >= 0]

    def follow(self, i: int, density: Floats, closest: float) -> Floats:
        """Return the velocity of the centroid of i by the motion of i and its neighbours."""
        moved = np.zeros(2)
        if self.masses[i] <= 0.0:
            return moved
        nodes, weights = np.polynomial.legendre.leggauss(4)
        here, own = self.places[i], self.first[i]
        owners = (((self.places - here) ** 2).sum(axis=1) <= 1e-12).sum()
        for j, start, end in self.edges(i):
            length = np.sqrt((end - start) @ (end - start))
            distance = max(np.sqrt((self.places[j] - here) @ (self.places[j] - here)), closest)
            for node, weight in zip(nodes, weights, strict=True):
                point = (start + end) / 2 + node * (end - start) / 2
                outward = ((self.places[j] - point) @ self.first[j] + (point - here) @ own) / distance
                part = weight * length / 2 * value(density, *point) * outward / self.masses[i] / owners
                moved += part * (point - self.centroids[i])
        return moved


def random_images(generator: Generator, shape: tuple[int, ...]) -> Floats:
    """Draw the images in force and before (2, *shape), faint or bright, some of them empty."""
    images = generator.random((2, *shape)) ** generator.choice([1, 4, 16])
    images[generator.random(2) < 0.1] = 0.0
    return images


COVERAGES = (
    Coverage(),
    Coverage(neighbours=False),
    Coverage(gain=2.0, floor=0.1, speed=0.2, response=0.5, grid=30, blend=2.0),
)


def compare_coverage(generator: Generator, number: int) -> float:
    system, config = COVERAGES[number % 3], GameConfig(dynamics=some_speed(number))
    age = float(generator.choice([0.0, 0.35, 100.0]))
    flight = random_flight(generator, random_images(generator, (10, 10)), 1 + number % 40, age)
    density, rate = densities(system, flight)
    fine, fine_rate, known = spread(density, system.grid), spread(rate, system.grid), {}

    def expected(i, heard, p, v):
        crew = tuple(heard)
        if crew not in known:
            known[crew] = Cells(p[heard], fine, fine_rate, system.gain)
        cells, place = known[crew], heard.index(i)
        wanted = cells.first[place].copy()
        if system.neighbours:
            wanted += cells.follow(place, density, 1 / system.grid)
        fast = np.sqrt(wanted @ wanted)
        wanted *= min(1.0, system.speed / fast) if fast > 0 else 1.0
        return (wanted / config.dynamics.speed_factor - v[i]) / system.response

    return error_of(system, flight, config, expected)


# --- potential fields -------------------------------------------------------------------------------------------------


FIELDS = (PotentialField(), PotentialField(strength=0.2, attraction=2.0, repulsion=0.5, wall=0.05, friction=0.3))


def compare_potential_field(generator: Generator, number: int) -> float:
    system = FIELDS[number % 2]
    flight = random_flight(generator, random_images(generator, (2, 10, 10)), 1 + number % 40)
    attracts, repels = flight.commands[0]

    def charge(row: int, column: int) -> float:
        held = attracts[row, column] / attracts.sum() if attracts.any() else 1 / 100
        repelled = repels[row, column] / repels.sum() - 1 / 100 if repels.any() else 0.0
        return float(system.attraction * held - system.repulsion * repelled)

    def force(away: Floats, softening: float) -> Floats:
        return away / (away @ away + softening**2) ** 1.5

    def expected(i, heard, p, v):
        place, total = p[i], np.zeros(2)
        for row, column in np.ndindex(10, 10):
            total += charge(row, column) * force(np.array([column + 0.5, row + 0.5]) / 10 - place, 1 / 10)
        for j in heard:
            if j != i:
                total += force(place - p[j], system.softening) / len(heard)
        low, high = place, 1 - place
        total += system.wall * (1 / (low**2 + system.softening**2) - 1 / (high**2 + system.softening**2))
        return system.strength * total - system.friction * v[i]

    return error_of(system, flight, GameConfig(), expected)


# --- ergodic control with kernels -------------------------------------------------------------------------------------

KERNELS = (KernelErgodic(), KernelErgodic(gain=1.0, length=0.1, softening=0.05, damping=0.5, horizon=2))


def compare_kernel_ergodic(generator: Generator, number: int) -> float:
    system, config = KERNELS[number % 2], GameConfig(dynamics=some_speed(number))
    flight = random_flight(generator, random_images(generator, (10, 10)), 1 + number % 40)
    density, factor = flight.commands[0], config.dynamics.speed_factor
    density = density / density.mean() if density.any() else np.ones((10, 10))

    def slope(x: Floats, point: Floats) -> Floats:
        """Return the gradient of k by x."""
        distance = math.sqrt((x - point) @ (x - point) + system.softening**2)
        return -math.exp(-distance / system.length) * (x - point) / distance

    def ahead(p: Floats, v: Floats, h: int) -> Floats:
        return np.clip(p + 0.1 * h * factor * v, 0.0, 1.0)

    def expected(i, heard, p, v):
        last, total, points = ahead(p[i], v[i], system.horizon), np.zeros(2), len(heard) * (system.horizon + 1)
        for j in heard:
            for h in range(system.horizon + 1):
                total += slope(last, ahead(p[j], v[j], h)) / points
        for row, column in np.ndindex(10, 10):
            total -= slope(last, np.array([column + 0.5, row + 0.5]) / 10) * density[row, column] / 100
        return -system.gain / factor * total - system.damping * v[i]

    return error_of(system, flight, config, expected)


# --- formations -------------------------------------------------------------------------------------------------------


def slots_of(command: dict, m: int, margin: float) -> Floats:
    if "points" in command:
        points = command["points"]
        whole = len(points)
        frame = [points[i * whole // m] if m <= whole else points[i % whole] for i in range(m)]
    else:
        frame = unit_slots(command["shape"], m)
    cosine, sine = math.cos(command["turn"]), math.sin(command["turn"])
    turned = np.array([(cosine * a - sine * b, sine * a + cosine * b) for a, b in frame])
    return np.clip(np.array(command["centre"]) + command["size"] * turned, margin, 1 - margin)


def compare_formation(generator: Generator, number: int) -> float:
    own = int(generator.integers(1, 41))
    system = Formation() if number % 2 else Formation(stiffness=7.0, damping=2.0, margin=0.1)
    config = GameConfig(controllers=system, dynamics=some_speed(number))
    command = {"centre": tuple(generator.random(2)), "size": generator.uniform(0.0, 0.5)}
    command["turn"] = generator.uniform(-math.pi, math.pi)
    if number % 6 < 5:
        command["shape"] = SHAPES[number % 6]
    else:
        command["points"] = generator.uniform(-1, 1, (int(generator.integers(1, 2 * min(own, 30) + 1)), 2))
    flight = random_flight(generator, np.stack([system.parse(command, config)] * 2), own)

    def expected(i, heard, p, v):
        slots = slots_of(command, len(heard), system.margin)
        taken = linear_sum_assignment(((p[heard][:, None] - slots) ** 2).sum(axis=2))[1]
        slot = slots[taken[heard.index(i)]]
        return system.stiffness / config.dynamics.speed_factor * (slot - p[i]) - system.damping * v[i]

    return error_of(system, flight, config, expected)


# --- leaders and followers --------------------------------------------------------------------------------------------

LEADERS = (
    LeaderFollower(),
    LeaderFollower(leaders=1),
    LeaderFollower(appoint="lowest"),
    LeaderFollower(leaders=5, foresight=0.0, cohesion=3.0, alignment=1.0, leadership=0.8),
    LeaderFollower(leaders=3, stiffness=9.0, damping=1.0, separation=5.0, separation_radius=0.3, margin=0.2),
)


def compare_leader_follower(generator: Generator, number: int) -> float:
    system, config = LEADERS[number % len(LEADERS)], GameConfig(dynamics=some_speed(number))
    places, factor = generator.random((system.leaders, 2)), config.dynamics.speed_factor
    flight = random_flight(generator, np.stack([places] * 2), int(generator.integers(1, 41)))

    def appoint(heard, p, v) -> dict[int, Floats]:
        """Return the leaders among those heard, with the place that each leads to."""
        led, free = {}, list(heard)
        for place in places[: len(heard)]:
            away = {j: sum((p[j] + system.foresight * factor * v[j] - place) ** 2) for j in free}
            chosen = free[0] if system.appoint == "lowest" else min(free, key=lambda j: (away[j], j))
            led[chosen] = place
            free.remove(chosen)
        return led

    def expected(i, heard, p, v):
        led, others = appoint(heard, p, v), [j for j in heard if j != i]
        if i in led:
            goal = np.clip(led[i], system.margin, 1 - system.margin)
            total = system.stiffness / factor * (goal - p[i]) - system.damping * v[i]
        else:
            leaders, followers = [j for j in others if j in led], [j for j in others if j not in led]
            share, total = system.leadership if followers else 1.0, np.zeros(2)
            for group, weight in ((leaders, share), (followers, 1.0 - share)):
                for j in group:
                    agree = system.cohesion / factor * (p[j] - p[i]) + system.alignment * (v[j] - v[i])
                    total += weight / len(group) * agree
        for j in others:
            if j in led or i not in led:
                away = p[i] - p[j]
                distance = np.sqrt(sum(away**2))
                strength = max(0.0, 1.0 - distance / system.separation_radius)
                total += system.separation * strength * away / max(distance, 1e-6)
        return total

    return error_of(system, flight, config, expected)


COMPARED = {
    name.removeprefix("compare_"): compare for name, compare in list(globals().items()) if name.startswith("compare_")
}
"""By the name of the control system."""
