"""Each overlay shows its own team's values where they are, below the drones."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import RenderError
from swarm_pz.rendering import overlays
from swarm_pz.rendering.board import TEAM_COLOURS
from swarm_pz.rendering.overlays import KINDS, make_overlays
from swarm_pz.rendering.painter import ARENA, HEADER, MARGIN, draw
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


@pytest.fixture(scope="module")
def mirrored():
    """Red is on the left and is sent there, blue on the right."""
    places = np.stack([np.full(6, 0.15), np.linspace(0.1, 0.9, 6)], axis=1)
    positions = np.concatenate([places, [1.0, 0.0] + places * [-1.0, 1.0]])
    simulator = Simulator(GameConfig(drones_per_team=6, capture=CaptureConfig(enabled=False)))
    simulator.reset([0], scenario={"positions": positions})
    side = np.zeros((10, 10))
    side[:, :3] = 1.0
    for team in range(2):
        simulator.command(team, (side if team == 0 else side[:, ::-1])[None])
    simulator.advance(6)
    return simulator


def arena(picture):
    return picture[HEADER : HEADER + ARENA, MARGIN : MARGIN + ARENA].astype(int)


def shown(board, *kinds, teams=(0,)):
    return draw(board, 1, make_overlays(kinds, teams))


def test_drones_are_above_overlays_and_drawing_leaves_the_game_alone(board):
    before, picture = board.snapshot(), arena(shown(board, *KINDS))
    for (x, y), team in zip(board.positions[1], board.teams[1], strict=True):
        np.testing.assert_array_equal(picture[round((1 - y) * ARENA), round(x * ARENA)], TEAM_COLOURS[team])
    for old, new in zip(before, board.games, strict=True):
        np.testing.assert_array_equal(old, new)


def test_a_team_without_drones_covers_nothing():
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=CaptureConfig(enabled=False)))
    simulator.reset([0])
    for kind in KINDS:
        draw(simulator, overlays=make_overlays([kind], [1]))


@pytest.mark.parametrize("team", [0, 1])
def test_an_overlay_is_of_its_own_team(mirrored, team):
    def ink(kind):
        picture = arena(draw(mirrored, 0, make_overlays([kind], [team])))
        return 255 - picture if team == 0 else 255 - picture[:, ::-1]

    target, coverage = ink("target"), ink("coverage").max(axis=2)
    lost, kept = (1, 0) if team == 0 else (0, 2)
    assert np.median(target[:, :150, lost]) > np.median(target[:, :150, kept]) + 20
    assert np.median(target[:, -150:]) == 0
    assert target[:, 20:60, lost].mean() > target[:, 180:240, lost].mean() + 10, "the denser the darker"
    assert coverage[:, :150].sum() > 1.5 * coverage[:, -150:].sum()
    heights, _ = potential(mirrored, 0, team, 30)
    brightness = ink("potential").max(axis=2).reshape(30, 20, 30, 20).mean(axis=(1, 3))[::-1]
    expected = heights if team == 0 else heights[:, ::-1]
    assert np.corrcoef(brightness.ravel(), expected.ravel())[0, 1] > 0.5


def test_overlays_lie_in_their_order_and_those_that_nobody_could_read_are_refused():
    wanted = [overlays.Target(0), overlays.Target(1), overlays.Coverage(0), overlays.Coverage(1)]
    assert make_overlays(["coverage", "target"], [0, 1]) == wanted
    assert make_overlays(["target", "potential"], [0]) == [overlays.Potential(0), overlays.Target(0)]
    with pytest.raises(RenderError, match="did you mean 'target'"):
        make_overlays(["targte"], (0,))
    with pytest.raises(RenderError, match="one team at a time"):
        make_overlays(["potential"], (0, 1))
