"""The board shows ground, targets, drones and trails where they are, and tells the teams apart."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.rendering import board, drones
from swarm_pz.rendering.board import TEAM_COLOURS, blank
from swarm_pz.simulator import Simulator

SIDE = 600


def start(scenario=None, **rules):
    simulator = Simulator(GameConfig(**rules))
    simulator.reset([1], scenario=scenario)
    return simulator


@pytest.mark.parametrize("paint", [board.paint_captures, board.paint_fields])
def test_the_ground_of_a_team_is_where_it_captures_and_in_its_colour(paint):
    simulator = start(drones_per_team=(12, 6))
    simulator.advance(60)
    arena = blank(SIDE, SIDE)
    paint(arena, simulator, 0, SIDE)
    picture = arena.array().astype(int)[::-1]
    redder = (picture[..., 0] - picture[..., 2]).reshape(50, 12, 50, 12).mean(axis=(1, 3))
    red, blue = simulator.captures_here[0]
    assert (red & ~blue).any() and (blue & ~red).any()
    assert redder[red & ~blue].min() > 3 and redder[blue & ~red].max() < -3


def test_a_target_is_a_line_around_where_it_is_dense_and_the_whole_square_has_none():
    away = np.hypot(*np.indices((100, 100)) - 50.0)
    red, blue = (board.outline(team, np.maximum(60.0 - away, 0.0)) for team in (RED, BLUE))
    line = np.abs(away - 30) < 0.5
    assert red[line].min() > 0.9 and red[away > 32].max() == 0 < red[away < 28].min() == red[away < 28].max() < 0.2
    assert 0.3 < (blue[line] > 0.9).mean() < 0.7, "blue's is dashed"
    assert not board.outline(RED, np.ones((100, 100))).any()


# --- drones -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", [(50.0, 40.0), (50.25, 40.75), (50.75, 40.25)])
def test_red_drones_are_discs_and_blue_ones_diamonds_where_they_are(at):
    shares = []
    for team in (RED, BLUE):
        picture = blank(100, 100)
        drones.put_drone(picture, team, *at, SIDE)
        body = (np.abs(picture.array().astype(int) - TEAM_COLOURS[team]).max(axis=2) < 30).astype(float)
        rows, columns = np.nonzero(body)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(at, abs=0.3)
        shares.append(body.sum() / (np.ptp(rows) + 1) / (np.ptp(columns) + 1))
    assert shares[RED] > 0.68 > shares[BLUE], "of their boxes a disc fills pi / 4 and a diamond a half"


# --- trails -----------------------------------------------------------------------------------------------


def test_a_trail_is_where_its_drone_was_fades_and_is_in_the_colour_of_its_team():
    simulator, places = start({"positions": [[0.1, 0.2], [0.9, 0.6]], "teams": [0, 1]}, drones_per_team=1), []
    for team, place in ((0, (2, 9)), (1, (6, 0))):  # red flies to the right, blue to the left above it
        density = np.zeros((10, 10))
        density[place] = 1.0
        simulator.command(team, density[None])
    for _ in range(30):
        places.append(simulator.positions[0].copy())
        simulator.advance(3)
    arena = blank(SIDE, SIDE)
    drones.paint_trails(arena, simulator, 0, SIDE)
    picture = arena.array().astype(int)
    for drone, sign in enumerate((1, -1)):
        redder = sign * (picture[..., 0] - picture[..., 2])
        x, y = (np.array(places)[:, drone] * [SIDE, -SIDE] + [0, SIDE]).T.round().astype(int)
        assert np.ptp(x) > 100
        coloured = np.pad(np.maximum(redder, 0), 12)
        peaks = [coloured[j : j + 25, i : i + 25].max() for i, j in zip(x, y, strict=True)]
        assert min(peaks[-15:]) > 20 and np.mean(peaks[:8]) < np.mean(peaks[-8:]) / 2
        found_y, found_x = np.nonzero(redder > 5)
        assert np.hypot(found_x[:, None] - x, found_y[:, None] - y).min(axis=1).max() < 40
