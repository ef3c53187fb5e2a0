"""What each number of a pattern does."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.policies.pattern import BOUNDS, KINDS, PatternPlayer, name_of, numbers_of, points_of
from swarm_pz.policy import load

GAME = GameConfig(command_cells=25)
SPOT = KINDS["spot"] | {"x": 0.5, "y": 0.5, "width": 0.05}


def images(own=(2, 2), opposing=(12, 12)):
    board = np.zeros((1, 2, 25, 25), np.uint8)
    board[0, 0][own] = board[0, 1][opposing] = 255
    return board


def play(board=None, commands=1, **numbers):
    """Return the densities (commands, 25, 25) of a player: a spot in the middle, with `numbers` replaced."""
    player = PatternPlayer(np.array([list((SPOT | numbers).values())]), GAME)
    player.reset([0], np.zeros(1, np.int64))
    board = images() if board is None else board
    return np.array([player.act(board, np.zeros(1, np.int64))[0] for _ in range(commands)])


def brightest(density):
    return tuple(int(place) for place in np.unravel_index(density.argmax(), density.shape))


@pytest.mark.parametrize(
    ("numbers", "place"),
    [
        ({}, (12, 12)),
        ({"home": 0.5}, (7, 7)),
        ({"x": 1.0, "y": -0.2}, (0, 24)),
        ({"x": 1.0, "y": 1.2}, (24, 24)),
    ],
)
def test_a_spot_lies_where_its_numbers_say(numbers, place):
    assert brightest(play(**numbers)[0]) == place


def test_it_leans_to_the_opponents_and_runs_from_where_they_were_first_seen():
    east = images(opposing=(12, 22))
    assert brightest(play(east, lean=0.5)[0]) == (12, 17)
    lap = {"along": 0.2, "across": 0.2, "period": 20.0}
    assert [brightest(one) for one in play(commands=21, **lap)[::5]] == [(12, 17), (17, 12), (12, 7), (7, 12), (12, 17)]
    assert brightest(play(east, **lap, start=0.5, look=1.0)[0]) == (12, 7), "opposite of them"
    north = images(opposing=(22, 12))
    assert brightest(play(north, **lap, look=1.0)[0]) == (17, 12), "with them"
    assert brightest(play(north, **lap, look=0.0)[0]) == (12, 17), "blind"
    sweep = play(commands=11, along=0.2, period=20.0)
    assert [brightest(one) for one in sweep[::5]] == [(12, 17), (12, 12), (12, 7)]


def test_rings_have_ground_and_a_core():
    plain, raised = play(radius=0.2, width=0.05)[0], play(radius=0.2, width=0.05, ground=0.5, core=0.5)[0]
    assert plain[12, 12] < 0.01 and plain[12, 17] == pytest.approx(plain.max(), abs=1e-6)
    assert raised[0, 0] == pytest.approx(0.5 / 1.5, abs=1e-3) and raised[12, 12] == pytest.approx(1.0 / 1.5, abs=1e-3)


def test_corners_of_the_bounds_are_densities_and_names_hold_numbers():
    low, high = np.array(list(BOUNDS.values())).T
    both = PatternPlayer(np.array([low, high]), GAME)
    both.reset([0, 1], np.arange(2))
    with np.errstate(all="raise", under="ignore"):
        densities = both.act(np.concatenate([images()] * 2), np.arange(2))
    assert densities.max() == 1.0 and densities.min() >= 0.0
    for kind in KINDS.values():
        numbers = np.array([list(kind.values())])
        np.testing.assert_allclose(numbers_of(points_of(numbers)), numbers, atol=1e-12)
        assert list(kind) == list(BOUNDS) and load(name_of(numbers[0]), GAME)._numbers == pytest.approx(numbers)


@pytest.mark.parametrize("which", ["1 2", "a b", "laps", " ".join(["9"] * 13), " ".join(["nan"] * 13)])
def test_numbers_of_no_pattern_are_refused(which):
    with pytest.raises(PolicyError, match=r"expected 13 numbers"):
        load(f"pattern:{which}", GameConfig())
