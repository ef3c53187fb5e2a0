"""Pictures of a game show each thing in its place and colour, and nothing of an earlier picture."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.config import GameConfig
from swarm_pz.errors import MissingExtraError
from swarm_pz.rendering.board import TEAM_COLOURS
from swarm_pz.rendering.painter import ARENA, HEADER, MARGIN, Painter, ansi, draw
from swarm_pz.simulator import Simulator


def begun(games=1, **rules):
    simulator = Simulator(GameConfig(**rules), num_games=games)
    simulator.reset(range(games))
    return simulator


def arena(picture):
    return picture[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA].astype(int)


def test_the_bottom_of_the_board_is_the_bottom_of_the_picture():
    simulator = Simulator(GameConfig(drones_per_team=1))
    simulator.reset([0], scenario={"positions": [[0.1, 0.2], [0.9, 0.8]], "teams": [0, 1]})
    picture = draw(simulator)
    assert picture.dtype == np.uint8
    for (x, y), colour in zip(((0.1, 0.2), (0.9, 0.8)), TEAM_COLOURS, strict=True):
        np.testing.assert_array_equal(arena(picture)[round((1 - y) * ARENA), round(x * ARENA)], colour)


def test_text_tells_drones_ground_and_crowds():
    ground = np.zeros((2, 2, 50, 50), bool)
    ground[1, 0, 11, 10:13] = ground[1, 1, 10, 12:15] = True  # two rows of cells are a line
    places = np.array([[0.51, 0.51]] * 12 + [[0.31, 0.91]] * 2 + [[1.0, 1.0], [0.01, 0.01]])
    teams = np.array([0] * 15 + [1])
    game = SimpleNamespace(
        captures_here=ground, positions=np.stack([places[::-1], places]), teams=np.stack([1 - teams, teams]),
        sizes=np.array([[1, 15], [15, 1]]), time_s=np.array([1.0, 2.0]),
    )  # fmt: skip
    lines = ansi(game, 1).splitlines()
    assert lines[0].split() == ["red", "15", "2.0", "s", "1", "blue"]
    canvas = lines[:0:-1]
    assert canvas[5] == "." * 10 + "##*++" + "." * 35
    assert (canvas[12][25], canvas[22][15], canvas[24][49], canvas[0][0]) == ("9", "2", "r", "b")
    assert sum(len(line) - line.count(".") for line in canvas) == 5 + 4


def test_a_missing_extra_says_which_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(MissingExtraError, match=r"pip install .*\[render\]"):
        draw(begun())


# --- targets ----------------------------------------------------------------------------------------------


def test_both_targets_are_outlined_where_they_are():
    simulator, painter = Simulator(GameConfig(drones_per_team=1)), Painter(targets=True)
    simulator.reset([0], scenario={"positions": [[0.02, 0.02], [0.98, 0.98]]})
    plain = arena(painter.draw(simulator))
    for team, corner in ((0, (0, 0)), (1, (9, 9))):
        density = np.zeros((10, 10))
        density[corner] = 1.0
        simulator.command(team, density[None])
    changed = arena(painter.draw(simulator)) - plain
    for part in (changed[300:, :300], changed[:300, 300:]):
        inked = part[(part != 0).any(axis=2)]
        assert 0.01 < len(inked) / 90_000 < 0.3
        assert inked[:, 0].mean() < inked[:, 1].mean() - 10, "green, as no team is"
    assert not changed[:300, :300].any() and not changed[300:, 300:].any()


@pytest.mark.parametrize("options", [{}, {"targets": True}])
def test_a_painter_draws_the_game_that_was_asked_for_as_it_is_and_nothing_of_an_earlier_picture(options):
    alone, many = begun(drones_per_team=(4, 2)), begun(2, drones_per_team=(4, 2))
    alone.reset([1])
    kept = Painter(**options)
    for team in (0, 1, 0):
        for simulator in (alone, many):
            simulator.command(team, np.array([np.ones((10, 10)), np.eye(10)[:: 1 - 2 * team]][-simulator.num_games :]))
            simulator.advance(20)
        picture = kept.draw(alone)
        np.testing.assert_array_equal(picture, Painter(**options).draw(alone))
        np.testing.assert_array_equal(picture, kept.draw(many, 1))
        assert (picture != kept.draw(many, 0)).any()


# --- screens of environments ------------------------------------------------------------------------------


def test_frames_are_those_of_the_last_step_and_of_the_game_that_was_begun_last():
    environment = parallel_env(render_mode="rgb_array_list", command_period=0.5, drones_per_team=2)
    actions = {agent: np.ones((10, 10)) for agent in environment.possible_agents}
    environment.reset(seed=0)
    assert len(environment.render()) == 1
    environment.step(actions)
    assert len(environment.render()) == 5
    for _ in range(3):
        environment.step(actions)
    assert len(environment.render()) == 6 and environment.render() == []
    environment.step(actions)
    environment.reset(seed=0)
    (first,) = environment.render()
    np.testing.assert_array_equal(first, draw(environment.unwrapped.batch.simulator))
    assert environment.metadata["render_fps"] == 10
    assert parallel_env(render_mode="rgb_array", command_period=0.5).metadata["render_fps"] == 2
