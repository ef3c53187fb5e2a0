"""What figures take for drawings is what the table makes of them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims.flocking_flights import MODES
from benchmarks.paper.drawings import DRAWINGS, interpolated
from swarm_pz.config import GameConfig
from swarm_pz.play.strokes import Stroke, density_of
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import basis


@pytest.mark.parametrize("drawing", DRAWINGS.values(), ids=list(DRAWINGS))
def test_a_drawing_asks_for_what_the_table_makes_of_its_strokes(drawing):
    strokes = [Stroke(brush=brush, width=width, points=points) for brush, width, points in drawing.strokes]
    asked = density_of(strokes, GameConfig().command_cells)
    np.testing.assert_allclose(drawing.density, asked / asked.max(), atol=6e-4)


def test_the_target_of_a_command_is_the_one_that_the_simulator_flies_for():
    density, cells = DRAWINGS["two_spots"].density, 200
    simulator = Simulator()
    simulator.command(0, density[None])
    target = interpolated(density, cells)
    centres = (np.arange(cells) + 0.5) / cells
    places = np.stack(np.meshgrid(centres, centres), axis=-1)
    found = np.einsum("yx,yxkl->kl", target / target.sum(), basis(places, 4))
    np.testing.assert_allclose(found, simulator.games.coefficients[0, 0, :4, :4], atol=2e-3)


def test_each_spot_lies_around_its_middle_the_diffuse_one_first():
    cells = 100
    target = interpolated(DRAWINGS["two_spots"].density, cells)
    centres = (np.arange(cells) + 0.5) / cells
    lower = np.add.outer(centres, centres) < 1.1
    for mode, part in zip(MODES, (target * lower, target * ~lower), strict=True):
        middle = (part.sum(axis=0) @ centres / part.sum(), part.sum(axis=1) @ centres / part.sum())
        assert middle == pytest.approx(mode, abs=0.02)
