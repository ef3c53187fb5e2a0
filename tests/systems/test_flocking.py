"""Commands of a flock: their forms, and the time that each is in force."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import FlockingConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand
from swarm_pz.systems.flocking import Flocking
from tests.systems.flights import game_of

FLOCKING, CONFIG = Flocking(), GameConfig(controllers="flocking")
HERE, THERE = (0.2, 0.7, 60.0), (0.9, 0.1, 80.0)
ATTRACTOR = FlockingCommand(position=HERE[:2], weight=HERE[2])


@pytest.mark.parametrize(
    "written", [ATTRACTOR, [ATTRACTOR], HERE, [HERE], np.array([HERE] * 4), [ATTRACTOR, HERE]],
    ids=["object", "objects", "row", "rows", "all", "mixed"],
)  # fmt: skip
def test_an_attractor_has_many_forms(written):
    np.testing.assert_array_equal(FLOCKING.parse(written, CONFIG), [HERE] * 4)


def test_the_last_of_fewer_attractors_fills_the_rest():
    np.testing.assert_array_equal(FLOCKING.parse([HERE, THERE], CONFIG), [HERE, THERE, THERE, THERE])
    learned = FLOCKING.parse_all(np.array([[HERE, THERE]] * 3), 3, CONFIG, "actions")
    np.testing.assert_array_equal(learned, [[HERE, THERE, THERE, THERE]] * 3)


@pytest.mark.parametrize(
    ("cells", "attractor"),
    [
        ({(0, 0): 1.0}, (0.05, 0.05, 100.0)),
        ({(1, 8): 1.0, (8, 1): 1.0}, (0.85, 0.15, 75.0)),  # the first of equals
        ({(4, 4): 0.2, (4, 5): 0.6, (9, 0): 0.7}, (0.525, 0.45, 50.0 + 40.0 / 1.5)),  # the strongest block of 3 x 3
    ],
)
def test_a_density_is_converted_to_an_attractor_where_it_is_strongest(cells, attractor):
    density = np.zeros((10, 10))
    for place, value in cells.items():
        density[place] = value
    np.testing.assert_allclose(FLOCKING.parse(density, CONFIG), [attractor] * 4, rtol=1e-6)
    for even in (np.zeros((10, 10)), np.ones((10, 10))):
        np.testing.assert_array_equal(FLOCKING.parse(even, CONFIG), FLOCKING.default(CONFIG))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([], "1 to 4 attractors"),
        ([HERE, (0.1, 1.2, 60.0)], r"within \[0, 1\] at index \(1, 1\), got 1.2"),
        ((0.1, 0.2, 49.0), r"within \[50, 100\] at index \(0, 2\), got 49"),
        (2 * np.ones((10, 10)), r"of shape \(10, 10\)"),
    ],
)
def test_what_is_no_attractor_is_refused(command, said):
    with pytest.raises(CommandError, match=said):
        FLOCKING.parse(command, CONFIG)


def test_weights_may_be_as_exact_as_the_range_or_as_a_learners_numbers():
    config = CONFIG.replace(flocking=FlockingConfig(migration=(0.1, 1e5 + 0.123)))
    space = FLOCKING.space(config)
    for rows in (space.low, space.high, [(0.0, 0.0, 0.1)], [(1.0, 1.0, 1e5 + 0.123)]):
        assert FLOCKING.parse(rows, config).shape == (4, 3)
    # The command space begins at the float32 nearest to the least weight, which can be above it.
    Simulator(GameConfig(controllers="flocking", flocking=FlockingConfig(migration=(605480.98, 1e6))))


def test_watchers_see_all_attractors_of_a_command():
    shown = FLOCKING.to_densities(FLOCKING.parse([(0.25, 0.35, 50.0), (0.95, 0.95, 60.0)], CONFIG)[None], CONFIG)[0]
    assert shown[3, 2] == 0.25 and shown[9, 9] == 0.75 and shown.sum() == 1.0


def test_each_attractor_is_in_force_for_its_time_and_the_last_one_stays():
    simulator = Simulator(game_of("flocking", 1, flocking=FlockingConfig(dwell=2.0)))
    simulator.command(0, [[(0.9, 0.5, 60.0), (0.5, 0.9, 60.0), (0.1, 0.5, 60.0)]])
    wanted = []
    for _ in range(80):
        simulator.games.positions[:], simulator.games.velocities[:] = 0.5, 0.0
        simulator.advance(3)
        wanted.append(np.round(simulator.games.accelerations[0, 0]).tolist())
    assert wanted == [[1, 0]] * 20 + [[0, 1]] * 20 + [[-1, 0]] * 40
    simulator.command(0, [(0.5, 0.1, 60.0)])
    simulator.advance(3)
    assert simulator.games.accelerations[0, 0, 1] < 0.0
