"""What an analysis finds: the difference that was planted, and none where none was."""

import numpy as np
import pytest

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.play.studies.analysis import StudyGame, compare, conditions, interval, sign_test, win_interval


def simulated(seed, gain, participants=8, games=6):
    """Return a study in which persons differ, and win more often under the first condition by `gain` in the mean."""
    chance = np.random.default_rng(seed)
    skills = chance.uniform(0.2, 0.6, participants)
    played = []
    for person, skill in enumerate(skills):
        for condition, more in (("drawing", gain), ("pointing", 0.0)):
            for _ in range(games):
                won = bool(chance.random() < skill + more)
                seconds = float(np.clip(chance.exponential(60.0 if won else 200.0), 1.0, 300.0))
                played.append(
                    StudyGame(
                        participant=f"P{person}", condition=condition, won=won, seconds=seconds, decided=seconds < 300.0
                    )
                )
    return played


def of_wins(games):
    return next(one for one in compare(games) if one.measure == "win_rate")


def test_a_planted_difference_is_found_and_none_where_none_was_planted():
    planted = [of_wins(simulated(seed, 0.4)) for seed in range(50)]
    assert sum(one.p <= 0.05 for one in planted) >= 45
    assert sum(one.low <= 0.4 <= one.high for one in planted) >= 45
    nothing = [of_wins(simulated(seed, 0.0)) for seed in range(50)]
    assert sum(one.p <= 0.05 for one in nothing) <= 5
    assert sum(one.low <= 0.0 <= one.high for one in nothing) >= 45


def test_the_test_counts_all_signs():
    assert sign_test([1.0, 1.0, 1.0]) == 2 / 8
    assert sign_test([1.0, -1.0]) == 1.0
    assert sign_test([0.0] * 5) == 1.0
    assert sign_test([1.0] * 8) == 2 / 256
    assert sign_test(np.ones(40)) == 1 / 20_000, "the given signs are among those that are drawn: p is never 0"


def test_few_participants_exclude_nothing():
    assert interval([1.0, 2.0, 1.5]) == (-np.inf, np.inf)
    low, high = interval([1.0, 2.0, 1.5, 1.2, 1.8, 1.4, 1.6, 1.1])
    assert 1.0 < low < 1.45 < high < 2.0


def test_conditions_are_summed_up_with_durations_that_count_draws_as_longer():
    games = [
        StudyGame(participant="A", condition="x", won=True, seconds=10.0, decided=True),
        StudyGame(participant="A", condition="x", won=False, seconds=30.0, decided=False),
        StudyGame(participant="B", condition="x", won=False, seconds=20.0, decided=True),
        StudyGame(participant="B", condition="y", won=False, seconds=30.0, decided=False),
    ]
    x, y = conditions(games)
    assert (x.condition, x.participants, x.games, x.win_rate) == ("x", 2, 3, pytest.approx(1 / 3))
    assert (x.median_s, x.restricted_mean_s) == (20.0, pytest.approx(20.0))
    assert (y.median_s, y.restricted_mean_s) == (None, 30.0)
    wins, lengths = compare(games)
    assert (wins.first, wins.second, wins.participants, wins.difference) == ("x", "y", 1, 0.0)
    assert lengths.difference == -10.0
    assert compare(games[:2]) == []


def test_a_game_that_nobody_won_counts_as_the_longest_of_all_conditions():
    games = [
        StudyGame(participant="A", condition="x", won=False, seconds=10.0, decided=False),
        StudyGame(participant="A", condition="y", won=True, seconds=40.0, decided=True),
    ]
    lengths = compare(games)[1]
    assert (lengths.measure, lengths.difference) == ("restricted_mean_s", 0.0)


@pytest.mark.parametrize("differences", [[], [np.nan], [[1.0]]])
def test_what_is_no_list_of_differences_is_refused(differences):
    with pytest.raises(ResultsError, match="at least one finite difference"):
        sign_test(differences)


def test_the_interval_of_wins_widens_as_participants_differ():
    alike, apart = [[True, False] * 3] * 8, [[True] * 6] * 4 + [[False] * 6] * 4
    low, high = win_interval(alike)
    assert (low, high) == pytest.approx(wilson(24, 48))
    assert win_interval(apart)[0] < low < 0.5 < high < win_interval(apart)[1]
    assert win_interval([[True] * 6] * 8) == pytest.approx(wilson(48, 48))
    assert win_interval([[True, True, False]]) == pytest.approx(win_interval([[True] * 4 + [False] * 2]))
