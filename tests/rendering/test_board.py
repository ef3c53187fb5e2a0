"""The signs of the board, which tell teams apart without their colours, too."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.rendering import board
from swarm_pz.simulator import Simulator


def test_ground_is_hatched_upwards_for_red_and_downwards_for_blue():
    for team, up in ((RED, 1), (BLUE, -1)):
        mask = np.asarray(board.hatched(team, 70, 70))
        np.testing.assert_array_equal(mask[1:, 1:-1], mask[:-1, 1 + up : 69 + up])
        assert len(np.unique(mask)) == 2


def test_of_a_picture_a_copy_is_another_picture():
    one = board.blank(4, 4)
    other = one.copy()
    other.fill((1, 2, 3), (0, 0, 4, 4))
    assert (one.array() == 255).all() and (other.array() == [1, 2, 3]).all()


def test_dots_of_a_target_are_larger_where_it_is_denser():
    command = np.zeros((10, 10))
    command[:, 9] = 1.0
    simulator = Simulator()
    simulator.command(RED, command[None])
    mask = np.asarray(board.dots(RED, simulator.games.coefficients[0, RED], 600)).astype(float)
    ink = [mask[:, first : first + 120].sum() for first in range(0, 600, 120)]
    assert ink[-1] > 2 * ink[0] and ink[3:] == sorted(ink[3:])


@pytest.mark.parametrize("team", [RED, BLUE])
def test_targets_are_dots_and_no_lines(team):
    """A target was drawn as lines, as trails are."""
    ink = board.dotted(team, np.full((120, 120), 8.0)) > 0.5
    assert ink.any() and not ink.all(axis=0).any() and not ink.all(axis=1).any()
    assert not (ink & (board.dotted(1 - team, np.ones((120, 120))) > 0.5)).all()
    assert not board.dotted(team, np.zeros((24, 24))).any()


def test_fields_are_as_dark_as_they_are_near_to_capturing():
    pictures = []
    for threshold in (0.6, 0.9):
        simulator = Simulator(GameConfig(capture=CaptureConfig(threshold=threshold)))
        simulator.reset([3])
        simulator.advance(3)
        arena = board.blank(200, 200)
        board.paint_fields(arena, simulator, 0, 200)
        pictures.append(arena.array().mean())
    assert pictures[0] < pictures[1] - 0.01


def test_a_text_that_fits_is_whole():
    assert board.shorten("short", 20, 1000.0) == "short"
    cut = board.shorten("x" * 90, 20, 100.0)
    assert cut.endswith("x…") and board.font(20).getlength(cut) <= 100.0
