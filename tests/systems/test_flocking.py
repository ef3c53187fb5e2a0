"""What a flock can be told, and in which forms."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import ControllerConfig, DynamicsConfig, FlockingConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand
from swarm_pz.systems.flocking import Flocking
from tests.systems.flights import game_of, put, random_states, solve

FLOCKING, CONFIG = Flocking(), GameConfig(controllers="flocking")
HERE, THERE = (0.2, 0.7, 60.0), (0.9, 0.1, 80.0)


def attractor(row):
    return FlockingCommand(position=row[:2], weight=row[2])


@pytest.mark.parametrize(
    "written",
    [
        attractor(HERE),
        [attractor(HERE)],
        HERE,
        [HERE],
        np.array([HERE] * 4),
        [attractor(HERE), HERE],
    ],
    ids=["object", "objects", "row", "rows", "all", "mixed"],
)
def test_an_attractor_has_many_forms(written):
    np.testing.assert_array_equal(FLOCKING.parse(written, CONFIG), [HERE] * 4)


def test_the_last_of_fewer_attractors_fills_the_rest():
    np.testing.assert_array_equal(FLOCKING.parse([HERE, THERE], CONFIG), [HERE, THERE, THERE, THERE])
    learned = FLOCKING.parse_all(np.array([[HERE, THERE]] * 3), 3, CONFIG, "actions")
    np.testing.assert_array_equal(learned, [[HERE, THERE, THERE, THERE]] * 3)


def test_a_density_is_served_where_it_is_strongest():
    density = np.zeros((10, 10))
    density[0, 0] = 0.3
    np.testing.assert_allclose(FLOCKING.parse(density, CONFIG), [(0.05, 0.05, 100.0)] * 4)
    np.testing.assert_array_equal(FLOCKING.parse(np.ones((10, 10)), CONFIG), FLOCKING.default(CONFIG))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([], "1 to 4 attractors"),
        ([HERE] * 5, "1 to 4 attractors"),
        ("left", "1 to 4 attractors"),
        ([HERE, (0.1, 0.2)], "1 to 4 attractors"),
        ([(0.1, 0.2)], r"of shape \(1, 3\), got shape \(1, 2\)"),
        ([HERE, (0.1, 1.2, 60.0)], r"within \[0, 1\] at index \(1, 1\), got 1.2"),
        ((0.1, 0.2, 49.0), r"within \[50, 100\] at index \(0, 2\), got 49"),
        (FlockingCommand(position=3.0, weight=60.0), "has a position"),
        (2 * np.ones((10, 10)), r"in \[0, 1\] of shape \(10, 10\)"),
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


def test_watchers_see_all_attractors_of_a_command():
    shown = FLOCKING.to_densities(FLOCKING.parse([(0.25, 0.35, 50.0), (0.95, 0.95, 60.0)], CONFIG)[None], CONFIG)[0]
    assert shown[3, 2] == 0.25 and shown[9, 9] == 0.75 and shown.sum() == 1.0


def test_each_attractor_is_in_force_for_its_time_and_the_last_one_stays():
    config = game_of("flocking", 1, flocking=FlockingConfig(dwell=2.0))
    simulator = Simulator(config)
    simulator.reset([0], scenario={"positions": [(0.5, 0.5)]})
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


def test_team_mates_that_are_not_heard_are_no_neighbours():
    # So near to each other that they part, if they know of each other.
    positions = np.array([[(0.49, 0.5), (0.51, 0.5)]], np.float32)
    state = random_states(np.random.default_rng(0), 1, 2)._replace(positions=positions)
    state.velocities[:], state.teams[:] = 0.0, 0
    apart = solve("flocking", state)[0, :, 0]
    assert apart[0] < -0.9 and apart[1] > 0.9
    for deaf in ({"communication_radius": 0.01}, {"message_loss": 1.0}):
        together = solve("flocking", state, controller=ControllerConfig(**deaf))[0, :, 0]
        assert together[0] > 0.9 and together[1] < -0.9
    failing = Simulator(game_of("flocking", 2, dynamics=DynamicsConfig(failure_rate=1e-9)))
    put(failing, state)
    failing.games.failed[0, 1] = True
    failing.advance(1)
    assert failing.games.accelerations[0, 0, 0] > 0.9 and not failing.games.accelerations[0, 1].any()


def test_any_least_weight_begins_a_game():
    """Its nearest float32, the least that commands may have, can be above it."""
    least = 605480.98
    assert float(np.float32(least)) > least + 1e-6
    Simulator(GameConfig(controllers="flocking", flocking=FlockingConfig(migration=(least, 1e6))))
