"""Films and stills show what they were asked to show; how they look is tested with the painter."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from PIL import Image

from swarm_pz.analysis.video import film_game, open_film
from swarm_pz.config import GameConfig
from swarm_pz.errors import RenderError
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.rendering.overlays import make_overlays
from swarm_pz.rendering.painter import PICTURE, Painter

GAME = GameConfig(drones_per_team=2, time_limit=2.0)
OVERLAYS = make_overlays(["target", "captures"], [0, 1])


def test_overlays_are_in_films_and_in_stills(tmp_path, monkeypatch):
    pictures = []

    @contextlib.contextmanager
    def kept(path, rate, size):
        pictures.append(size)
        yield pictures.append

    film_game("ring", "uniform", tmp_path / "a.png", config=GAME, overlays=OVERLAYS)
    monkeypatch.setattr("swarm_pz.analysis.video.open_film", kept)
    film_game("ring", "uniform", tmp_path / "a.mp4", config=GAME, overlays=OVERLAYS)
    game = Rollout("ring", "uniform", [0], config=GAME)
    painter = Painter(("ring", "uniform"), overlays=OVERLAYS, layout=PICTURE)
    assert pictures[0] == painter.size
    np.testing.assert_array_equal(pictures[1], painter.draw(game.simulator))
    game.play()
    end = painter.draw(game.simulator)
    np.testing.assert_array_equal(pictures[-1], end)
    with Image.open(tmp_path / "a.png") as picture:
        np.testing.assert_array_equal(picture, end)


@pytest.mark.parametrize(
    ("suffix", "seconds", "told"),
    [
        ("png", 1.5, [(1.0, 1.5), (1.5, 1.5)]),
        ("mp4", 9.0, [(1.0, 2.0), (2.0, 2.0)]),
        ("mp4", None, [(1.0, 2), (2.0, 2)]),
    ],
)
def test_how_far_it_is_never_goes_beyond_its_end(tmp_path, suffix, seconds, told):
    seen = []
    film_game(
        "uniform", "uniform", tmp_path / f"a.{suffix}", config=GAME, seconds=seconds,
        progress=lambda *now: seen.append(now),
    )  # fmt: skip
    assert seen == told


@pytest.mark.parametrize("options", [{"seconds": float("inf")}, {"speed": float("inf")}])
def test_films_without_an_end_are_refused(tmp_path, options):
    with pytest.raises(RenderError, match="must be a number above 0"):
        film_game("ring", "uniform", tmp_path / "game.mp4", **options)


def test_a_film_of_no_known_format_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(RenderError, match=r"must end in .gif or .mp4"), open_film(tmp_path / "a.png", 20.0, (2, 2)):
        raise AssertionError("the film has begun")
    assert not list(tmp_path.iterdir())
