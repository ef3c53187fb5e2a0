"""A parked drone is safe under the conditions of the lemma in docs/parking.md, each of which is needed."""

from collections import Counter

import numpy as np
from scipy.ndimage import convolve

from swarm_pz.config import BLUE, GRID_CELLS, RED, CaptureConfig, GameConfig, MemoryConfig
from swarm_pz.kernels.capture import RING_COUNTS
from swarm_pz.simulator import Simulator
from tests.reference import RING

RING_CELLS = np.pad(np.zeros((3, 3), int), 1, constant_values=1)
DRONES, HISTORIES, TICKS = 10, 200, 60
TRAIL, THRESHOLD = 6, 0.5
"""Short trails, so that short histories do; and a threshold at which condition 2 does not imply condition 1."""


def put_drones(cells: np.ndarray, simulator: Simulator) -> None:
    """Place all drones of the only game in cells (row, column)."""
    simulator.games.positions[0] = (cells[:, ::-1] + 0.5) / GRID_CELLS


def fields_of(trails: np.ndarray, teams: np.ndarray) -> list[np.ndarray]:
    """Compute both capture fields anew."""
    counted = [trails[:, teams == team] for team in (RED, BLUE)]
    flat = [np.bincount(trail[trail >= 0], minlength=GRID_CELLS**2) for trail in counted]
    return [convolve(one.reshape(GRID_CELLS, GRID_CELLS), RING_CELLS, mode="constant") / RING_COUNTS for one in flat]


def histories():
    """Yield drone 0's cell and, tick by tick, where others are: they hop at random, and at times many to its ring."""
    for seed in range(HISTORIES):
        generator = np.random.default_rng(seed)
        parked, other = generator.integers(5, GRID_CELLS - 5, (2, 2))
        if seed % 2:
            parked[0] = generator.integers(3)
        is_blue = np.arange(DRONES) >= generator.integers(1, 4)
        is_blue[0], is_blue[1] = seed % 3 == 0, False
        stays = generator.choice([0.0, 0.7])
        cells = generator.integers(0, GRID_CELLS, (DRONES, 2))
        history = []
        for burst in generator.random(TICKS) < 0.15:
            # To the ring around drone 0, to another place or the ring around that, or anywhere.
            shares = [0.6, 0.1, 0.0, 0.3] if burst else [0.01, 0.2, 0.06, 0.73]
            kinds = generator.choice(4, DRONES, p=shares)
            goals = np.stack([parked, other, other, parked])[kinds]
            goals += np.array(RING)[generator.integers(16, size=DRONES)] * (kinds % 2 == 0)[:, None]
            goals[kinds == 3] = generator.integers(0, GRID_CELLS, (DRONES, 2))[kinds == 3]
            moves = burst | (generator.random(DRONES) >= stays)
            cells = np.where(moves[:, None], goals.clip(0, GRID_CELLS - 1), cells)
            cells[0] = parked
            history.append(cells)
        yield is_blue, parked, history


def test_the_lemma_holds_and_needs_each_of_its_conditions():
    capture, memory = CaptureConfig(threshold=THRESHOLD), MemoryConfig(trail=TRAIL / 30)
    simulator = Simulator(GameConfig(drones_per_team=DRONES // 2, controllers="direct", memory=memory, capture=capture))
    found = Counter()
    for is_blue, parked, history in histories():
        simulator.reset([0], scenario={"teams": is_blue})
        reds, tops, losses = [], [], []
        for cells in history:
            put_drones(cells, simulator)
            before = simulator.teams[0].copy()
            simulator.advance(1)
            after = simulator.teams[0]
            red, blue = fields_of(simulator.games.trails[0], before)
            on_ring = int(((np.abs(cells - parked).max(axis=1) == 2) & (before == BLUE)).sum())
            reds.append(before[0] == RED)
            tops.append(red.max())
            losses.append((before < after).any())
            if len(reds) >= 2 * TRAIL and before[0] == RED:
                conditions = (
                    all(reds[-TRAIL:]),
                    RING_COUNTS[tuple(parked)] == 16,
                    max(tops[-TRAIL:]) < TRAIL / (16 * THRESHOLD),
                    not any(losses[-TRAIL - 1 : -1]),
                    blue.max() >= on_ring / (16 * THRESHOLD),
                )
                failing = tuple(number for number, holds in enumerate(conditions) if not holds)
                assert failing or after[0] == RED, "captured against the lemma"
                found[failing, after[0] == BLUE] += on_ring > 0
            if simulator.decided[0]:
                break
    assert found[(), False] > 20
    assert all(found[(number,), True] for number in range(5)), "a condition is not needed"
