"""The analysis finds a planted difference, and none where none was planted."""

from dataclasses import fields

import numpy as np
import pytest

from swarm_pz.evaluation.intervals import wilson
from swarm_pz.play.studies.analysis import compare_pairs, conditions, factor_effects, values_of, win_interval
from swarm_pz.play.studies.rows import GameRow


def game(participant, condition, won, seconds, decided):
    """Return a game that counts, whose other columns are None."""
    unknown = dict.fromkeys((column.name for column in fields(GameRow)), None)
    known = {"participant": participant, "condition": condition, "won": won, "seconds": seconds, "decided": decided}
    return GameRow(**unknown | known)


def simulated(seed, gain):
    """Compare the wins of a study in which persons differ, and win more often under the first condition by `gain`."""
    chance = np.random.default_rng(seed)
    skills = chance.uniform(0.2, 0.6, 8)
    shares = {"drawing": chance.binomial(9, skills + gain) / 9, "pointing": chance.binomial(9, skills) / 9}
    (effect,) = compare_pairs(
        "win_rate", {title: dict(zip("ABCDEFGH", of, strict=True)) for title, of in shares.items()}
    )
    return effect


def test_a_planted_difference_is_found_and_none_where_none_was_planted():
    planted, nothing = ([simulated(seed, gain) for seed in range(50)] for gain in (0.4, 0.0))
    assert sum(one.p <= 0.05 for one in planted) >= 45
    assert sum(one.low <= 0.4 <= one.high for one in planted) >= 45
    assert sum(one.p <= 0.05 for one in nothing) <= 5
    assert sum(one.low <= 0.0 <= one.high for one in nothing) >= 45


FACTOR = {"factor": {"y": "1", "x": "2"}}


def within(differences):
    """Return the effect of a factor within people, x less y, from each person's difference."""
    people = [f"P{number:02d}" for number in range(len(differences))]
    (effect,) = factor_effects(
        "m", {"y": dict.fromkeys(people, 0.0), "x": dict(zip(people, differences, strict=True))}, FACTOR
    )
    return effect


def between(first, second):
    """Return the effect of a factor between people: the second group less the first."""
    groups = [
        {f"{title}{number}": value for number, value in enumerate(own)}
        for title, own in zip("yx", (first, second), strict=True)
    ]
    (effect,) = factor_effects("m", dict(zip("yx", groups, strict=True)), FACTOR, ("factor",))
    return effect


@pytest.mark.parametrize(
    ("differences", "p"),
    [
        ([1.0, 1.0, 1.0], 2 / 8),
        ([1.0, -1.0], 1.0),
        ([0.0] * 5, 1.0),
        ([1.0] * 40, 1 / 20_000),  # the observed signs count as one of the draws, so p is never 0
    ],
)
def test_the_test_counts_all_signs(differences, p):
    assert within(differences).p == p


@pytest.mark.parametrize("count", [3, 6, 20])
def test_an_interval_holds_the_shifts_that_the_test_does_not_refuse(count):
    """The ends are computed without trying shifts; too few participants exclude nothing."""
    differences = np.random.default_rng(count).normal(1.4, 0.3, count)
    effect = within(differences)
    assert np.isfinite([effect.low, effect.high]).all() == (count >= 6)
    for end, outwards in ((effect.low, -1e-6), (effect.high, 1e-6)):
        if count >= 6:
            assert within(differences - end - outwards).p <= 0.05 < within(differences - end + outwards).p


def test_between_people_they_are_exchanged_among_groups():
    first, second = np.array([0.0, 1.0, 2.0]), np.array([3.0, 4.0, 7.0])
    effect = between(first, second)
    assert (effect.difference, effect.p, effect.participants) == (pytest.approx(14 / 3 - 1), 2 / 20, 6)
    assert (effect.low, effect.high) == (-np.inf, np.inf), "20 ways to choose a group exclude nothing at 5 %"
    second = np.array([5.0, 6.0, 7.0, 9.0, 9.5])
    effect = between(first, second)
    for end, outwards in ((effect.low, -1e-6), (effect.high, 1e-6)):
        assert between(first, second - end - outwards).p <= 0.05 < between(first, second - end + outwards).p


def test_main_effects_and_interactions_of_a_factorial_design_are_those_by_hand():
    factors = {"delay": dict(zip("abcd", "0033", strict=True)), "view": dict(zip("abcd", "fhfh", strict=True))}
    cells = np.random.default_rng(1).normal((4.0, 3.0, 2.0, 0.0), 1.0, (7, 4))
    values = {title: {f"P{number}": cells[number, place] for number in range(7)} for place, title in enumerate("abcd")}
    values["a"]["P9"] = 100.0  # met only one condition, so shows no effect
    effects = {one.effect: one for one in factor_effects("m", values, factors)}
    for effect, weights in (
        ("delay", [-0.5, -0.5, 0.5, 0.5]),
        ("view", [-0.5, 0.5] * 2),
        ("delay x view", [1, -1, -1, 1]),
    ):
        own, one = cells @ weights, effects[effect]
        signs = np.array(list(np.ndindex((2,) * 7))) * 2 - 1
        as_large = np.abs((signs * own).mean(axis=1)) >= abs(own.mean()) - 1e-12
        assert (one.difference, one.p) == (pytest.approx(own.mean()), as_large.mean())
        assert (one.participants, one.degrees) == (7, 1)
    (three,) = factor_effects(
        "m", {title: values[title] for title in "abc"}, {"kind": dict(zip("abc", "abc", strict=True))}
    )
    means = np.array([(cells[:, :3] * sign[:, None]).mean(axis=0) for sign in signs])
    means -= means.mean(axis=1, keepdims=True)
    size = (means**2).sum(axis=1)
    assert (three.degrees, three.difference, three.p) == (2, None, (size >= size[-1] - 1e-12).mean())


def test_of_a_mixed_design_an_interaction_exchanges_people_and_the_effect_within_flips_signs():
    factors = {"group": dict(zip("abcd", "1122", strict=True)), "view": dict(zip("abcd", "fhfh", strict=True))}
    steps = np.array([[1.0, 2.0, 1.5, 1.2], [4.0, 5.0, 4.5, 4.2]])  # of view, by group
    values = {title: {} for title in "abcd"}
    for (group, place), step in np.ndenumerate(steps):
        values["ac"[group]][f"P{group}{place}"], values["bd"[group]][f"P{group}{place}"] = (
            10.0 * place,
            10.0 * place + step,
        )
    effects = {one.effect: one for one in factor_effects("m", values, factors, ("group",))}
    assert effects["view"].difference == pytest.approx(steps.mean()) and effects["view"].p == 2 / 2**8
    assert effects["group x view"].difference == pytest.approx(3.0) and effects["group x view"].p == 2 / 70
    assert effects["group"].difference == pytest.approx(1.5)


def test_pairs_are_corrected_by_holm():
    people = [f"P{number}" for number in range(8)]
    chance = np.random.default_rng(2)
    values = {
        title: dict(zip(people, chance.normal(mean, 1.0, 8), strict=True))
        for title, mean in (("a", 0), ("b", 1), ("c", 4))
    }
    effects = compare_pairs("m", values)
    assert [one.effect for one in effects] == ["a less b", "a less c", "b less c"]
    ordered = sorted(effects, key=lambda one: one.p)
    assert ordered[0].p_holm == min(3 * ordered[0].p, 1.0)
    assert ordered[1].p_holm == max(ordered[0].p_holm, min(2 * ordered[1].p, 1.0))
    assert ordered[2].p_holm == max(ordered[1].p_holm, ordered[2].p)
    groups = {"a": values["a"], "b": {f"Q{number}": value for number, value in enumerate(values["b"].values())}}
    assert compare_pairs("m", groups)[0].participants == 16, "nobody met both: they are two groups"


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
    values = values_of(games)
    assert values["win_rate"] == {"x": {"A": 0.5, "B": 0.0}, "y": {"B": 0.0}}
    assert values["restricted_mean_s"] == {"x": {"A": 20.0, "B": 20.0}, "y": {"B": 30.0}}
    assert compare_pairs("win_rate", values_of(games[:2])["win_rate"]) == []
    undecided = [game("A", "x", won=False, seconds=10.0, decided=False), game("A", "y", True, 40.0, decided=True)]
    lengths = values_of(undecided)["restricted_mean_s"]
    assert lengths["x"] == lengths["y"], "it would have lasted as long as the longest of all conditions"


def test_the_interval_of_wins_widens_as_participants_differ():
    alike, apart = [[True, False] * 3] * 8, [[True] * 6] * 4 + [[False] * 6] * 4
    low, high = win_interval(alike)
    assert (low, high) == pytest.approx(wilson(24, 48))
    assert win_interval(apart)[0] < low < 0.5 < high < win_interval(apart)[1]
    assert win_interval([[True] * 6] * 8) == pytest.approx(wilson(8, 8)), "nothing shows that they are worth more"
    assert win_interval([[False] * 2] * 2) == pytest.approx(wilson(0, 2))
    assert win_interval([[True, True, False]]) == pytest.approx(win_interval([[True] * 4 + [False] * 2]))
