"""The signs of the board, which tell teams apart without their colours, too."""

from __future__ import annotations

import numpy as np

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


def test_denser_lines_are_wider():
    command = np.zeros((10, 10))
    command[:, 9] = 1.0
    simulator = Simulator()
    simulator.command(RED, command[None])
    mask = np.asarray(board.contours(simulator.games.coefficients[0, RED], 600))[300].astype(float)
    lines = np.split(mask, np.flatnonzero(mask[1:] * mask[:-1] == 0) + 1)
    ink = [line.sum() for line in lines if line.sum() > 60]
    assert len(ink) >= 3 and ink == sorted(ink) and ink[-1] > 1.2 * ink[0]


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
