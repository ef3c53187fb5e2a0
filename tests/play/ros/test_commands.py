"""What ROS programs publish, as the commands of a seat."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import RED, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.errors import CommandError, ProtocolError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.forms import commands_of
from swarm_pz.play.ros import commands

CELLS = 10


def takes(name, game=None):
    """Return what a seat takes that a control system flies."""
    return commands_of(system_of(name), game or GameConfig())


def made(maker, system="ergodic"):
    """Return a command as the table reads it: its kind and its numbers."""
    told = maker(takes(system), CELLS)
    reader = CommandReader(GameConfig(controllers=system))
    if told.density is not None:
        return "density", reader.read(RED, 0, told.density).values
    command = reader.read(RED, 0, told.command, takes(system).takes)
    return command.kind, command.values


def test_an_image_of_a_tablet_is_a_density_cell_by_cell():
    image = np.random.default_rng(1).random((50, 50))
    kind, values = made(commands.density({"data": image.ravel().tolist()}))
    means = image.reshape(10, 5, 10, 5).mean(axis=(1, 3))
    assert kind == "density"
    np.testing.assert_allclose(values / values.mean(), means / means.mean(), rtol=0, atol=1e-7)


def test_an_image_asks_for_the_same_however_bright_it_is():
    image = np.random.default_rng(2).random(2500)
    _, values = made(commands.density({"data": image.tolist()}))
    for factor in (1e-300, 1e300):
        _, other = made(commands.density({"data": (image * factor).tolist()}))
        np.testing.assert_array_equal(other, values)


def test_an_empty_image_asks_for_everywhere():
    for maker in (commands.density({"data": [0.0] * 2500}), commands.clear):
        np.testing.assert_array_equal(made(maker)[1], np.ones((10, 10)))


def test_of_an_occupancy_grid_the_unknown_is_empty():
    _, values = made(commands.occupancy({"data": [-1] * 50 + [100] * 50}))
    np.testing.assert_array_equal(values, np.repeat([[0.0], [1.0]], 5, axis=0) @ np.ones((1, 10)))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ([0.1] * 2499, "square image.* got 2499 values"),
        ([0.1] * 121, "10 cells a side or a multiple of it"),
        ([], "got 0 values"),
        ([-0.1] * 2500, "none below 0"),
        ([float("inf")] * 2500, "finite numbers"),
        ([10**400] * 2500, "one that is too large"),
        (["1"] * 2500, "a list of numbers"),
        ([True] * 2500, "a list of numbers"),
        ([[0.1]] * 2500, "a list of numbers"),
        ("attract", "a list of numbers, got str"),
        (None, "a list of numbers, got NoneType"),
    ],
)
def test_what_is_no_image_is_refused(data, said):
    with pytest.raises(ProtocolError, match=said):
        commands.density({"data": data})(takes("ergodic"), CELLS)


def pose(x, y, z=0.0):
    """Return a pose of a PoseArray."""
    return {"position": {"x": x, "y": y, "z": z}, "orientation": {}}


def test_attractors_are_places_with_weights_of_which_none_is_the_largest():
    kind, values = made(commands.attractors({"poses": [pose(0.2, 0.3, 60.0), pose(0.7, 0.8)]}), "flocking")
    assert kind == "attractors"
    assert values.tolist() == [[0.2, 0.3, 60.0]] + 3 * [[0.7, 0.8, 100.0]]


@pytest.mark.parametrize("name", ["migration_weight", "weight", "z"])
def test_one_attractor_may_be_written_in_several_ways(name):
    _, values = made(commands.attractor({"x": 0.25, "y": 1, name: 75}), "flocking")
    assert values.tolist() == 4 * [[0.25, 1.0, 75.0]]
    _, values = made(commands.attractor({"x": 0.25, "y": 1}), "flocking")
    assert values.tolist() == 4 * [[0.25, 1.0, 100.0]]


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"poses": []},
        {"poses": [3]},
        {"poses": [{"position": 3}]},
        {"poses": [pose("a", 0.5)]},
        {"poses": [pose(float("nan"), 0.5)]},
        {"poses": [pose(10**400, 0.5)]},
    ],
)
def test_what_is_no_attractor_is_refused(message):
    with pytest.raises(ProtocolError, match="must be"):
        commands.attractors(message)


def test_accelerations_are_two_numbers_for_each_drone():
    kind, values = made(commands.accelerations({"data": [0.5, -0.5] * 20}), "direct")
    assert kind == "accelerations" and values.tolist() == 20 * [[0.5, -0.5]]
    with pytest.raises(ProtocolError, match="a command of direct, 20 x 2, got 20 values"):
        commands.accelerations({"data": [0.5] * 20})(takes("direct"), CELLS)
    with pytest.raises(CommandError, match="red's command"):
        made(commands.accelerations({"data": [5.0] * 40}), "direct")


@pytest.mark.parametrize("system", ["coverage", "direct", "ergodic", "flocking", "formation", "leader_follower"])
def test_every_system_takes_its_numbers_and_begins_anew(system):
    game = GameConfig(controllers=system)
    default = np.asarray(system_of(system).default(game))
    kind, values = made(commands.any_kind({"data": default.ravel().tolist()}), system)
    np.testing.assert_allclose(values, default, atol=1e-6)
    assert kind == takes(system).takes
    made(commands.clear, system)


@pytest.mark.parametrize(
    ("maker", "system", "said"),
    [
        (
            commands.density({"data": [1.0] * 100}),
            "direct",
            "a density cannot .* takes accelerations; .*/accelerations",
        ),
        (commands.accelerations({"data": [1.0] * 40}), "ergodic", "takes density; publish on /swarm/TEAM/density"),
        (commands.attractor({"x": 0, "y": 0}), "ergodic", "an attractor cannot fly this team: ergodic takes density"),
        (commands.accelerations({"data": []}), "flocking", "takes attractors or densities; .*/swarm/TEAM/attractors"),
        (commands.attractor({"x": 0, "y": 0}), "formation", "takes formation.*/swarm/TEAM/command"),
        (commands.any_kind({"data": [float("inf")] * 40}), "direct", "finite numbers"),
    ],
)
def test_a_command_of_another_kind_is_refused_and_both_are_named(maker, system, said):
    with pytest.raises(ProtocolError, match=said):
        maker(takes(system), CELLS)
