from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.errors import CommandError
from swarm_pz.evaluation.ratings import SCALE, Results, intransitivity, rate, strengths


def field(shares: dict[tuple[int, int], float], pairs: int, names: tuple[str, ...]) -> Results:
    """Make a round robin in which i takes a share of each pair's two points from j."""
    points = {
        pairing: np.array([[2.0 if k < round(share * pairs) else 0.0, 2.0] for k in range(pairs)])
        for pairing, share in shares.items()
    }
    return Results(names, points)


def test_strengths_maximise_the_likelihood():
    rng = np.random.default_rng(0)
    points = rng.uniform(1.0, 9.0, (4, 4))
    np.fill_diagonal(points, 0.0)
    r = strengths(points)
    counts = points
    expected = (counts + counts.T) / (1 + np.exp(r[None, :] - r[:, None]))
    # At the maximum each player's points are what the model expects.
    np.testing.assert_allclose(counts.sum(axis=1), expected.sum(axis=1) - np.diag(expected), rtol=1e-5)


def test_four_hundred_points_are_odds_of_ten_to_one():
    ratings = rate(field({(0, 1): 10 / 11}, 1100, ("strong", "weak")), anchor="weak")
    assert ratings.values[1] == pytest.approx(1000.0)
    assert ratings.values[0] == pytest.approx(1400.0, abs=3)
    assert ratings.low[0] < ratings.values[0] < ratings.high[0]
    assert ratings.high[0] - ratings.low[0] == pytest.approx(
        2 * 1.96 * SCALE * np.sqrt(1 / (1100 * 10 / 121)), rel=0.15
    )


def test_who_never_loses_has_a_finite_rating():
    ratings = rate(field({(0, 1): 1.0}, 10, ("always", "never")))
    assert np.isfinite(ratings.values).all()
    assert ratings.values[0] > ratings.values[1] + 400


def test_intervals_are_not_certain_of_what_always_came_out_the_same():
    ratings = rate(field({(0, 1): 1.0}, 20, ("always", "never")), anchor="never")
    assert ratings.low[0] < ratings.values[0] - 100
    assert ratings.high[0] > ratings.values[0] + 100


def test_what_chance_alone_would_show_is_said():
    rng = np.random.default_rng(0)
    names = tuple("abcdefgh")
    even = {(i, j): rng.binomial(20, 0.5) / 20 for i in range(8) for j in range(i + 1, 8)}
    found = intransitivity(field(even, 20, names))
    assert found.expected > 0.3
    game = intransitivity(field({(0, 1): 0.8, (1, 2): 0.8, (0, 2): 0.2}, 100, ("a", "b", "c")))
    assert game.cyclic_share > game.expected + 0.3


def test_a_ladder_is_transitive_and_rock_paper_scissors_is_not():
    names = ("a", "b", "c")
    ladder = intransitivity(field({(0, 1): 0.75, (1, 2): 0.75, (0, 2): 0.9}, 100, names))
    assert (ladder.cycles, ladder.triples, ladder.strongest) == (0, 1, ())
    assert ladder.cyclic_share < 0.01
    game = intransitivity(field({(0, 1): 0.8, (1, 2): 0.8, (0, 2): 0.2}, 100, names))
    assert (game.cycles, game.triples, game.strongest) == (1, 1, ("a", "b", "c"))
    assert game.cyclic_share == pytest.approx(1.0)


def test_the_strongest_cycle_is_the_one_whose_closest_pairing_is_the_clearest():
    # 0 beats 2 beats 1 beats 0 by 0.7 at least, and 3 beats 5 beats 4 beats 3 by 0.65 and 0.9 and 0.9.
    shares = {(i, j): 0.5 for i in range(6) for j in range(i + 1, 6)}
    shares |= {(0, 2): 0.7, (1, 2): 0.3, (0, 1): 0.3, (3, 5): 0.65, (4, 5): 0.1, (3, 4): 0.1}
    found = intransitivity(field(shares, 100, tuple("abcdef")))
    assert (found.cycles, found.triples, found.strongest) == (2, 2, ("a", "c", "b"))


def test_without_an_anchor_the_mean_is_1000_and_the_seed_is_the_bootstraps():
    results = field({(0, 1): 0.75, (1, 2): 0.5, (0, 2): 0.8}, 20, ("a", "b", "c"))
    one, again, other = rate(results), rate(results), rate(results, seed=1)
    assert one.values.mean() == pytest.approx(1000.0)
    np.testing.assert_array_equal(one.low, again.low)
    np.testing.assert_array_equal(one.values, other.values)
    assert (one.low != other.low).all()


def test_before_any_loss_half_a_point_is_everybodys():
    # One against one, 4 of 4: odds of (4 + 1/2) to (1/2).
    ratings = rate(field({(0, 1): 1.0}, 2, ("always", "never")), anchor="never")
    assert ratings.values[0] == pytest.approx(1000.0 + 400.0 * np.log10(9.0), abs=1e-3)


def test_one_player_has_no_rating():
    with pytest.raises(CommandError, match="at least two players"):
        rate(Results(("alone",), {}))


@pytest.mark.parametrize(("share", "decided"), [(0.58, 0), (0.62, 1)])
def test_only_what_is_95_percent_sure_is_decided(share, decided):
    # Of 100 games each: Wilson's intervals begin at 0.48 and 0.52.
    found = intransitivity(field({(0, 1): share, (1, 2): share, (0, 2): 1 - share}, 50, ("a", "b", "c")))
    assert (found.cycles, found.triples) == (decided, decided)


def test_an_anchor_that_nobody_is_is_refused():
    with pytest.raises(CommandError, match="did you mean 'strong'"):
        rate(field({(0, 1): 0.5}, 10, ("strong", "weak")), anchor="strnog")


def test_a_pairing_without_games_is_refused():
    with pytest.raises(CommandError, match="games between every two"):
        rate(
            Results(
                ("a", "b", "c"), {(0, 1): np.array([[1.0, 2.0]]), (0, 2): np.zeros((0, 2)), (1, 2): np.zeros((0, 2))}
            )
        )
