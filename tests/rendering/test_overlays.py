from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import RenderError
from swarm_pz.rendering import board as board_signs
from swarm_pz.rendering import overlays
from swarm_pz.rendering.board import LEVELS, TEAM_COLOURS
from swarm_pz.rendering.overlays import KINDS, make_overlays
from swarm_pz.rendering.painter import ARENA, ENTRY_HEIGHT, HEADER, MARGIN, draw
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import potential


@pytest.fixture(scope="module")
def board():
    """The second of two games: red is sent to the left half, blue everywhere."""
    simulator = Simulator(GameConfig(drones_per_team=(6, 1)), num_games=2)
    simulator.reset([0, 1])
    left = np.zeros((10, 10))
    left[:, :4] = 1.0
    simulator.command(0, np.stack([np.ones((10, 10)), left]))
    simulator.advance(90)
    return simulator


def arena(picture):
    return picture[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA].astype(int)


def shown(board, *kinds, teams=(0,)):
    return draw(board, 1, make_overlays(kinds, teams))


def test_every_overlay_adds_a_line_to_the_legend(board):
    plain = draw(board, 1)
    for kind in KINDS:
        picture = shown(board, kind)
        assert picture.shape == (plain.shape[0] + ENTRY_HEIGHT, *plain.shape[1:])
        assert picture[HEADER + ARENA + 4 :].min() < 128, kind
    assert shown(board, "target", "coverage").shape == (plain.shape[0] + ENTRY_HEIGHT, *plain.shape[1:])
    assert shown(board, "target", "coverage", "captures", teams=(0, 1)).shape[0] == plain.shape[0] + 3 * ENTRY_HEIGHT


def test_pictures_fit_films(board):
    assert all(side % 4 == 0 for side in shown(board, *KINDS).shape[:2])


def test_the_target_is_shaded_in_the_colour_of_its_team_where_it_lies(board):
    picture = arena(shown(board, "target"))
    left, right = picture[:, :150], picture[:, -150:]
    assert np.median(left[..., 0] - left[..., 2]) > 20
    assert np.median(right, axis=(0, 1)).tolist() == [255, 255, 255]


def test_a_uniform_target_has_one_shade_and_no_lines(board):
    picture = arena(draw(board, 0, make_overlays(["target"], [0])))
    shade = np.median(picture, axis=(0, 1))
    assert LEVELS[0] < 1.0 < LEVELS[1]
    assert (shade < 255).any()
    assert (np.abs(picture - shade).max(axis=2) <= 2).mean() > 0.85


def test_coverage_is_drawn_as_lines_around_the_drones(board):
    picture = arena(shown(board, "coverage"))
    dark = (picture.max(axis=2) < 110).mean(axis=0)
    assert 0.001 < dark.mean() < 0.1
    assert dark[: ARENA // 2].sum() > 2 * dark[ARENA // 2 :].sum()


def test_captures_are_outlined_where_the_rule_captures(board):
    picture = arena(shown(board, "captures"))
    for row, column in np.argwhere(board.captures_here[1, 0])[:5]:
        y, x = round((49.5 - row) / 50 * ARENA), round((column + 0.5) / 50 * ARENA)
        assert picture[y - 9 : y + 10, x - 9 : x + 10].min() < 120
    assert draw(board, 1).mean() < picture.mean()


def test_valleys_of_the_potential_are_bright(board):
    picture = arena(shown(board, "potential"))
    heights, _ = potential(board, 1, 0, 50)
    brightness = {}
    for name, place in (("top", heights.argmax()), ("bottom", heights.argmin())):
        row, column = np.unravel_index(place, heights.shape)
        y, x = round((49.5 - row) / 50 * ARENA), round((column + 0.5) / 50 * ARENA)
        brightness[name] = np.median(picture[max(y - 20, 0) : y + 20, max(x - 20, 0) : x + 20])
    assert brightness["bottom"] > brightness["top"] + 60


def test_drones_are_drawn_above_overlays(board):
    picture = draw(board, 1, make_overlays(list(KINDS), [0]))
    for (x, y), team in zip(board.positions[1], board.teams[1], strict=True):
        pixel = picture[round(HEADER + (1 - y) * ARENA), round(MARGIN + x * ARENA)]
        np.testing.assert_array_equal(pixel, TEAM_COLOURS[team])


def test_a_team_without_drones_covers_nothing():
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=CaptureConfig(enabled=False)))
    simulator.reset([0])
    for kind in KINDS:
        draw(simulator, overlays=make_overlays([kind], [1]))


def test_drawing_leaves_the_game_alone(board):
    before = board.snapshot()
    shown(board, *KINDS)
    for old, new in zip(before, board.games, strict=True):
        np.testing.assert_array_equal(old, new)


@pytest.fixture(scope="module")
def mirrored():
    """Red is and is sent to the left, blue to the right."""
    places = np.stack([np.full(6, 0.15), np.linspace(0.1, 0.9, 6)], axis=1)
    positions = np.concatenate([places, [1.0, 0.0] + places * [-1.0, 1.0]])
    simulator = Simulator(GameConfig(drones_per_team=6, capture=CaptureConfig(enabled=False)))
    simulator.reset([0], scenario={"positions": positions})
    for team in range(2):
        side = np.zeros((10, 10))
        side[:, :3] = 1.0
        simulator.command(team, (side if team == 0 else side[:, ::-1])[None])
    simulator.advance(6)
    return simulator


@pytest.mark.parametrize("team", [0, 1])
def test_an_overlay_is_of_its_own_team(mirrored, team):
    def ink(kind):
        picture = arena(draw(mirrored, 0, make_overlays([kind], [team])))
        return 255 - picture if team == 0 else 255 - picture[:, ::-1]

    own, other = (slice(None), slice(0, 150)), (slice(None), slice(-150, None))
    target = ink("target")
    lost, kept = (1, 0) if team == 0 else (0, 2)
    assert np.median(target[own][..., lost]) > np.median(target[own][..., kept]) + 20
    assert np.median(target[other]) == 0
    dense, sparse = target[:, 20:60, lost].mean(), target[:, 180:240, lost].mean()
    assert dense > sparse + 10, "the denser the darker"
    coverage = ink("coverage").max(axis=2)
    assert coverage[own].sum() > 1.5 * coverage[other].sum()
    heights, _ = potential(mirrored, 0, team, 30)
    seen = ink("potential").max(axis=2).reshape(30, 20, 30, 20).mean(axis=(1, 3))[::-1]
    expected = heights if team == 0 else heights[:, ::-1]
    assert np.corrcoef(seen.ravel(), expected.ravel())[0, 1] > 0.5


@pytest.mark.parametrize("team", [0, 1])
def test_captures_are_hatched_as_the_board_is(team):
    cells = np.zeros((1, 2, 50, 50), bool)
    cells[0, team, 30:45, 5:20] = True  # at the upper left
    ground = board_signs.blank(600, 600)
    make_overlays(["captures"], [team])[0].paint(ground, SimpleNamespace(captures_here=cells), 0, 600)
    ink = 255 - ground.array().astype(int).max(axis=2)
    block = ink[72:228, 72:228]
    assert ink[252:].max() == ink[:, 252:].max() == 0 and ink[60:72, 100:200].max() > 100, "a heavy line around it"
    moves = {0: (block[1:, :-1], block[:-1, 1:]), 1: (block[1:, 1:], block[:-1, :-1])}
    differences = {way: np.abs(one - other).mean() for way, (one, other) in moves.items()}
    assert differences[team] < 0.5 * differences[1 - team]


def test_arrows_point_down_the_potential(mirrored, monkeypatch):
    arrows = []
    monkeypatch.setattr(overlays, "_arrow", lambda pen, start, end, *_: arrows.append((start, end)))
    for team in range(2):
        arrows.clear()
        make_overlays(["potential"], [team])[0].paint(board_signs.blank(600, 600), mirrored, 0, 600)
        _, gradient = potential(mirrored, 0, team, 13)
        assert len(arrows) > 30
        for start, end in arrows:
            x, y = (start + end) / 2 / (2 * 600) * 13  # the pen is twice as fine
            row, column = 12 - int(y), int(x)
            way = (end - start) * [1, -1]
            slope = gradient[row, column]
            assert way @ slope == pytest.approx(-np.linalg.norm(way) * np.linalg.norm(slope))


def test_overlays_lie_in_their_order_and_say_whose_they_are(mirrored):
    assert make_overlays(["captures", "target", "coverage"], [1]) == [
        overlays.Target(1), overlays.Coverage(1), overlays.Captures(1)
    ]  # fmt: skip
    assert make_overlays(["target", "potential"], [0]) == [overlays.Potential(0), overlays.Target(0)]
    assert make_overlays(["target"], [0, 1]) == [overlays.Target(0), overlays.Target(1)]


@pytest.mark.parametrize(
    ("kinds", "teams", "message"),
    [(["targte"], (0,), "did you mean 'target'"), (["potential"], (0, 1), "one team at a time")],
)
def test_overlays_that_nobody_could_read_are_refused(kinds, teams, message):
    with pytest.raises(RenderError, match=message):
        make_overlays(kinds, teams)
