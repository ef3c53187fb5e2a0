"""Ratings follow the Bradley-Terry model, the cycles it misses are measured, and clones change no Nash average."""

import numpy as np
import pytest

from swarm_pz.evaluation.ratings import SCALE, Results, intransitivity, nash_average, rate, strengths


def field(shares, pairs, names):
    """Make a round robin in which i takes both points from j in a share of their pairs of games."""
    points = {
        pairing: np.array([[2.0 if k < round(share * pairs) else 0.0, 2.0] for k in range(pairs)])
        for pairing, share in shares.items()
    }
    return Results(tuple(names), points)


def test_strengths_maximise_the_likelihood():
    points = np.random.default_rng(0).uniform(1.0, 9.0, (4, 4))
    np.fill_diagonal(points, 0.0)
    r = strengths(points)
    expected = (points + points.T) / (1 + np.exp(r[None, :] - r[:, None]))
    # At the maximum each player's points are what the model expects.
    np.testing.assert_allclose(points.sum(axis=1), expected.sum(axis=1) - np.diag(expected), rtol=1e-5)


def test_four_hundred_points_are_odds_of_ten_to_one():
    rated = rate(field({(0, 1): 10 / 11}, 1100, ("strong", "weak")), anchor="weak")
    assert rated.values == pytest.approx([1400.0, 1000.0], abs=3)
    width = 2 * 1.96 * SCALE * np.sqrt(1 / (1100 * 10 / 121))
    assert rated.low[0] < rated.values[0] < rated.high[0]
    assert rated.high[0] - rated.low[0] == pytest.approx(width, rel=0.15)


def test_a_player_without_a_loss_has_a_finite_rating_and_no_certain_interval():
    # Four of four: odds of (4 + 1/2) to (1/2), by the prior.
    rated = rate(field({(0, 1): 1.0}, 2, ("always", "never")), anchor="never")
    assert rated.values[0] == pytest.approx(1000.0 + 400.0 * np.log10(9.0), abs=1e-3)
    assert rated.low[0] + 100 < rated.values[0] < rated.high[0] - 100


def test_without_an_anchor_the_mean_is_1000_and_intervals_repeat(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 40)
    results = field({(0, 1): 0.75, (1, 2): 0.5, (0, 2): 0.8}, 20, "abc")
    one, again = rate(results), rate(results)
    assert one.values.mean() == pytest.approx(1000.0)
    assert one.low.tolist() == again.low.tolist()


@pytest.mark.parametrize(
    ("shares", "found"),
    [
        ({(0, 1): 0.75, (1, 2): 0.75, (0, 2): 0.9}, (0, 1, ())),
        # Of 100 games each, Wilson's intervals begin at 0.48 and at 0.52.
        ({(0, 1): 0.58, (1, 2): 0.58, (0, 2): 0.42}, (0, 0, ())),
        ({(0, 1): 0.62, (1, 2): 0.62, (0, 2): 0.38}, (1, 1, ("a", "b", "c"))),
        # a beats c beats b beats a by 0.7 at least, and d beats f beats e beats d by 0.65, 0.9 and 0.9.
        (
            {(i, j): 0.5 for i in range(6) for j in range(i + 1, 6)}
            | {(0, 2): 0.7, (1, 2): 0.3, (0, 1): 0.3, (3, 5): 0.65, (4, 5): 0.1, (3, 4): 0.1},
            (2, 2, ("a", "c", "b")),
        ),
    ],
    ids=["ladder", "undecided", "decided", "two cycles"],
)
def test_cycles_among_decided_pairings_are_counted(shares, found):
    measured = intransitivity(field(shares, 50, "abc" if len(shares) == 3 else "abcdef"))
    assert (measured.cycles, measured.triples, measured.strongest) == found


def test_the_cyclic_share_is_told_beside_what_chance_would_give():
    ladder = intransitivity(field({(0, 1): 0.75, (1, 2): 0.75, (0, 2): 0.9}, 100, "abc"))
    game = intransitivity(field({(0, 1): 0.8, (1, 2): 0.8, (0, 2): 0.2}, 100, "abc"))
    assert ladder.cyclic_share < 0.01 and game.cyclic_share == pytest.approx(1.0)
    assert game.cyclic_share > game.expected + 0.3
    generator = np.random.default_rng(0)
    even = {(i, j): generator.binomial(20, 0.5) / 20 for i in range(8) for j in range(i + 1, 8)}
    assert intransitivity(field(even, 20, "abcdefgh")).expected > 0.3


@pytest.mark.parametrize(
    ("shares", "mixture", "skills"),
    [
        ([[0.5, 1.0, 0.0], [0.0, 0.5, 1.0], [1.0, 0.0, 0.5]], [1 / 3, 1 / 3, 1 / 3], [0.0, 0.0, 0.0]),
        ([[np.nan, 0.6, 0.9], [0.4, np.nan, 1.0], [0.1, 0.0, np.nan]], [1.0, 0.0, 0.0], [0.0, -0.1, -0.4]),
        # Any mixture is an equilibrium: a solver's own choice would be one player.
        (np.full((4, 4), 0.5), [0.25] * 4, [0.0] * 4),
        ([[np.nan]], [1.0], [0.0]),
        # The second draws with both others: it has skill 0, but no share, since the third gains from it.
        ([[0.5, 0.5, 1.0], [0.5, 0.5, 0.5], [0.0, 0.5, 0.5]], [1.0, 0.0, 0.0], [0.0, 0.0, -0.5]),
    ],
    ids=["cycle", "dominant", "all equal", "alone", "never lost"],
)
def test_nash_mixtures_are_those_of_games_solved_by_hand(shares, mixture, skills):
    """Catches a wrong sign or transposition, which would put the mixture on the losers."""
    found = nash_average(np.array(shares))
    np.testing.assert_allclose(found, [mixture, skills], atol=1e-7)


@pytest.mark.parametrize(
    ("steps", "seed"),
    [(40, 0), (2, 7), (2, 11)],
    ids=["one equilibrium", "several", "infeasible by rounding"],
)
def test_eight_clones_change_ranks_by_ratings_but_none_by_nash_averaging(steps, seed):
    """Catches ranks that depend on copies of a player, or on which equilibrium a solver chooses."""
    upper = np.triu(np.random.default_rng(seed).integers(0, steps + 1, (12, 12)) / steps, 1)
    shares = upper + np.tril(1.0 - upper.T, -1) + np.eye(12) / 2.0
    players = np.random.default_rng(1).permutation([*range(12), *[0] * 8])
    cloned = np.where(players[:, None] == players, 0.5, shares[np.ix_(players, players)])
    first = np.array([list(players).index(player) for player in range(12)])
    mixture, skills = nash_average(cloned)
    assert mixture.min() >= 0.0 and mixture.sum() == pytest.approx(1.0) and skills.max() < 1e-6
    np.testing.assert_allclose(skills[first], nash_average(shares)[1], atol=1e-6)
    assert np.ptp(mixture[players == 0]) < 1e-6
    rated, again = (strengths((40.0 * table + 0.5) * (1.0 - np.eye(len(table)))) for table in (shares, cloned))
    assert np.argsort(rated).tolist() != np.argsort(again[first]).tolist()
