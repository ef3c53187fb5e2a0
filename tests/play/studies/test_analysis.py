"""The analysis finds a planted difference, and none where none was planted."""

from dataclasses import fields

import numpy as np
import pytest

from swarm_pz.evaluation.intervals import wilson
from swarm_pz.play.studies.analysis import compare, conditions, sign_test, win_interval
from swarm_pz.play.studies.rows import GameRow


def game(participant, condition, won, seconds, decided):
    """Return a game that counts; nothing else of it is known."""
    unknown = dict.fromkeys((column.name for column in fields(GameRow)), None)
    known = {"participant": participant, "condition": condition, "won": won, "seconds": seconds, "decided": decided}
    return GameRow(**unknown | known)


def simulated(seed, gain):
    """Compare the wins of a study in which persons differ, and win more often under the first condition by `gain`."""
    chance, played = np.random.default_rng(seed), []
    for person, skill in enumerate(chance.uniform(0.2, 0.6, 8)):
        for condition, more in [("drawing", gain)] * 6 + [("pointing", 0.0)] * 6:
            won = bool(chance.random() < skill + more)
            chance.exponential()  # keeps the draws that docs/data.md counts
            played.append(game(f"P{person}", condition, won, 10.0, decided=True))
    return compare(played)[0]


def test_a_planted_difference_is_found_and_none_where_none_was_planted():
    planted, nothing = ([simulated(seed, gain) for seed in range(50)] for gain in (0.4, 0.0))
    assert sum(one.p <= 0.05 for one in planted) >= 45
    assert sum(one.low <= 0.4 <= one.high for one in planted) >= 45
    assert sum(one.p <= 0.05 for one in nothing) <= 5
    assert sum(one.low <= 0.0 <= one.high for one in nothing) >= 45


@pytest.mark.parametrize(
    ("differences", "p"),
    [
        ([1.0, 1.0, 1.0], 2 / 8),
        ([1.0, -1.0], 1.0),
        ([0.0] * 5, 1.0),
        ([1.0] * 40, 1 / 20_000),  # the given signs are among those that are drawn: p is never 0
    ],
)
def test_the_test_counts_all_signs(differences, p):
    assert sign_test(differences)[2] == p


@pytest.mark.parametrize("count", [3, 6, 20])
def test_an_interval_holds_the_shifts_that_the_test_does_not_refuse(count):
    """Its ends are found without trying shifts; too few participants exclude nothing."""
    given = np.random.default_rng(count).normal(1.4, 0.3, count)
    low, high, _ = sign_test(given)
    assert np.isfinite([low, high]).all() == (count >= 6)
    for end, outwards in ((low, -1e-6), (high, 1e-6)):
        if count >= 6:
            assert sign_test(given - end - outwards)[2] <= 0.05 < sign_test(given - end + outwards)[2]


def test_conditions_are_summed_up_with_durations_that_count_draws_as_longer():
    games = [
        game("A", "x", won=True, seconds=10.0, decided=True),
        game("A", "x", won=False, seconds=30.0, decided=False),
        game("B", "x", won=False, seconds=20.0, decided=True),
        game("B", "y", won=False, seconds=30.0, decided=False),
    ]
    x, y = conditions(games)
    assert (x.condition, x.participants, x.games, x.win_rate) == ("x", 2, 3, pytest.approx(1 / 3))
    assert (x.median_s, x.restricted_mean_s) == (20.0, pytest.approx(20.0))
    assert (y.median_s, y.restricted_mean_s) == (None, 30.0)
    wins, lengths = compare(games)
    assert (wins.first, wins.second, wins.participants, wins.difference) == ("x", "y", 1, 0.0)
    assert (lengths.measure, lengths.difference) == ("restricted_mean_s", -10.0)
    assert compare(games[:2]) == []
    undecided = [game("A", "x", won=False, seconds=10.0, decided=False), game("A", "y", True, 40.0, decided=True)]
    assert compare(undecided)[1].difference == 0.0, "it would have lasted as long as the longest of all conditions"


def test_the_interval_of_wins_widens_as_participants_differ():
    alike, apart = [[True, False] * 3] * 8, [[True] * 6] * 4 + [[False] * 6] * 4
    low, high = win_interval(alike)
    assert (low, high) == pytest.approx(wilson(24, 48))
    assert win_interval(apart)[0] < low < 0.5 < high < win_interval(apart)[1]
    assert win_interval([[True] * 6] * 8) == pytest.approx(wilson(48, 48))
    assert win_interval([[True, True, False]]) == pytest.approx(win_interval([[True] * 4 + [False] * 2]))
