from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import capture_geometry
from tests.benchmarks.paper.given import SEED

SMALL = {}
"""What makes the figure quick."""


@pytest.mark.parametrize("wrong", [0, 1])
def test_one_cell_that_is_not_as_expected_is_one_too_many(monkeypatch, wrong):
    def probe(drones):
        expected = next(cells for own, cells in capture_geometry.SCENES.values() if own == drones)
        captured = np.zeros((50, 50), bool)
        for column, row in expected:
            captured[row, column] = True
        if drones == [(7, 7)] and wrong:
            captured[30, 40] = True
        return np.zeros((50, 50)), captured

    monkeypatch.setattr(capture_geometry, "probe", probe)
    finding = capture_geometry.measure(SEED)
    assert finding.supported == (wrong == 0)
    assert finding.statistic["cells_that_differ"] == wrong / (4 * 2500)
    assert finding.seen.startswith("Of 10,000 games") and f" {wrong} differ" in finding.seen


@pytest.mark.parametrize(("centre", "cells"), [((9, 9), 16), ((9, 0), 9), ((0, 0), 5), ((49, 25), 9), ((1, 1), 7)])
def test_walls_shorten_the_ring_around_a_cell(centre, cells):
    ring = capture_geometry.ring_around(centre)
    assert len(ring) == len(set(ring)) == cells
    assert all(max(abs(x - centre[0]), abs(y - centre[1])) == 2 for x, y in ring)
