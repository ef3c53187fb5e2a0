"""Direct control: an acceleration for every drone."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.direct import Direct
from tests.systems import reference_direct
from tests.systems.drawn_flights import permuted, random_flight, together, turn, turned_flight

CONFIG = GameConfig(drones_per_team=3, controllers="direct", capture=CaptureConfig(enabled=False))
SYMMETRIES = list(itertools.product((False, True), repeat=3))


def flown(command, config=CONFIG, teams=None) -> Simulator:
    """Return a game, one tick after red's command; blue does nothing."""
    simulator = Simulator(config)
    simulator.reset([0], scenario={} if teams is None else {"teams": np.array(teams)})
    simulator.command(0, [command])
    simulator.advance(1)
    return simulator


def test_it_flies_as_the_equation_says():
    assert reference_direct.compare(60, seed=0) < 1e-4


def test_each_drone_does_what_its_row_says():
    command = np.zeros((6, 2))
    command[1] = 0.5, -0.25
    accelerations = flown(command).games.accelerations[0]
    np.testing.assert_array_equal(accelerations, command.astype(np.float32))


def test_units_are_of_the_largest_acceleration_and_vectors_are_scaled_not_cut_by_axis():
    config = CONFIG.replace(controller=ControllerConfig(max_acceleration=2.0))
    command = np.zeros((6, 2))
    command[0], command[2] = (1, 1), (0.5, 0)
    accelerations = flown(command, config).games.accelerations[0]
    np.testing.assert_allclose(accelerations[0], np.sqrt([2.0, 2.0]), rtol=1e-6)
    np.testing.assert_allclose(accelerations[2], (1.0, 0.0), rtol=1e-6)


def test_rows_of_drones_that_others_fly_mean_nothing_and_a_drone_keeps_its_row_when_it_is_captured():
    accelerations = flown(np.full((6, 2), 0.5), teams=[0, 1, 0, 1, 1, 0]).games.accelerations[0]
    assert (accelerations[:, 0] != 0).tolist() == [True, False, True, False, False, True]


def test_nothing_is_done_at_first_and_a_command_is_held_until_the_next():
    simulator = Simulator(CONFIG)
    simulator.reset([0])
    simulator.advance(30)
    assert (simulator.games.accelerations == 0).all()
    command = np.zeros((6, 2))
    command[0] = 0.1, 0.0
    simulator.command(0, [command])
    simulator.advance(30)
    assert simulator.velocities[0, 0] == pytest.approx((0.1, 0.0))


def test_talk_radius_and_lost_messages_change_nothing():
    command = np.random.default_rng(0).uniform(-1, 1, (6, 2))
    deaf = CONFIG.replace(controller=ControllerConfig(communication_radius=0.0, message_loss=1.0))
    np.testing.assert_array_equal(flown(command).games.accelerations, flown(command, deaf).games.accelerations)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_it_has_the_symmetries_of_the_square(symmetry):
    generator = np.random.default_rng(0)
    command = generator.uniform(-1, 1, (6, 2))
    flight = random_flight(generator, command, 4, 2)
    found = Direct().solve(turned_flight(flight, symmetry, turn(command, symmetry, 0.0)), CONFIG)
    np.testing.assert_array_equal(found, turn(Direct().solve(flight, CONFIG), symmetry, 0.0))


def test_drones_and_their_rows_can_be_permuted():
    generator = np.random.default_rng(0)
    flight, order = random_flight(generator, generator.uniform(-1, 1, (6, 2)), 6, 0), generator.permutation(6)
    other = permuted(flight, order)._replace(commands=flight.commands[:, order])
    np.testing.assert_array_equal(Direct().solve(other, CONFIG), Direct().solve(flight, CONFIG)[:, order])


def test_a_game_alone_and_among_others_is_the_same_bit_for_bit():
    generator = np.random.default_rng(0)
    flights = [random_flight(generator, generator.uniform(-1, 1, (6, 2)), own, 6 - own) for own in range(7)]
    many = Direct().solve(together(flights), CONFIG)
    for row, flight in enumerate(flights):
        np.testing.assert_array_equal(Direct().solve(flight, CONFIG)[0], many[row])


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (np.zeros((5, 2)), r"of shape \(6, 2\), got shape \(5, 2\)"),
        (np.full((6, 2), 1.5), r"within \[-1, 1\] at index \(0, 0\), got 1.5"),
        (np.full((6, 2), np.nan), "got nan"),
        ("forwards", "must be numbers"),
    ],
)
def test_what_are_no_accelerations_are_refused(command, said):
    with pytest.raises(CommandError, match=f"red's command .*{said}"):
        flown(command)


def test_learners_play_it_and_there_are_no_named_commands():
    env = parallel_env(drones_per_team=3, controllers="direct", command_period=0.1, time_limit=1.0)
    env.reset(seed=0)
    assert env.action_space("red_0").shape == (6, 2)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    with pytest.raises(ConfigError, match="direct has none"):
        Format(CONFIG, CONFIG.observations[0], action="discrete")
