from __future__ import annotations

import contextlib
import copy
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.analysis.video import film_game, open_film
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.errors import MissingExtraError, OutputError, RenderError
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import Rollout, game_number
from swarm_pz.rendering import board
from swarm_pz.rendering.board import TEAM_COLOURS
from swarm_pz.rendering.overlays import Target
from swarm_pz.rendering.painter import ARENA, FILM, HEADER, MARGIN, Painter, Screen, ansi, draw
from swarm_pz.simulator import Simulator


@pytest.fixture
def corner_simulator():
    """One red drone near the bottom left and one blue near the top right."""
    from swarm_pz.config import GameConfig

    simulator = Simulator(GameConfig(drones_per_team=1))
    simulator.reset([0], scenario={"positions": [[0.1, 0.2], [0.9, 0.8]], "teams": [0, 1]})
    return simulator


def test_the_bottom_of_the_board_is_the_bottom_of_the_picture(corner_simulator):
    picture = draw(corner_simulator)
    assert picture.dtype == np.uint8
    for (x, y), colour in zip(((0.1, 0.2), (0.9, 0.8)), TEAM_COLOURS, strict=True):
        pixel = picture[round(HEADER + (1 - y) * ARENA), round(MARGIN + x * ARENA)]
        np.testing.assert_array_equal(pixel, colour)


def test_text_shows_drones_where_they_are(corner_simulator):
    lines = ansi(corner_simulator).splitlines()
    assert lines[0].split() == ["red", "1", "0.0", "s", "1", "blue"]
    assert lines[1 + 24 - 5][5] == "r"
    assert lines[1 + 24 - 20][45] == "b"


def test_ground_where_a_team_captures_is_dark():
    simulator = Simulator()
    simulator.reset([1])
    simulator.advance(60)
    ground = simulator.captures_here[0, 0]
    picture = draw(simulator)
    for row, column in np.argwhere(ground):
        y = round(HEADER + (1 - (row + 0.5) / 50) * ARENA)
        x = round(MARGIN + (column + 0.5) / 50 * ARENA)
        assert picture[y - 2 : y + 3, x - 2 : x + 3].mean() < 200
    assert picture.mean() > 200


def test_a_list_holds_the_frames_of_a_step():
    environment = parallel_env(render_mode="rgb_array_list", command_period=0.5)
    environment.reset(seed=0)
    assert len(environment.render()) == 1
    environment.step({agent: np.ones((10, 10)) for agent in environment.agents})
    assert len(environment.render()) == 5
    assert environment.metadata["render_fps"] == 10
    assert parallel_env(render_mode="rgb_array", command_period=0.5).metadata["render_fps"] == 2


def test_without_a_display_human_says_so_and_does_not_hang():
    code = "from swarm_pz import parallel_env; parallel_env(render_mode='human')"
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "SDL_VIDEODRIVER")}
    environment.pop("WAYLAND_DISPLAY", None)
    result = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=60, check=False
    )
    assert "RenderError: render_mode='human' needs a display" in result.stderr


def test_a_missing_extra_says_which_to_install(monkeypatch, corner_simulator):
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    with pytest.raises(MissingExtraError, match=r"pip install .*\[render\]"):
        draw(corner_simulator)


@pytest.mark.parametrize("suffix", ["gif", "mp4"])
def test_films_are_written(tmp_path, suffix):
    import imageio.v2 as imageio

    path = tmp_path / "films" / f"game.{suffix}"
    standing = film_game("ring", "uniform", path, seconds=2)
    assert "red" in standing
    assert imageio.get_reader(path).get_data(0).ndim == 3


def test_the_legend_explains_every_sign_of_both_teams(monkeypatch):
    """Trails and drones were not in it."""
    written = []
    monkeypatch.setattr(board.Canvas, "write", lambda _, text, *__: written.append(text))
    Painter(targets=True, layout=FILM)
    assert written == [
        sign
        for team in ("red", "blue")
        for sign in (f"{team} drone", "its trail", f"{team}'s target", f"{team} captures")
    ]


def test_a_still_shows_the_board_at_its_moment(tmp_path):
    from PIL import Image

    path = tmp_path / "stills" / "game.png"
    assert "(1.5 s" in film_game("ring", "uniform", path, seconds=1.5)
    with Image.open(path) as picture:
        height, width, _ = draw(Simulator()).shape
        assert picture.width == width and picture.height > height  # by a legend
    end = film_game("ring", "uniform", path, config=GameConfig(time_limit=2.0))
    assert end.startswith("a draw (2.0 s")


def test_a_still_is_of_the_moment_that_its_words_tell(tmp_path):
    path, drawn = tmp_path / "game.png", {}
    said = film_game("ring", "uniform", path, seconds=1.5)
    game, painter = Rollout("ring", "uniform", [0]), Painter(("ring", "uniform"), targets=True)

    def look(game):
        drawn[game.standing()] = painter.draw(game.simulator)

    game.play(1.5, after_control_period=look)
    still = picture_of(path)
    assert [standing for standing, picture in drawn.items() if np.array_equal(picture, still)] == [said]


def test_the_game_shown_is_the_one_that_a_match_counted(tmp_path):
    config = GameConfig(time_limit=20.0, drones_per_team=3)
    counted = play_match("blind_ring", "noise", games=6, seed=3, config=config).games[5]
    options = {"seed": 3, "pair": 2, "side": "blue", "config": config}
    said = film_game("blind_ring", "noise", tmp_path / "end.png", **options)
    ends = {"win": "blue won", "draw": "a draw", "loss": "red won"}
    red = counted.sizes[-1]
    assert said == f"{ends[counted.outcome]} ({counted.seconds:.1f} s, red {red}, blue {6 - red})"
    game = Rollout("blind_ring", "noise", [5], seed=3, config=config)
    game.play()
    end = Painter(("noise", "blind_ring"), targets=True).draw(game.simulator)
    np.testing.assert_array_equal(picture_of(tmp_path / "end.png"), end)
    assert game.games() == [counted]


def test_animations_keep_the_colours_of_the_teams(tmp_path):
    import imageio.v2 as imageio

    path = tmp_path / "game.gif"
    film_game("uniform", "uniform", path, config=GameConfig(drones_per_team=(2, 18)), seconds=10)
    with imageio.get_reader(path) as reader:
        *_, last = iter(reader)
    for colour in TEAM_COLOURS:
        assert np.abs(last[..., :3].astype(int) - colour).max(axis=2).min() <= 24


@pytest.mark.parametrize("options", [{"speed": 0.0}, {"speed": float("nan")}, {"seconds": -1.0}])
def test_films_of_no_length_are_refused(tmp_path, options):
    with pytest.raises(RenderError, match="must be a number above 0"):
        film_game("ring", "uniform", tmp_path / "game.mp4", **options)


def test_films_of_unknown_formats_are_refused(tmp_path):
    with pytest.raises(RenderError, match=r"must end in .gif or .mp4"):
        film_game("ring", "uniform", tmp_path / "game.avi")


def picture_of(path):
    import imageio.v3 as imageio

    return imageio.imread(path)


def test_both_players_are_named_in_the_picture(tmp_path):
    game = {"seconds": 1, "config": GameConfig(drones_per_team=1)}
    film_game("ring", "uniform", tmp_path / "one.png", **game)
    film_game("halo", "uniform", tmp_path / "other.png", **game)
    one, other = picture_of(tmp_path / "one.png"), picture_of(tmp_path / "other.png")
    differs = (one != other)[: HEADER - 20].any(axis=(0, 2))
    assert differs[: ARENA // 2].any() and not differs[ARENA // 2 :].any()


def test_a_long_name_is_cut_and_leaves_room_for_the_rest():
    simulator = Simulator(GameConfig(drones_per_team=1))
    long, longer = (Painter(("x" * length, "y" * length), layout=FILM).draw(simulator) for length in (90, 99))
    np.testing.assert_array_equal(long, longer)


def test_both_targets_are_seen_as_lines_in_their_teams_colours():
    simulator = Simulator(GameConfig(drones_per_team=1))
    simulator.reset([0], scenario={"positions": [[0.02, 0.02], [0.98, 0.98]]})
    painter = Painter(targets=True)
    plain = painter.draw(simulator).astype(int)
    places = {0: (slice(300, 600), slice(0, 300)), 1: (slice(0, 300), slice(300, 600))}
    for team, corner in ((0, (0, 0)), (1, (9, 9))):
        density = np.zeros((10, 10))
        density[corner] = 1.0
        simulator.command(team, density[None])
    picture = painter.draw(simulator).astype(int)
    for team, (rows, columns) in places.items():
        change = (picture - plain)[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA][rows, columns]
        lines = change[(change != 0).any(axis=2)]
        assert 0.01 < len(lines) / 90_000 < 0.3
        assert lines[:, 2 if team == 0 else 0].mean() < lines[:, 0 if team == 0 else 2].mean() - 20
        assert lines.min() > -200  # light, so that drones and trails stand out


@pytest.mark.parametrize("team", [0, 1])
def test_a_painter_draws_what_is_in_force_not_what_was(team):
    simulator = Simulator()
    simulator.reset([0])
    kept = Painter(targets=True)
    kept.draw(simulator)
    simulator.command(team, np.eye(10)[None])
    np.testing.assert_array_equal(kept.draw(simulator), Painter(targets=True).draw(simulator))


@pytest.mark.parametrize("suffix", ["gif", "mp4", "png"])
def test_a_film_that_fails_leaves_nothing_and_keeps_the_last_one(tmp_path, suffix):
    path = tmp_path / f"game.{suffix}"
    path.write_text("the last one")

    def stop(shown, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film_game("ring", "uniform", path, seconds=3, progress=stop)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "the last one"


def test_a_film_that_cannot_be_encoded_says_so_and_leaves_nothing(tmp_path):
    def odd():
        with open_film(tmp_path / "a.mp4", 20.0, (3, 3)) as append:
            for _ in range(10_000):
                append(np.zeros((3, 3, 3), np.uint8))

    with pytest.raises(RenderError, match=r"(?s)a.mp4' could not be encoded.*not divisible by 2"):
        odd()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", ["mp4", "gif"])
def test_a_film_has_a_picture_for_every_moment(tmp_path, suffix):
    import imageio_ffmpeg

    path = tmp_path / f"game.{suffix}"
    film_game("ring", "noise", path, seconds=2)
    assert imageio_ffmpeg.count_frames_and_secs(path)[0] == 21


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 5.0, 10.0])
def test_a_film_runs_as_fast_as_it_was_asked_to(tmp_path, speed):
    import imageio_ffmpeg

    path = tmp_path / "game.mp4"
    config = GameConfig(drones_per_team=1, capture=CaptureConfig(enabled=False))
    film_game("ring", "uniform", path, seconds=2, speed=speed, config=config)
    pictures, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert seconds * (pictures - 1) / pictures == pytest.approx(2 / speed, abs=0.02)
    assert pictures == 21 if speed <= 2.0 else 15 < pictures / seconds < 27  # all that there are, or about 20 a second


@pytest.mark.parametrize(
    ("game", "seconds", "end"),
    [
        (GameConfig(drones_per_team=2, time_limit=2.0), None, "a draw"),
        (GameConfig(drones_per_team=(19, 1), capture=CaptureConfig(threshold=0.5)), None, "won"),
        (GameConfig(drones_per_team=2), 2.0, "unfinished"),
    ],
)
def test_the_last_picture_is_in_the_film_however_many_are_left_out(tmp_path, monkeypatch, game, seconds, end):
    pictures = []

    @contextlib.contextmanager
    def kept(path, rate, size):
        yield pictures.append

    monkeypatch.setattr("swarm_pz.analysis.video.open_film", kept)
    standing = film_game("uniform", "uniform", tmp_path / "a.mp4", speed=1e6, config=game, seconds=seconds)
    assert end in standing
    played = Rollout("uniform", "uniform", [game_number(0)], config=game)
    painter = Painter(("uniform", "uniform"), targets=True, layout=FILM)
    first = painter.draw(played.simulator)
    played.play(seconds)
    np.testing.assert_array_equal(pictures, [first, painter.draw(played.simulator)])


def test_how_far_a_film_is_can_be_shown(tmp_path):
    seen = []
    film_game("ring", "uniform", tmp_path / "a.mp4", seconds=2, progress=lambda *now: seen.append(now))
    assert seen == [(1.0, 2), (2.0, 2)]


def test_a_film_into_a_folder_is_refused_before_the_game_is_played(tmp_path):
    (tmp_path / "a.mp4").mkdir()
    with pytest.raises(OutputError, match="expected the name of a file to write, got the folder"):
        film_game("ring", "uniform", tmp_path / "a.mp4", seconds=1)


@pytest.mark.parametrize("paint", [board.paint_captures, board.paint_fields])
def test_the_ground_of_a_team_is_in_its_colour(paint):
    simulator = Simulator(GameConfig(drones_per_team=(12, 6)))
    simulator.reset([1])
    simulator.advance(60)
    arena = board.blank(600, 600)
    paint(arena, simulator, 0, 600)
    picture = arena.array().astype(int)[::-1]
    redder = (picture[..., 0] - picture[..., 2]).reshape(50, 12, 50, 12).mean(axis=(1, 3))
    red, blue = simulator.captures_here[0]
    assert (red & ~blue).any() and (blue & ~red).any()
    assert redder[red & ~blue].min() > 3
    assert redder[blue & ~red].max() < -3


def test_a_game_of_many_is_drawn_as_if_it_was_alone():
    alone, many = Simulator(), Simulator(num_games=2)
    alone.reset([5])
    many.reset([4, 5])
    for simulator, targets in ((alone, [np.eye(10)]), (many, [np.ones((10, 10)), np.eye(10)])):
        simulator.command(0, np.array(targets))
        simulator.advance(60)
    for painter in (Painter(), Painter(targets=True)):
        picture = painter.draw(alone)
        assert (painter.draw(many, 0) != picture).any()
        np.testing.assert_array_equal(painter.draw(many, 1), picture)


@pytest.mark.parametrize("options", [{}, {"targets": True}])
def test_nothing_of_an_earlier_picture_is_left_in_a_later_one(options):
    simulator = Simulator(GameConfig(drones_per_team=(4, 2)))
    simulator.reset([0])
    kept = Painter(**options)
    for _ in range(3):
        simulator.advance(20)
        np.testing.assert_array_equal(kept.draw(simulator), Painter(**options).draw(simulator))


def test_the_bar_and_the_numbers_above_the_board_are_each_teams_own():
    simulator = Simulator(GameConfig(drones_per_team=(3, 9)))
    simulator.reset([0])
    picture = Painter(("one", "two")).draw(simulator)
    bar = picture[HEADER - 14, MARGIN : MARGIN + ARENA]
    np.testing.assert_array_equal(bar[: ARENA // 4], np.tile(TEAM_COLOURS[0], (ARENA // 4, 1)))
    np.testing.assert_array_equal(bar[ARENA // 4 :], np.tile(TEAM_COLOURS[1], (3 * ARENA // 4, 1)))
    left, right = picture[: HEADER - 20, : MARGIN + ARENA // 2 - 60], picture[: HEADER - 20, MARGIN + ARENA // 2 + 60 :]
    for names, sizes, changed in (
        (("one", "other"), (3, 9), right), (("other", "two"), (3, 9), left), (("one", "two"), (3, 8), right),
        (("one", "two"), (4, 9), left),
    ):  # fmt: skip
        another = Simulator(GameConfig(drones_per_team=sizes))
        another.reset([0])
        drawn = Painter(names).draw(another)
        same = right if changed is left else left
        where = slice(None, MARGIN + ARENA // 2 - 60), slice(MARGIN + ARENA // 2 + 60, None)
        now_left, now_right = (drawn[: HEADER - 20, columns] for columns in where)
        assert ((now_left != left).any(), (now_right != right).any()) == (same is not left, same is not right)


def test_the_legend_has_a_line_for_each_team_in_its_colour():
    picture = Painter(targets=True).draw(Simulator(GameConfig(drones_per_team=1))).astype(int)
    for team, redder in enumerate(np.split((picture[..., 0] - picture[..., 2])[HEADER + ARENA + 8 :][:44], 2)):
        signs = [redder[:, MARGIN + column * ARENA // 4 :][:, :24] * (-1) ** team for column in range(4)]
        assert all(sign.max() > 30 and sign.min() > -10 for sign in signs)


def test_text_tells_ground_and_crowds():
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


def test_frames_are_of_the_game_that_was_begun_last_and_never_more_than_a_steps():
    environment = parallel_env(render_mode="rgb_array_list", command_period=0.5, drones_per_team=2)
    environment.reset(seed=0)
    for _ in range(3):
        environment.step({agent: np.ones((10, 10)) for agent in environment.agents})
    assert len(environment.render()) == 6
    assert environment.render() == []
    environment.step({agent: np.ones((10, 10)) for agent in environment.agents})
    environment.reset(seed=0)
    (first,) = environment.render()
    np.testing.assert_array_equal(first, draw(environment.unwrapped.batch.simulator))


def test_a_screen_shows_its_own_row_and_its_copy_has_a_window_of_its_own_unless_it_is_closed():
    simulator = Simulator(GameConfig(drones_per_team=2), num_games=2)
    simulator.reset([0, 1])
    frames = Screen("rgb_array_list", simulator, row=1)
    frames.begin()
    np.testing.assert_array_equal(frames.render()[0], draw(simulator, 1))
    np.testing.assert_array_equal(Screen("rgb_array", simulator, 1).render(), draw(simulator, 1))
    assert Screen("ansi", simulator, 1).render() == ansi(simulator, 1) != ansi(simulator, 0)
    assert Screen("human", simulator).metadata["render_fps"] == 10

    opened = []

    class Window:
        def __init__(self, title, rate):
            opened.append(self)
            self.is_closed, self.rate = False, rate

        def close(self):
            self.is_closed = True

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("swarm_pz.rendering.window.Window", Window)
        screen = Screen("human", simulator)
        twin = copy.deepcopy(screen)
        assert len(opened) == 2 and [window.rate for window in opened] == [10, 10]
        screen.close()
        assert [window.is_closed for window in opened] == [True, False]
        copy.deepcopy(screen)
        assert len(opened) == 2
        twin.close()
        assert opened[1].is_closed


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
    simulator = Simulator(GameConfig(drones_per_team=1))
    picture = draw(simulator, overlays=[Flood(colours[1 - highest]), Flood(colours[highest])])
    assert (picture[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA] == colours[highest]).all(axis=2).mean() > 0.9


def test_targets_are_drawn_as_densities_whatever_their_mass_is_to_the_controller():
    pictures = []
    for mass in (1.0, 10.0):
        simulator = Simulator(GameConfig(controller=ControllerConfig(target_mass=mass)))
        simulator.reset([0])
        simulator.command(0, np.eye(10)[None])
        painters = Painter(targets=True), Painter(overlays=[Target(0)])
        pictures.append([painter.draw(simulator).astype(int) for painter in painters])
    for plain, weighed in zip(*pictures, strict=True):
        assert np.abs(plain - weighed).mean() < 0.01
