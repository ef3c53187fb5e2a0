"""Direct control: an acceleration for every drone."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from tests.systems import reference_direct

CONFIG = GameConfig(drones_per_team=3, controllers="direct", capture=CaptureConfig(enabled=False))


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
