"""Actions, written and read as densities and as commands of other kinds."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands
from swarm_pz.spaces.formats import Format
from tests.systems_of_tests import Magnet, install

SEAT = ObservationConfig(grid=25)


def made(controllers="ergodic", **options):
    return Format(GameConfig(controllers=controllers, drones_per_team=2), SEAT, **options)


# --- densities --------------------------------------------------------------------------------------------------------


def test_every_action_reaches_the_game_as_its_space_says():
    action = np.random.default_rng(0).random((2, 10, 10))
    logs = 2 * action - 1
    softmax = np.exp(4 * (logs - logs.max(axis=(1, 2), keepdims=True)))
    for form, sent, expected, below in ((made(action="command"), action, action, -0.1), (made(), logs, softmax, -1.1)):
        np.testing.assert_allclose(form.read(sent, 2), expected)
        np.testing.assert_allclose(form.read_one(sent[1], "x"), expected[1])
        assert form.action_space.low.min() == np.ceil(below)
        for bad in (np.full((10, 10), below), np.full((10, 10), 1.1), sent):
            with pytest.raises(CommandError, match="red's command must be numbers"):
                form.read_one(bad, "red's command")
        with pytest.raises(CommandError, match=r"of shape \(3, 10, 10\), got shape \(2, 10, 10\)"):
            form.read(sent, 3)


def test_coarse_actions_are_interpolated_before_they_are_taken_for_densities():
    logs = np.random.default_rng(0).uniform(-1, 1, (1, 4, 4))
    centres, fine = (np.arange(4) + 0.5) / 4, (np.arange(10) + 0.5) / 10
    along_x = np.array([np.interp(fine, centres, row) for row in logs[0]])
    full = np.array([np.interp(fine, centres, column) for column in along_x.T]).T
    np.testing.assert_allclose(made(action_cells=4).read(logs, 1)[0], np.exp(4 * (full - full.max())))
    np.testing.assert_allclose(made(action_cells=4, action="command").read((logs + 1) / 2, 1)[0], (full + 1) / 2)
    for cells in (2, 10):
        assert made(action_cells=cells).action_space.shape == (cells, cells)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"action_cells": 1}, r"action_cells must be a whole number in \[2, 10\]"),
        ({"action": "discrete", "action_cells": 5}, "leave out action_cells, got 5"),
        ({"action": "modes", "action_cells": 5}, "short vector"),
        ({"controllers": "flocking", "action_cells": 5}, "is for densities, .* flocking takes .* 'attractors'"),
        ({"controllers": "direct", "action": "discrete"}, "direct has none"),
    ],
)
def test_options_that_do_not_fit_are_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        made(**options)


@pytest.mark.parametrize("cells", [2, 10])
def test_modes_are_densities_about_uniform(cells):
    """Catches cosines that are mixed up, turned, or divided by zero where a command has two cells a side."""
    form = Format(GameConfig(command_cells=cells), SEAT, action="modes")
    size = form.action_space.shape[0]
    assert (form.read(np.zeros((1, size)), 1) == 1.0).all()
    actions, centres = np.random.default_rng(0).uniform(-2.0, 2.0, (3, size)), (np.arange(cells) + 0.5) / cells
    pairs = [(y, x) for y, x in ((0, 1), (0, 2), (1, 0), (1, 1), (2, 0)) if max(y, x) < cells]
    waves = [np.outer(np.cos(np.pi * y * centres), np.cos(np.pi * x * centres)) for y, x in pairs]
    logs = (0.5 * actions[:, :, None, None] * waves).sum(axis=1)
    np.testing.assert_allclose(form.read(actions, 3), np.exp(logs - logs.max(axis=(1, 2), keepdims=True)))
    leftwards = form.read_one(np.eye(size)[0], "action")  # the first cosine along x
    assert (np.diff(leftwards, axis=1) < 0.0).all() and (np.diff(leftwards, axis=0) == 0.0).all()


# --- densities by name ------------------------------------------------------------------------------------------------


def expected_densities() -> dict[int, np.ndarray]:
    """Return some densities by the numbers that models were trained on, computed by hand."""
    centres = (np.arange(10) + 0.5) / 10
    y, x = np.meshgrid(centres, centres, indexing="ij")
    middle, ring, disc = (np.hypot(x - px, y - py) for px, py in ((0.5, 0.5), (0.3, 0.7), (0.9, 0.1)))
    corner = np.hypot(np.abs(x - 0.5) - 0.4, np.abs(y - 0.5) - 0.4)
    return {
        0: np.ones((10, 10)),
        1: np.exp(-0.5 * (corner / 0.1) ** 2),
        2: np.exp(-(((middle - 0.25) / 0.15) ** 2)),
        3: 1 / (1 + np.exp((x - 0.5) / 0.03)),
        4: 1 / (1 + np.exp((0.5 - x) / 0.03)),
        5: 1 / (1 + np.exp((y - 0.5) / 0.03)),
        6: 1 / (1 + np.exp((0.5 - y) / 0.03)),
        15: np.exp(-(((ring - 0.25) / 0.08) ** 2)),
        52: np.exp(-0.5 * (disc / 0.1) ** 2),
    }


def test_a_discrete_action_asks_for_the_density_of_its_name_and_has_the_number_that_models_were_trained_on():
    form = made(action="discrete")
    assert form.command_names == COMMAND_NAMES and made().command_names == ()
    assert COMMAND_NAMES[:7] == ("uniform", "corners", "halo", "left", "right", "bottom", "top")
    assert [COMMAND_NAMES.index(name) for name in ("ring_30_70", "disc_90_10")] == [15, 52]
    densities = form.read(np.arange(form.action_space.n), 57)
    for number, wanted in expected_densities().items():
        np.testing.assert_allclose(densities[number], wanted / wanted.max(), atol=1e-12)
    np.testing.assert_array_equal(form.read_one(np.int64(3), "x"), densities[3])
    assert not named_commands(10).flags.writeable
    assert named_commands(5).shape == (57, 5, 5)


@pytest.mark.parametrize("bad", [[0], [0, 57], [0, -1], [0, 1.0], [True, False], "ab", None, [[0, 1]], [0, 10**400]])
def test_bad_discrete_actions_are_refused(bad):
    with pytest.raises(CommandError, match=r"actions must be whole numbers in \[0, 57\)"):
        made(action="discrete").read(bad, 2)


# --- commands of other kinds ------------------------------------------------------------------------------------------


def test_commands_of_a_system_are_written_in_its_units_or_normalised_or_by_its_names(monkeypatch):
    install(monkeypatch, Magnet)
    normalised, own, names = (made("magnet", action=action) for action in ("normalised", "command", "discrete"))
    assert normalised.action_space == spaces.Box(-1.0, 1.0, (2,), np.float32)
    commands = normalised.read([[-1, -1], [0, 0], [1, 1]], 3)
    np.testing.assert_allclose(commands, [[0.0, 0.25], [0.5, 0.5], [1.0, 0.75]])
    assert own.action_space == Magnet().space(GameConfig())
    np.testing.assert_allclose(own.read_one([0.2, 0.3], "red's command"), [0.2, 0.3])
    with pytest.raises(CommandError, match=r"red's command .* within \[0.25, 0.75\] at index \(0, 1\), got 0.2"):
        own.read_one([0.2, 0.2], "red's command")
    assert (names.action_space, names.command_names) == (spaces.Discrete(2), ("left", "right"))
    np.testing.assert_allclose(names.read([1, 0], 2), [[0.9, 0.5], [0.1, 0.5]])
