"""How actions are written where commands are no densities."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.spaces.formats import Format
from tests.systems_of_tests import Magnet, install


@pytest.fixture(autouse=True)
def systems(monkeypatch):
    install(monkeypatch, Magnet)


def made(controllers="magnet", **options):
    config = GameConfig(controllers=controllers, drones_per_team=2)
    return Format(config, ObservationConfig(grid=10), **options)


def test_normalised_actions_span_the_range_of_every_number():
    form = made()
    assert form.action_space == spaces.Box(-1.0, 1.0, (2,), np.float32)
    commands = form.read([[-1, -1], [0, 0], [1, 1]], 3)
    np.testing.assert_allclose(commands, [[0.0, 0.25], [0.5, 0.5], [1.0, 0.75]])


def test_a_command_is_written_in_its_own_units():
    form = made(action="command")
    assert form.action_space == Magnet().space(GameConfig())
    np.testing.assert_allclose(form.read_one([0.2, 0.3], "red's command"), [0.2, 0.3])
    with pytest.raises(CommandError, match=r"red's command .* within \[0.25, 0.75\] at index \(0, 1\), got 0.2"):
        form.read_one([0.2, 0.2], "red's command")


def test_discrete_actions_choose_among_the_systems_own_names():
    form = made(action="discrete")
    assert (form.action_space, form.command_names) == (spaces.Discrete(2), ("left", "right"))
    np.testing.assert_allclose(form.read([1, 0], 2), [[0.9, 0.5], [0.1, 0.5]])
    with pytest.raises(CommandError, match=r"whole numbers in \[0, 2\)"):
        form.read([2, 0], 2)
    with pytest.raises(ConfigError, match="the control system direct has none: use action='command' or 'normalised'"):
        made("direct", action="discrete")


def test_actions_of_several_rows_can_be_flat():
    form = made("direct", flatten_actions=True)
    assert form.action_space.shape == (8,)
    np.testing.assert_array_equal(form.read_one(np.arange(8) / 8, "x"), np.arange(8).reshape(4, 2) / 8)


def test_what_is_for_densities_is_refused_for_other_commands():
    with pytest.raises(ConfigError, match=r"is for densities, and the control system magnet takes .* kind 'place'"):
        made(action_cells=5)
