"""Messages of ROS programs become commands of a seat."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import RED, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.errors import ProtocolError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.forms import commands_of
from swarm_pz.play.ros import commands
from swarm_pz.play.strokes import Stroke, density_of

CELLS = 10
IMAGE = np.random.default_rng(1).random((50, 50))


def takes(name):
    """Return the description of a control system's commands."""
    return commands_of(system_of(name), GameConfig())


def made(maker, system="ergodic"):
    """Return a command as the table reads it: its kind and its numbers."""
    message = maker(takes(system), CELLS)
    reader = CommandReader(GameConfig(controllers=system))
    if message.density is not None:
        return "density", reader.read(RED, 0, message.density).values
    command = reader.read(RED, 0, message.command, takes(system).takes)
    return command.kind, command.values


def test_an_image_is_a_density_cell_by_cell_however_bright_it_is():
    kind, values = made(commands.density({"data": IMAGE.ravel().tolist()}))
    means = IMAGE.reshape(10, 5, 10, 5).mean(axis=(1, 3))
    assert kind == "density"
    np.testing.assert_allclose(values / values.mean(), means / means.mean(), rtol=0, atol=1e-7)
    for factor in (1e-300, 1e300):
        _, other = made(commands.density({"data": (IMAGE.ravel() * factor).tolist()}))
        np.testing.assert_array_equal(other, values)


def test_the_weak_contrast_of_a_tablet_is_raised_and_by_released_it_is_sent_as_it_is():
    strokes = [Stroke(brush="attract", width=0.1, points=((0.3, 0.6),))]
    image = np.rint(255 * density_of(strokes, CELLS, "paper")).repeat(5, 0).repeat(5, 1)
    message = {"data": (10.0 * image / image.sum()).ravel().tolist()}
    assert made(commands.density(message))[1].min() > 0.9
    raised = made(commands.density(message, is_weak=True))[1]
    assert raised[5:7, 2:4].mean() > 0.5 > 0.01 > np.median(raised)
    assert np.ptp(made(commands.density({"data": [0.004] * 2500}, is_weak=True))[1]) == 0.0, "nothing is drawn"


def test_an_empty_image_asks_for_everywhere():
    for maker in (commands.density({"data": [0.0] * 2500}), commands.clear):
        np.testing.assert_array_equal(made(maker)[1], np.ones((10, 10)))


def pose(x, y, z=0.0):
    """Return a pose of a PoseArray."""
    return {"position": {"x": x, "y": y, "z": z}, "orientation": {}}


def test_attractors_are_places_with_weights_of_which_none_is_the_largest():
    kind, values = made(commands.attractors({"poses": [pose(0.2, 0.3, 60.0), pose(0.7, 0.8)]}), "flocking")
    assert kind == "attractors"
    assert values.tolist() == [[0.2, 0.3, 60.0]] + 3 * [[0.7, 0.8, 100.0]]
    for more, weight in (({}, 100.0), ({"migration_weight": 75}, 75.0), ({"weight": 75}, 75.0)):
        _, values = made(commands.attractor({"x": 0.25, "y": 1} | more), "flocking")
        assert values.tolist() == 4 * [[0.25, 1.0, weight]]


@pytest.mark.parametrize("system", ["direct", "ergodic", "flocking", "formation", "leader_follower"])
def test_every_system_takes_its_numbers_and_begins_anew(system):
    default = np.asarray(system_of(system).default(GameConfig(controllers=system)))
    kind, values = made(commands.any_kind({"data": default.ravel().tolist()}), system)
    np.testing.assert_allclose(values, default, atol=1e-6)
    assert kind == takes(system).takes
    made(commands.clear, system)
    if system == "direct":  # drone by drone
        assert made(commands.any_kind({"data": [0.5, -0.5] * 20}), system)[1].tolist() == 20 * [[0.5, -0.5]]


NONE = [None, [], [3], [{"position": 3}], [pose(float("nan"), 0.5)], [pose(10**400, 0.5)]]


@pytest.mark.parametrize(
    ("reader", "message", "system", "said"),
    [
        *(
            (commands.density, {"data": data}, "ergodic", said)
            for data, said in [
                ([0.1] * 2499, "2499 values"), ([0.1] * 121, "multiple"), ([], "0 values"), ([-0.1] * 2500, "below 0"),
                ([10**400] * 2500, "out of range"), ([True] * 2500, "got `bool`"), ("attract", "got `str`"),
            ]
        ),
        *((commands.attractors, {"poses": poses}, "flocking", "must be") for poses in NONE),
        (commands.density, {"data": [1.0] * 100}, "direct", "takes accelerations; .*TEAM/command"),
        (commands.attractor, {"x": 0, "y": 0}, "ergodic", "takes density; .*TEAM/density"),
        (commands.attractor, {"x": 0, "y": 0}, "formation", "takes formation.*TEAM/command"),
        (commands.any_kind, {"data": [0.5] * 20}, "direct", "20 x 2, got 20"),
    ],
)  # fmt: skip
def test_what_is_none_or_does_not_fit_the_seat_is_refused_with_what_does(reader, message, system, said):
    with pytest.raises(ProtocolError, match=said):
        reader(message)(takes(system), CELLS)
