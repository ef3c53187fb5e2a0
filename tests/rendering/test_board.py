"""The signs of the board: ground, dots, texts, drones, trails and shadows, which tell teams apart without colour."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.rendering import board, drones
from swarm_pz.rendering.board import TEAM_COLOURS, blank
from swarm_pz.simulator import Simulator

SIDE = 600


def start(scenario=None, **rules):
    simulator = Simulator(GameConfig(**rules))
    simulator.reset([1], scenario=scenario)
    return simulator


def test_ground_is_hatched_upwards_for_red_and_downwards_for_blue():
    for team, up in ((RED, 1), (BLUE, -1)):
        mask = np.asarray(board.hatched(team, 70, 70))
        np.testing.assert_array_equal(mask[1:, 1:-1], mask[:-1, 1 + up : 69 + up])
        assert len(np.unique(mask)) == 2


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


def test_fields_are_as_dark_as_they_are_near_to_capturing():
    pictures = []
    for threshold in (0.6, 0.9):
        simulator = start(capture=CaptureConfig(threshold=threshold))
        simulator.advance(3)
        arena = blank(200, 200)
        board.paint_fields(arena, simulator, 0, 200)
        pictures.append(arena.array().mean())
    assert pictures[0] < pictures[1] - 0.01


@pytest.mark.parametrize("team", [RED, BLUE])
def test_targets_are_dots_and_no_lines_and_larger_where_they_are_denser(team):
    """A target was drawn as lines, as trails are."""
    ink = board.dotted(team, np.full((120, 120), 8.0)) > 0.5
    assert ink.any() and not ink.all(axis=0).any() and not ink.all(axis=1).any()
    assert not (ink & (board.dotted(1 - team, np.ones((120, 120))) > 0.5)).all()
    assert not board.dotted(team, np.zeros((24, 24))).any()
    simulator, command = start(), np.zeros((1, 10, 10))
    command[..., 9] = 1.0
    simulator.command(team, command)
    mask = np.asarray(board.dots(team, simulator.games.coefficients[0, team], SIDE)).astype(float)
    ink = [mask[:, first : first + 120].sum() for first in range(0, SIDE, 120)]
    assert ink[-1] > 2 * ink[0] and ink[3:] == sorted(ink[3:])


def test_a_text_that_fits_is_whole_and_another_is_cut():
    assert board.shorten("short", 20, 1000.0) == "short"
    cut = board.shorten("x" * 90, 20, 100.0)
    assert cut.endswith("x…") and board.font(20).getlength(cut) <= 100.0


# --- drones and shadows -----------------------------------------------------------------------------------


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


@pytest.mark.parametrize("side", [300, 600])
def test_a_drone_is_as_large_as_the_arena_lets_it_be_with_a_white_edge(side):
    picture = blank(100, 100)
    picture.fill((0, 0, 0), (0, 0, 100, 100))
    drones.put_drone(picture, RED, 50, 50, side)
    line = picture.array().astype(int)[50]
    body, white = ((np.abs(line - colour).max(axis=1) < 60).sum() for colour in (TEAM_COLOURS[RED], (255, 255, 255)))
    assert abs(body - 13 * side / 600) <= 2 and abs(white - 5 * side / 600) <= 2


def test_the_higher_a_drone_the_farther_and_the_larger_its_shadow_and_none_lies_on_a_drone():
    def painted(altitude, other):
        simulator = start({"positions": [[0.5, 0.5], other], "teams": [RED, BLUE]}, drones_per_team=1)
        simulator.games.altitudes[0] = altitude, 0.5
        arena = blank(SIDE, SIDE)
        drones.paint_drones(arena, simulator, 0, SIDE)
        return arena.array().astype(int)

    bare, seen = blank(SIDE, SIDE), []
    drones.put_drone(bare, RED, SIDE / 2, SIDE / 2, SIDE)
    without = bare.array().astype(int)[250:400, 250:400]
    for altitude in (0.05, 0.5, 1.0):
        dark = (without - painted(altitude, [0.1, 0.9])[250:400, 250:400]).sum(axis=2)
        assert dark.min() >= 0 and dark.max() < 300, "a shadow is lighter than any drone"
        rows, columns = np.nonzero(dark > 15)
        seen.append((columns.max() - 50, rows.max() - 50, np.ptp(columns + rows)))
        middle = round(0.515 * SIDE)
        assert painted(altitude, [0.515, 0.485])[middle, middle].tolist() == list(TEAM_COLOURS[BLUE])
    assert seen == sorted(seen) and seen[0][0] + 5 < seen[-1][0] < 40
    assert all(abs(right - down) <= 1 for right, down, _ in seen)


# --- trails -----------------------------------------------------------------------------------------------


def test_a_trail_reaches_no_further_back_than_can_be_read_or_than_it_is_known():
    rules = {"drones_per_team": 1, "capture": CaptureConfig(enabled=False)}
    long = start(**rules, memory=GameConfig().memory.replace(trail=20.0))
    long.advance(500)
    paths = drones._paths(long, 0)
    assert drones.LONGEST_LINE - 20 < len(paths) <= drones.LONGEST_LINE
    np.testing.assert_array_equal(paths[-1], long.positions[0])
    forgotten = start(**rules)
    forgotten.advance(90)
    forgotten.games.trails[0, 30:60, 0] = -1
    seen = drones._paths(forgotten, 0)
    assert np.isnan(seen[:60, 0]).all() and not np.isnan(seen[60:, 0]).any() and not np.isnan(seen[:, 1]).any()


def test_a_trail_that_began_anew_in_its_ring_is_drawn_from_its_oldest_place():
    simulator, places = start(drones_per_team=1, capture=CaptureConfig(enabled=False)), []
    simulator.command(RED, np.eye(10)[None])
    for _ in range(400):
        simulator.advance(1)
        places.append(simulator.positions[0].copy())
    paths = drones._paths(simulator, 0)
    window = 150 - len(paths) + 2
    means = [np.mean(places[first : first + window], axis=0) for first in range(250, 400 - window + 1)]
    np.testing.assert_allclose(paths[:-1], means, atol=0.5 / 50)


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
        seen = [coloured[j : j + 25, i : i + 25].max() for i, j in zip(x, y, strict=True)]
        assert min(seen[-15:]) > 20 and np.mean(seen[:8]) < np.mean(seen[-8:]) / 2
        found_y, found_x = np.nonzero(redder > 5)
        assert np.hypot(found_x[:, None] - x, found_y[:, None] - y).min(axis=1).max() < 40
