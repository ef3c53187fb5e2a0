"""How commands are written at the table, and what clients are told of them."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.play.forms import commands_of, installed_systems, read_form
from tests.play.systems import Magnet, Unready, install

GAME = GameConfig(drones_per_team=2)


@pytest.mark.parametrize("name", sorted(registered()))
def test_what_a_client_is_told_of_a_system_is_a_command_of_it(name):
    system = system_of(name)
    told = commands_of(system, GAME)
    assert (told.system, told.takes, told.shape) == (name, system.takes, list(system.space(GAME).shape))
    default = read_form(told.default, system, GAME, "the default")
    np.testing.assert_array_equal(default, system.default(GAME))
    shape, (low, high) = default.shape, (np.asarray(one, float) for one in (told.low, told.high))
    assert low.shape in ((), shape) and (low <= default + 1e-6).all() and (default <= high + 1e-6).all()


def test_the_systems_that_are_told_are_those_that_are_installed(monkeypatch):
    install(monkeypatch, Magnet)
    told = {one.name: one for one in installed_systems(GAME)}
    assert {"direct", "ergodic", "magnet"} <= set(told)
    assert told["ergodic"].serves_densities and not told["direct"].serves_densities
    assert told["magnet"].about == "Everybody flies to one place." and told["magnet"].takes == "place"


@pytest.mark.parametrize(
    "form",
    [
        [],
        [[0.0, 0.0]],
        [[0.0, 0.0]] * 3 + [[0.0]],
        [[0.0, 2.0]] * 4,
        [["a", "b"]] * 4,
        {"shape": "ring"},
        {"0": [1, 2]},
    ],
)
def test_what_is_no_command_is_refused(form):
    with pytest.raises(CommandError, match="red's command"):
        read_form(form, system_of("direct"), GAME, "red's command")


def test_numbers_may_be_the_names_of_an_objects_parts(monkeypatch):
    asked = []
    monkeypatch.setattr(Magnet, "parse", lambda self, command, config, name: asked.append(command) or np.zeros(2))
    read_form({"0": [0.1, 0.2], "shape": 3, "99999": 1}, Magnet(), GAME, "a command")
    assert asked == [{0: [0.1, 0.2], "shape": 3, "99999": 1}]


def test_whatever_a_system_raises_about_a_command_is_an_error_of_the_command(monkeypatch):
    monkeypatch.setattr(Magnet, "parse", lambda *_: 1 / 0)
    with pytest.raises(CommandError, match="magnet: ZeroDivisionError"):
        read_form([0.5, 0.5], Magnet(), GAME, "a command")
    monkeypatch.setattr(Magnet, "parse", lambda *_: [np.nan, 0.0])
    with pytest.raises(CommandError, match="magnet made numbers"):
        read_form([0.5, 0.5], Magnet(), GAME, "a command")


def test_a_system_that_cannot_say_what_it_takes_is_an_error_of_the_room():
    with pytest.raises(ConfigError, match="unready does not say what it takes"):
        commands_of(Unready(), GAME)
