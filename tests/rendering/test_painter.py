"""Pictures of a game: what is where, whose it is, and that nothing is left of another picture."""

from __future__ import annotations

import copy
import sys
from types import SimpleNamespace

import imageio.v2 as imageio
import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.analysis.video import film_game
from swarm_pz.config import ControllerConfig, GameConfig
from swarm_pz.errors import ConfigError, MissingExtraError
from swarm_pz.rendering.board import TEAM_COLOURS
from swarm_pz.rendering.overlays import Target
from swarm_pz.rendering.painter import ARENA, FILM, HEADER, MARGIN, Painter, Screen, ansi, draw
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


# --- what stands around the board -------------------------------------------------------------------------


def test_the_bar_and_the_name_and_number_above_the_board_are_each_teams_own():
    def head(names, sizes):
        picture = Painter(names).draw(begun(drones_per_team=sizes))
        bar, words = picture[HEADER - 14, MARGIN : MARGIN + ARENA], picture[: HEADER - 20]
        return bar, words[:, : MARGIN + ARENA // 2 - 60], words[:, MARGIN + ARENA // 2 + 60 :]

    bar, left, right = head(("one", "two"), (3, 9))
    np.testing.assert_array_equal(bar[: ARENA // 4], np.tile(TEAM_COLOURS[0], (ARENA // 4, 1)))
    np.testing.assert_array_equal(bar[ARENA // 4 :], np.tile(TEAM_COLOURS[1], (3 * ARENA // 4, 1)))
    for names, sizes, changed in (
        (("one", "other"), (3, 9), (False, True)),
        (("other", "two"), (3, 9), (True, False)),
        (("one", "two"), (3, 8), (False, True)),
        (("one", "two"), (4, 9), (True, False)),
    ):
        _, now_left, now_right = head(names, sizes)
        assert ((now_left != left).any(), (now_right != right).any()) == changed


def test_a_long_name_is_cut_and_leaves_room_for_the_rest():
    simulator = begun(drones_per_team=1)
    long, longer = (Painter(("x" * length, "y" * length), layout=FILM).draw(simulator) for length in (90, 99))
    np.testing.assert_array_equal(long, longer)


def test_the_legend_has_a_line_of_four_signs_for_each_team_in_its_colour():
    """Trails and drones were not in it."""
    picture = Painter(targets=True).draw(begun(drones_per_team=1)).astype(int)
    for team, line in enumerate(np.split(picture[HEADER + ARENA + 8 :][:44], 2)):
        drone, trail, target, ground = (line[:, MARGIN + column * ARENA // 4 :][:, :24] for column in range(4))
        for sign in (drone, trail, ground):
            redder = (sign[..., 0] - sign[..., 2]) * (-1) ** team
            assert redder.max() > 30 and redder.min() > -10
        assert (target[..., 1] - target[..., 0]).max() > 30


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


def test_targets_are_drawn_as_densities_whatever_their_mass_is_to_the_controller():
    pictures = []
    for mass in (1.0, 10.0):
        simulator = begun(controller=ControllerConfig(target_mass=mass))
        simulator.command(0, np.eye(10)[None])
        painters = Painter(targets=True), Painter(overlays=[Target(0)])
        pictures.append([painter.draw(simulator).astype(int) for painter in painters])
    for plain, weighed in zip(*pictures, strict=True):
        assert np.abs(plain - weighed).mean() < 0.01


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


def test_animations_keep_the_colours_of_the_teams(tmp_path):
    path = tmp_path / "game.gif"
    film_game("uniform", "uniform", path, config=GameConfig(drones_per_team=(2, 18)), seconds=3)
    with imageio.get_reader(path) as reader:
        *_, last = iter(reader)
    for colour in TEAM_COLOURS:
        assert np.abs(last[..., :3].astype(int) - colour).max(axis=2).min() <= 24


@pytest.mark.parametrize("highest", [0, 1])
def test_the_last_overlay_is_the_highest(highest):
    class Flood:
        def __init__(self, colour):
            self.colour = colour

        def paint(self, arena, simulator, row, side):
            arena.fill(self.colour, (0, 0, side, side))

        def explain(self, picture, x, y):
            pass

    colours = [(1, 2, 3), (200, 100, 50)]
    picture = draw(begun(drones_per_team=1), overlays=[Flood(colours[1 - highest]), Flood(colours[highest])])
    assert (arena(picture) == colours[highest]).all(axis=2).mean() > 0.9


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


def test_a_screen_shows_its_own_row_and_its_copy_has_a_window_of_its_own_unless_it_is_closed(monkeypatch):
    simulator, opened = begun(2, drones_per_team=2), []
    frames = Screen("rgb_array_list", simulator, row=1)
    frames.begin()
    for picture in (frames.render()[0], Screen("rgb_array", simulator, 1).render()):
        np.testing.assert_array_equal(picture, draw(simulator, 1))
    assert Screen("ansi", simulator, 1).render() == ansi(simulator, 1) != ansi(simulator, 0)
    with pytest.raises(ConfigError, match="did you mean 'human'"):
        Screen("humann", simulator)

    class Window:
        def __init__(self, title, rate):
            opened.append(self)
            self.is_closed, self.rate, self.shown = False, rate, []

        def show(self, frame):
            self.shown.append(frame)

        def refresh(self):
            self.shown.append("refreshed")

        def close(self):
            self.is_closed = True

    monkeypatch.setattr("swarm_pz.rendering.window.Window", Window)
    screen = Screen("human", simulator)
    screen.begin()
    assert screen.render() is None
    np.testing.assert_array_equal(opened[0].shown[0], draw(simulator))
    assert opened[0].shown[1:] == ["refreshed"]
    twin = copy.deepcopy(screen)
    assert [window.rate for window in opened] == [10, 10]
    screen.close()
    assert [window.is_closed for window in opened] == [True, False]
    copy.deepcopy(screen)
    assert len(opened) == 2
    twin.close()
    assert opened[1].is_closed
