"""Commands of any kind: read, followed, held and drawn."""

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.game import InForce, LiveGame, TableConfig

GAME = GameConfig(drones_per_team=2, controllers=("direct", "ergodic"), capture=CaptureConfig(enabled=False))
TABLE = TableConfig(game=GAME)
PUSH = [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.0, 0.0]]


def test_a_command_of_another_kind_is_flown():
    game = LiveGame(TABLE, seed=0)
    start = game.simulator.positions[0].copy()
    command = game.submit(RED, 1, PUSH, "accelerations")
    assert [event.command for event in game.advance(30) if isinstance(event, InForce)] == [command]
    moved = game.simulator.positions[0] - start
    assert (moved[0, 0] > 0.05 and moved[1, 0] < 0.0) or moved[1, 0] == 0.0  # it may be at a wall
    assert moved[0, 1] == 0.0


@pytest.mark.parametrize(
    ("given", "kind", "told"),
    [
        (np.ones((10, 10)), "density", "'density' cannot fly direct, which takes those of kind 'accelerations'"),
        (PUSH, "places", "'places' cannot fly direct"),
        (PUSH[:3], "accelerations", "shape"),
        ([[np.nan, 0.0]] * 4, "accelerations", "nan"),
    ],
)
def test_what_cannot_fly_a_team_is_refused_and_changes_nothing(given, kind, told):
    game = LiveGame(TABLE, seed=0)
    game.submit(RED, 1, PUSH, "accelerations")
    with pytest.raises(CommandError, match=told):
        game.submit(RED, 2, given, kind)
    (event,) = game.advance(1)
    assert event.command.number == 1


def test_who_asks_at_every_step_for_the_same_holds_it():
    game = LiveGame(TABLE, seed=0)
    push, other = (game.reader.read(RED, 1, given, "accelerations") for given in (PUSH, PUSH[::-1]))
    assert not game.holds(push)
    game.hand_in(push)
    assert game.holds(push) and not game.holds(other)
    game.advance(1)
    assert game.holds(push) and not game.holds(other)


def test_a_policys_answer_has_the_kind_that_its_team_takes():
    reader = CommandReader(GAME)
    packed = reader.packed(reader.read(RED, 1, PUSH, "accelerations"))[0]
    answer = reader.answered(RED, 3, packed, "auto:push")
    np.testing.assert_array_equal(answer.values, PUSH)
    assert (answer.kind, answer.number, answer.sender) == ("accelerations", 3, "auto:push")
    image = np.linspace(0.0, 0.5, 100).reshape(10, 10)
    packed = reader.packed(reader.read(1, 1, image))[0]
    assert reader.answered(1, 1, packed).kind == "density"
    np.testing.assert_array_equal(reader.answered(1, 1, packed).values, np.round(2 * image, 8))


def test_what_has_no_picture_asks_for_the_whole_square():
    reader = CommandReader(GAME)
    np.testing.assert_array_equal(reader.picture(reader.read(RED, 1, PUSH, "accelerations")), np.ones((10, 10)))


def test_a_picture_is_drawn_by_the_system_of_the_commands_team():
    reader = CommandReader(GAME.replace(controllers=("direct", "flocking")))
    drawn = reader.picture(reader.read(BLUE, 1, [0.95, 0.05, 60.0], "attractors"))
    assert np.argwhere(drawn).tolist() == [[0, 9]]


def test_who_solves_ahead_plays_the_same_game():
    plain, ahead = LiveGame(TABLE, seed=0), LiveGame(TABLE, seed=0)
    for game in (plain, ahead):
        game.submit(RED, 1, PUSH, "accelerations")
    plain.advance(30)
    for tick in range(30):
        begun = ahead.begin_period()
        assert (len(begun), ahead.is_at_solve) == (tick == 0, tick % 3 == 0)
        if ahead.is_at_solve:
            ahead.simulator.solve(RED)
        assert not [event for event in ahead.advance() if isinstance(event, InForce)]
    np.testing.assert_array_equal(plain.simulator.positions, ahead.simulator.positions)
