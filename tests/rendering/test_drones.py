"""Drones, their trails and their shadows in pictures of the board."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.rendering import drones
from swarm_pz.rendering.board import TEAM_COLOURS, blank
from swarm_pz.simulator import Simulator

SIDE = 600
FLYING = {"positions": [[0.5, 0.5], [0.1, 0.9]], "teams": [RED, BLUE]}


def painted(altitude, start=FLYING):
    """Return a picture (SIDE, SIDE) of two drones, of which the first one flies at an altitude."""
    simulator = Simulator(GameConfig(drones_per_team=1))
    simulator.reset([0], scenario=start)
    simulator.games.altitudes[0] = altitude, 0.5
    arena = blank(SIDE, SIDE)
    drones.paint_drones(arena, simulator, 0, SIDE)
    return arena.array().astype(int)


def test_the_higher_a_drone_the_farther_and_the_larger_its_shadow():
    bare, seen = blank(SIDE, SIDE), []
    drones.put_drone(bare, RED, SIDE / 2, SIDE / 2, SIDE)
    without = bare.array().astype(int)[250:400, 250:400]
    for altitude in (0.05, 0.5, 1.0):
        dark = (without - painted(altitude)[250:400, 250:400]).sum(axis=2)
        assert dark.min() >= 0 and dark.max() < 300, "a shadow is lighter than any drone"
        rows, columns = np.nonzero(dark > 15)
        seen.append((columns.max() - 50, rows.max() - 50, np.ptp(columns + rows)))
    assert seen == sorted(seen) and seen[0][0] + 5 < seen[-1][0] < 40
    assert all(abs(right - down) <= 1 for right, down, _ in seen)


def test_no_shadow_lies_on_a_drone():
    near = FLYING | {"positions": [[0.5, 0.5], [0.515, 0.485]]}
    middle = (round(0.515 * SIDE), round(0.515 * SIDE))
    for altitude in (0.05, 1.0):
        assert painted(altitude, near)[middle].tolist() == list(TEAM_COLOURS[BLUE])


@pytest.mark.parametrize("at", [(50.0, 40.0), (50.25, 40.75), (50.75, 40.25)])
def test_red_drones_are_discs_and_blue_ones_diamonds_where_they_are(at):
    shares = []
    for team in (RED, BLUE):
        picture = blank(100, 100)
        drones.put_drone(picture, team, *at, 600)
        body = (np.abs(picture.array().astype(int) - TEAM_COLOURS[team]).max(axis=2) < 30).astype(float)
        rows, columns = np.nonzero(body)
        assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx(at, abs=0.3)
        shares.append(body.sum() / (np.ptp(rows) + 1) / (np.ptp(columns) + 1))
    assert shares[RED] > 0.68 > shares[BLUE], "of their boxes a disc fills pi / 4 and a diamond a half"


def test_no_more_of_a_trail_is_drawn_than_can_be_read():
    config = GameConfig(drones_per_team=1, capture=CaptureConfig(enabled=False))
    simulator = Simulator(config.replace(memory=config.memory.replace(trail=20.0)))
    simulator.reset([0])
    simulator.advance(500)
    paths = drones._paths(simulator, 0)
    assert drones.LONGEST_LINE - 20 < len(paths) <= drones.LONGEST_LINE
    np.testing.assert_array_equal(paths[-1], simulator.positions[0])


def test_trails_that_were_forgotten_are_not_drawn():
    simulator = Simulator(GameConfig(drones_per_team=1))
    simulator.reset([0])
    simulator.advance(90)
    simulator.games.trails[0, 30:60, 0] = -1
    seen = drones._paths(simulator, 0)
    assert np.isnan(seen[:60, 0]).all() and not np.isnan(seen[60:, 0]).any()
    assert not np.isnan(seen[:, 1]).any()


def test_a_trail_is_where_its_drone_was_in_the_colour_of_its_team():
    simulator, side = Simulator(GameConfig(drones_per_team=1)), 600
    simulator.reset([0], scenario={"positions": [[0.1, 0.2], [0.9, 0.6]], "teams": [0, 1]})
    for team, place in ((0, (2, 9)), (1, (6, 0))):  # red flies to the right, blue to the left above it
        density = np.zeros((10, 10))
        density[place] = 1.0
        simulator.command(team, density[None])
    places = []
    for _ in range(30):
        places.append(simulator.positions[0].copy())
        simulator.advance(3)
    arena = blank(side, side)
    drones.paint_trails(arena, simulator, 0, side)
    picture = arena.array().astype(int)
    redder = picture[..., 0] - picture[..., 2]
    for drone, sign in enumerate((1, -1)):
        places_now = np.array(places)[:, drone] * [side, -side] + [0, side]
        x, y = places_now.T.round().astype(int)
        assert np.ptp(x) > 100
        coloured = np.pad(np.maximum(sign * redder, 0), 12)
        seen = [coloured[j : j + 25, i : i + 25].max() for i, j in zip(x, y, strict=True)]
        assert min(seen[-15:]) > 20 and np.mean(seen[:8]) < np.mean(seen[-8:]) / 2
        found_y, found_x = np.nonzero(sign * redder > 5)
        assert np.hypot(found_x[:, None] - x, found_y[:, None] - y).min(axis=1).max() < 40


@pytest.mark.parametrize("side", [300, 600])
def test_a_drone_is_as_large_as_the_arena_lets_it_be_with_a_white_edge(side):
    picture = blank(100, 100)
    picture.fill((0, 0, 0), (0, 0, 100, 100))
    drones.put_drone(picture, RED, 50, 50, side)
    line = picture.array().astype(int)[50]
    body, white = ((np.abs(line - colour).max(axis=1) < 60).sum() for colour in (TEAM_COLOURS[RED], (255, 255, 255)))
    assert abs(body - 13 * side / 600) <= 2 and abs(white - 5 * side / 600) <= 2


def test_a_trail_that_began_anew_in_its_ring_is_drawn_from_its_oldest_place():
    simulator = Simulator(GameConfig(drones_per_team=1, capture=CaptureConfig(enabled=False)))
    simulator.reset([0])
    simulator.command(RED, np.eye(10)[None])
    places = []
    for _ in range(400):
        simulator.advance(1)
        places.append(simulator.positions[0].copy())
    paths = drones._paths(simulator, 0)
    window = len(places[-150:]) - len(paths) + 2
    means = [np.mean(places[start : start + window], axis=0) for start in range(250, 400 - window + 1)]
    np.testing.assert_allclose(paths[:-1], means, atol=0.5 / 50)


def test_of_several_games_the_one_that_was_asked_for_is_drawn():
    both, alone = (Simulator(GameConfig(drones_per_team=2), num_games=games) for games in (2, 1))
    both.reset([4, 5])
    alone.reset([5])
    pictures = []
    for simulator, row in ((both, 1), (alone, 0), (both, 0)):
        simulator.advance(60 if simulator is alone or row == 1 else 0)
        arena = blank(300, 300)
        drones.paint_trails(arena, simulator, row, 300)
        drones.paint_drones(arena, simulator, row, 300)
        pictures.append(arena.array())
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert (pictures[0] != pictures[2]).any()
