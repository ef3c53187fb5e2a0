from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.paper.course import Captures, lead_taken, rates_of_middle_and_end, turns_of_lead


def test_captures_are_kept_of_the_games_that_ran():
    captures = Captures(2)
    for rows, counted in (([0, 1], [[1, 2], [0, 1]]), ([1], [[1, 2], [4, 3]])):
        games = SimpleNamespace(captures=np.array(counted))
        captures(SimpleNamespace(rows=np.array(rows), simulator=SimpleNamespace(games=games)))
    assert captures.totals == [[0, 3], [0, 1, 7]]


def test_the_middle_is_three_fifths_and_the_end_one():
    middle, end = rates_of_middle_and_end([0, 9, 9, 10, 12, 15, 16, 18, 21, 21, 25])
    assert (middle, end) == (pytest.approx(12 / 6), pytest.approx(4 / 2))
    assert rates_of_middle_and_end([0, 3]) == (3.0, 0.0)


def test_the_lead_is_taken_for_good_after_the_last_step_without_it():
    assert lead_taken([10, 12, 8, 10, 11, 15, 20], 20) == pytest.approx(4 / 6)
    assert lead_taken([10, 9, 0], 20) == pytest.approx(1 / 2)
    assert lead_taken([10, 12, 8, 8, 11, 0], 20) == 1.0


def test_a_team_that_led_from_the_start_took_the_lead_at_once():
    assert lead_taken([15, 16, 20], 20) == 0.0


def test_turns_of_the_lead_do_not_count_equal_teams():
    assert turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2
    assert turns_of_lead([10, 10], 20) == 0
