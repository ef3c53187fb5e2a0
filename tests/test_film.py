"""Films and stills show the requested game, at its rate and to its end; one that fails leaves no file."""

from __future__ import annotations

import contextlib
import resource
import sys

import imageio.v3 as imageio
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import OutputError, RenderError
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.film import film_game, open_film
from swarm_pz.rendering.overlays import make_overlays
from swarm_pz.rendering.painter import FILM, PICTURE, Painter

GAME = GameConfig(drones_per_team=2, time_limit=2.0)
OVERLAYS = make_overlays(["target", "captures"], [0, 1])


@pytest.fixture
def pictures(monkeypatch):
    """Collect the size of each film and then its pictures, instead of encoding them."""
    kept = []

    @contextlib.contextmanager
    def keep(path, rate, size):
        kept.append(size)
        yield kept.append

    monkeypatch.setattr("swarm_pz.film.open_film", keep)
    return kept


@pytest.mark.parametrize("suffix", ["gif", "mp4"])
def test_a_film_is_written_with_a_picture_for_every_moment(tmp_path, suffix):
    path = tmp_path / "films" / f"game.{suffix}"
    assert "red" in film_game("ring", "noise", path, config=GAME)
    assert imageio_ffmpeg.count_frames_and_secs(path)[0] == 21 + 20, "a second shows the end"


def test_a_webp_moves(tmp_path):
    film_game("ring", "noise", tmp_path / "game.webp", config=GAME, seconds=0.5)
    with Image.open(tmp_path / "game.webp") as film:
        assert film.n_frames > 2


@pytest.mark.parametrize("speed", [0.5, 2.0, 10.0])
def test_a_film_runs_as_fast_as_it_was_asked_to(tmp_path, speed):
    path, config = tmp_path / "game.mp4", GameConfig(drones_per_team=1, capture=CaptureConfig(enabled=False))
    film_game("ring", "uniform", path, seconds=2, speed=speed, config=config)
    shown, seconds = imageio_ffmpeg.count_frames_and_secs(path)
    assert seconds * (shown - 1) / shown == pytest.approx(2 / speed, abs=0.02)
    assert shown == 21 if speed <= 2.0 else 15 < shown / seconds < 27  # all pictures, or about 20 a second


@pytest.mark.parametrize(
    ("game", "seconds", "end"),
    [
        (GAME, None, "a draw"),
        (GameConfig(drones_per_team=(19, 1), capture=CaptureConfig(threshold=0.5)), None, "red won"),
        (GameConfig(drones_per_team=2), 2.0, "unfinished"),
    ],
)
def test_the_last_picture_is_in_the_film_however_many_are_left_out(tmp_path, pictures, game, seconds, end):
    assert end in film_game("uniform", "uniform", tmp_path / "a.mp4", speed=1e6, config=game, seconds=seconds)
    played = Rollout("uniform", "uniform", [0], config=game)
    painter = Painter(("uniform", "uniform"), targets=True, layout=FILM)
    first = painter.draw(played.simulator)
    played.play(seconds)
    winner = {"a draw": "draw", "red won": "red"}.get(end)
    last = painter.draw(played.simulator, winner=winner)
    assert (last != painter.draw(played.simulator)).any() == (winner is not None)
    np.testing.assert_array_equal(pictures[1:], [first, *[last] * (20 if winner else 1)])


def test_overlays_are_in_films_and_in_stills(tmp_path, pictures):
    for name in ("a.png", "a.mp4"):
        film_game("ring", "uniform", tmp_path / name, speed=1e6, config=GAME, overlays=OVERLAYS)
    game = Rollout("ring", "uniform", [0], config=GAME)
    painter = Painter(("ring", "uniform"), overlays=OVERLAYS, layout=PICTURE)
    assert pictures[0] == painter.size
    np.testing.assert_array_equal(pictures[1], painter.draw(game.simulator))
    game.play()
    np.testing.assert_array_equal(pictures[-1], painter.draw(game.simulator, winner="draw"))
    np.testing.assert_array_equal(imageio.imread(tmp_path / "a.png"), painter.draw(game.simulator))


def test_the_game_shown_is_the_one_that_a_match_counted(tmp_path):
    config = GameConfig(time_limit=20.0, drones_per_team=3)
    counted = play_match("blind_ring", "noise", games=6, seed=3, config=config).games[5]
    caption = film_game("blind_ring", "noise", tmp_path / "end.png", seed=3, pair=2, side="blue", config=config)
    ends, red = {"win": "blue won", "draw": "a draw", "loss": "red won"}, counted.sizes[-1]
    assert caption == f"{ends[counted.outcome]} ({counted.seconds:.1f} s, red {red}, blue {6 - red})"
    game = Rollout("blind_ring", "noise", [5], seed=3, config=config)
    game.play()
    end = Painter(("noise", "blind_ring"), targets=True).draw(game.simulator)
    np.testing.assert_array_equal(imageio.imread(tmp_path / "end.png"), end)
    assert game.games() == [counted]


# --- what cannot be ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{"speed": 0.0}, {"speed": np.nan}, {"seconds": -1.0}, {"seconds": np.inf}])
def test_films_of_no_length_and_without_an_end_are_refused(tmp_path, options):
    with pytest.raises(RenderError, match="must be a number above 0"):
        film_game("ring", "uniform", tmp_path / "game.mp4", **options)


def test_films_of_unknown_formats_and_into_folders_are_refused_before_anything_is_played(tmp_path):
    with pytest.raises(RenderError, match=r"must end in .gif or .mp4"):
        film_game("ring", "uniform", tmp_path / "game.avi")
    with pytest.raises(RenderError, match=r"must end in .gif or .mp4"), open_film(tmp_path / "a.png", 20.0, (2, 2)):
        raise AssertionError("the film has begun")
    assert not list(tmp_path.iterdir())
    (tmp_path / "a.mp4").mkdir()
    with pytest.raises(OutputError, match="got the folder"):
        film_game("ring", "uniform", tmp_path / "a.mp4", seconds=1)


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


def write(path, pictures):
    with open_film(path, 20.0, pictures.shape[1:3]) as append:
        for picture in pictures:
            append(picture)


def test_a_film_that_cannot_be_encoded_says_so_and_leaves_nothing(tmp_path):
    with pytest.raises(RenderError, match=r"(?s)a.mp4' could not be encoded.*not divisible by 2"):
        write(tmp_path / "a.mp4", np.zeros((10_000, 3, 3, 3), np.uint8))
    assert not list(tmp_path.iterdir())


FULL = "#!/bin/sh\necho 'Error muxing a packet: No space left on device' >&2\nexit 228\n"


@pytest.mark.parametrize("suffix", ["gif", "mp4"])
@pytest.mark.parametrize("encoder", [None, FULL])
def test_a_full_disk_is_said_to_be_full_in_one_line_and_leaves_nothing(tmp_path, monkeypatch, suffix, encoder):
    """The encoder itself writes seven lines about muxers, or nothing."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # else modules imported here leave truncated bytecode
    films, limits = tmp_path / "films", resource.getrlimit(resource.RLIMIT_FSIZE)
    pictures = np.random.default_rng(0).integers(255, size=(400, 64, 64, 3), dtype=np.uint8)
    if encoder is not None:
        program = tmp_path / "encoder"
        program.write_text(encoder)
        program.chmod(0o755)
        monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", lambda: str(program))
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(
            OutputError, match=rf"^cannot write .*a.{suffix}': the disk is full.*run the command again$"
        ):
            write(films / f"a.{suffix}", pictures)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert not list(films.iterdir())
