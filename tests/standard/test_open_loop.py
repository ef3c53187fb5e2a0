"""Open-loop players show what their file says, and are measured on the games that entries play."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.board import open_loop as board
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import open_loop
from swarm_pz.standard.games import PlayerFactory, TrackGames
from swarm_pz.standard.protocol import Protocol


def answers_of(name, steps, config):
    policy, rows = policies.load(name, config), np.arange(2)
    policy.reset([1, 2], rows)
    return np.array([policy.act(np.zeros((2, 1, 10, 10), np.uint8), rows)[1] for _ in range(steps)])


def test_images_are_shown_in_turn_and_again_and_on_any_cells(monkeypatch):
    left, right = ((1.0, 0.0), (1.0, 0.0)), ((0.0, 1.0), (0.0, 1.0))
    monkeypatch.setattr(open_loop, "SEQUENCE", ((2, left), (1, right)))
    shown = answers_of("best_sequence", 7, GameConfig())
    assert (shown[:, 3, 4] == [1, 1, 0, 1, 1, 0, 1]).all() and (shown[:, 3, 4] + shown[:, 3, 5] == 1).all()
    assert answers_of("best_sequence", 1, GameConfig(command_cells=5))[0].shape == (5, 5)
    assert (answers_of("best_constant", 3, GameConfig()) == answers_of("best_constant", 1, GameConfig())).all()


def test_the_sequence_that_was_found_against_uniform_wins(monkeypatch):
    best = open_loop.BESTS["uniform"]["sequence"]
    monkeypatch.setattr(open_loop, "SEQUENCE", open_loop.images_of(best["images"]))
    assert play_match("best_sequence", "uniform", games=10, seed=11).count("win") >= 9, "on any processor"


@pytest.mark.parametrize("symmetric", [True, False])
def test_numbers_of_the_search_are_images_with_the_squares_symmetry_and_without(symmetric):
    numbers = np.random.default_rng(3).normal(size=3 * (7 if symmetric else 26))
    images = board.decoded(numbers, 3, symmetric)
    assert all(1 <= count <= board.LONGEST for count, _ in images)
    for _, image in images:
        values = np.array(image)
        alike = [(values == other).all() for other in (values.T, values[::-1], np.rot90(values))]
        assert values.max() == 1.0 and all(alike) is symmetric and any(alike) is symmetric
    again = board.decoded(board.encoded(images, symmetric), 3, symmetric)
    for (count, image), (other, back) in zip(images, again, strict=True):
        assert count == other and np.abs(np.array(image) - np.array(back)).max() < 0.02


def test_what_is_measured_are_the_games_that_an_entry_plays(tiny, tmp_path, monkeypatch):
    track = replace(tiny.tracks[1], trials=tiny.tracks[1].trials[1:])
    games = TrackGames(track, tiny, PlayerFactory(("best_constant",), track.trials), tmp_path)
    games.play()
    monkeypatch.setattr(Protocol, "read", lambda: tiny)
    other = ((1, ((1.0, 0.0), (0.0, 0.0))),)
    found = board.play((other, open_loop.CONSTANT), track, 0, range(track.games), track.seed)
    lines = games.lines()
    assert found[1].tolist() == [line.share for line in lines]
