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


@pytest.mark.parametrize("at", [(50.0, 40.0), (50.25, 40.75), (50.75, 40.25)])
def test_red_drones_are_discs_and_blue_ones_diamonds_where_they_are(at):
    shares = []
    for team in (RED, BLUE):
        picture = board.blank(100, 100)
        board.put_drone(picture, team, *at, 600)
        body = (np.abs(picture.array().astype(int) - board.TEAM_COLOURS[team]).max(axis=2) < 30).astype(float)
        rows, columns = np.nonzero(body)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(at, abs=0.3)
        shares.append(body.sum() / (np.ptp(rows) + 1) / (np.ptp(columns) + 1))
    assert shares[RED] > 0.68 > shares[BLUE], "of their boxes a disc fills pi / 4 and a diamond a half"


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


def test_no_more_of_a_trail_is_drawn_than_can_be_read():
    config = GameConfig(drones_per_team=1, capture=CaptureConfig(enabled=False))
    simulator = Simulator(config.replace(memory=config.memory.replace(trail=20.0)))
    simulator.reset([0])
    simulator.advance(500)
    paths = board._paths(simulator, 0)
    assert board.LONGEST_LINE - 20 < len(paths) <= board.LONGEST_LINE
    np.testing.assert_array_equal(paths[-1], simulator.positions[0])


def test_a_text_that_fits_is_whole():
    assert board.shorten("short", 20, 1000.0) == "short"
    cut = board.shorten("x" * 90, 20, 100.0)
    assert cut.endswith("x…") and board.font(20).getlength(cut) <= 100.0
