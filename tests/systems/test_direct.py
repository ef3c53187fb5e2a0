"""Direct control: an acceleration for every drone."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.simulator import Simulator

CONFIG = GameConfig(drones_per_team=3, controllers="direct", capture=CaptureConfig(enabled=False))


def flown(command, config=CONFIG, teams=None) -> Simulator:
    """Return a game, one tick after red's command; blue does nothing."""
    simulator = Simulator(config)
    simulator.reset([0], scenario={} if teams is None else {"teams": np.array(teams)})
    simulator.command(0, [command])
    simulator.advance(1)
    return simulator


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
