"""Capture fields and targets, as clients see them."""

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.play.server.views import capture_fields, target_message
from swarm_pz.simulator import Simulator


@pytest.fixture(scope="module")
def simulator():
    simulator = Simulator(GameConfig(drones_per_team=(6, 9)))
    simulator.reset([3])
    simulator.advance(60)
    return simulator


def test_fields_are_reds_and_blues_and_at_least_192_exactly_where_they_capture(simulator):
    shown = capture_fields(simulator)
    np.testing.assert_array_equal(shown >= 192, simulator.captures_here[0])
    field = simulator.capture_field[0]
    expected = 255 * field / field.max(axis=(1, 2), keepdims=True)
    assert np.abs(shown - expected).max() <= 1.01
    assert (shown[RED] != shown[BLUE]).any()


@pytest.mark.parametrize("team", [RED, BLUE])
def test_a_target_is_bright_where_its_command_asks(team, simulator):
    density = np.zeros((1, 10, 10))
    density[0, 1, 8] = 1.0
    simulator.command(team, density)
    data = target_message(team, 70_000, simulator.games.coefficients[0, team])
    assert (data[1], int.from_bytes(data[4:8], "little")) == (team, 70_000)
    picture = np.frombuffer(data[8:], np.uint8).reshape(50, 50)
    row, column = np.unravel_index(picture.argmax(), picture.shape)
    assert 5 <= row < 10 and 40 <= column < 45 and picture.max() == 255
    assert picture[30:, :20].max() < 64, "and nothing wraps round below nothing"
