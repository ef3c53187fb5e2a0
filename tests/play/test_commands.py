"""Commands of any kind: how they are described to clients, read, flown and drawn."""

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.forms import commands_of, read_form
from swarm_pz.play.game import InForce, LiveGame, TableConfig
from tests.play.systems import Magnet, Unready

GAME = GameConfig(drones_per_team=2, controllers=("direct", "ergodic"), capture=CaptureConfig(enabled=False))
PUSH = [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.0, 0.0]]


def live():
    return LiveGame(TableConfig(game=GAME), seed=0)


# --- forms ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(registered()))
def test_what_a_client_is_told_of_a_system_is_a_command_of_it(name):
    system = system_of(name)
    spec = commands_of(system, GAME)
    assert (spec.system, spec.takes, spec.shape) == (name, system.takes, list(system.space(GAME).shape))
    default = read_form(spec.default, system, GAME, "the default")
    np.testing.assert_array_equal(default, system.default(GAME))
    shape, (low, high) = default.shape, (np.asarray(one, float) for one in (spec.low, spec.high))
    assert low.shape in ((), shape) and (low <= default + 1e-6).all() and (default <= high + 1e-6).all()


@pytest.mark.parametrize("form", [[], [[0.0, 0.0]] * 3 + [[0.0]], [[0.0, 2.0]] * 4, [["a", "b"]] * 4, {"0": [1, 2]}])
def test_what_is_no_command_is_refused(form):
    with pytest.raises(CommandError, match="red's command"):
        read_form(form, system_of("direct"), GAME, "red's command")


def test_whatever_a_system_of_others_does_with_a_command_is_an_error_of_the_command(monkeypatch):
    parsed = []
    monkeypatch.setattr(Magnet, "parse", lambda self, command, config, name: parsed.append(command) or np.zeros(2))
    read_form({"0": [0.1, 0.2], "shape": 3, "99999": 1}, Magnet(), GAME, "a command")
    assert parsed == [{0: [0.1, 0.2], "shape": 3, "99999": 1}], "JSON has no numbers as keys"
    for answer, reason in ((lambda *_: 1 / 0, "ZeroDivisionError"), (lambda *_: [np.nan, 0.0], "all finite")):
        monkeypatch.setattr(Magnet, "parse", answer)
        with pytest.raises(CommandError, match=f"magnet.*{reason}"):
            read_form([0.5, 0.5], Magnet(), GAME, "a command")
    with pytest.raises(ConfigError, match="unready does not say"):
        commands_of(Unready(), GAME)


# --- commands -------------------------------------------------------------------------------------


def test_a_command_of_another_kind_is_flown_and_who_solves_ahead_plays_the_same_game():
    plain, ahead = live(), live()
    start = plain.simulator.positions[0].copy()
    command = plain.submit(RED, 1, PUSH, "accelerations")
    ahead.submit(RED, 1, PUSH, "accelerations")
    assert [event.command for event in plain.advance(30) if isinstance(event, InForce)] == [command]
    moved = plain.simulator.positions[0] - start
    assert (moved[0, 0] > 0.05 and moved[1, 0] < 0.0) or moved[1, 0] == 0.0  # it may be at a wall
    assert moved[0, 1] == 0.0
    for tick in range(30):
        begun = ahead.begin_period()
        assert (len(begun), ahead.is_at_solve) == (tick == 0, tick % 3 == 0)
        if ahead.is_at_solve:
            ahead.simulator.solve(RED)
        assert not [event for event in ahead.advance() if isinstance(event, InForce)]
    np.testing.assert_array_equal(plain.simulator.positions, ahead.simulator.positions)


@pytest.mark.parametrize(
    ("given", "kind", "told"),
    [
        (np.ones((10, 10)), "density", "accelerations"),
        (PUSH, "places", "places"),
    ],
)
def test_what_cannot_fly_a_team_is_refused_and_changes_nothing(given, kind, told):
    game = live()
    game.submit(RED, 1, PUSH, "accelerations")
    with pytest.raises(CommandError, match=told):
        game.submit(RED, 2, given, kind)
    (event,) = game.advance(1)
    assert event.command.number == 1


def test_a_policys_answer_has_the_kind_that_its_team_takes():
    reader = CommandReader(GAME)
    answer = reader.answered(RED, 3, reader.packed(reader.read(RED, 1, PUSH, "accelerations"))[0])
    np.testing.assert_array_equal(answer.values, PUSH)
    assert (answer.kind, answer.number) == ("accelerations", 3)
    image = np.linspace(0.0, 0.5, 100).reshape(10, 10)
    density = reader.answered(BLUE, 1, reader.packed(reader.read(BLUE, 1, image))[0] / 3.0)
    assert density.kind == "density"
    np.testing.assert_array_equal(density.values, np.round(2 * image, 8))


def test_a_picture_is_drawn_by_the_system_of_the_commands_team_and_without_one_is_the_whole_square():
    reader = CommandReader(GAME.replace(controllers=("direct", "flocking")))
    np.testing.assert_array_equal(reader.picture(reader.read(RED, 1, PUSH, "accelerations")), np.ones((10, 10)))
    drawn = reader.picture(reader.read(BLUE, 1, [0.95, 0.05, 60.0], "attractors"))
    assert np.argwhere(drawn).tolist() == [[0, 9]]
