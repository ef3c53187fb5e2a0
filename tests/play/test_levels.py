"""Levels of people: right as often as they say, and found with few games."""

import math

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.evaluation.ratings import SCALE
from swarm_pz.play.levels import AS_NEAR, PRIOR_MEAN, PRIOR_SD, RUNGS, Met, Rung, chance, level_of, next_rung


def play(level, games, generator, choose=next_rung, draws=0.0):
    """Return somebody's games, of which draws take a share from wins and losses alike: the mean is the model's."""
    met = []
    for _ in range(games):
        rung = choose(met)
        won = chance(level, rung.rating)
        drawn = draws * 2.0 * min(won, 1.0 - won)
        points = generator.choice([0.0, 0.5, 1.0], p=[1.0 - won - drawn / 2, drawn, won - drawn / 2])
        met.append(Met(rung.name, rung.rating, float(points)))
    return met


def test_the_rungs_are_policies_each_rated_above_the_one_before():
    assert (RUNGS[0].name, RUNGS[-1].name) == ("corners", "champion")
    assert sorted(RUNGS, key=lambda rung: rung.rating) == list(RUNGS)
    assert {rung.name for rung in RUNGS} <= set(policies.names())


def test_a_level_is_the_mean_of_the_posterior():
    """Summed over another grid, in plain loops."""
    assert (chance(1000.0, 1000.0), chance(1400.0, 1000.0)) == (0.5, pytest.approx(10 / 11))
    games = [Met("a", 900.0, 1.0), Met("b", 1100.0, 0.5), Met("c", 1300.0, 0.0)]
    total = mean = 0.0
    for level in np.linspace(-1000.0, 4000.0, 20_001):
        weight = math.exp(-0.5 * ((level - PRIOR_MEAN) / PRIOR_SD) ** 2)
        for _, rating, points in games:
            won = 1.0 / (1.0 + math.exp((rating - level) / SCALE))
            weight *= won**points * (1.0 - won) ** (1.0 - points)
        total, mean = total + weight, mean + weight * level
    assert level_of(games).value == pytest.approx(mean / total, abs=0.05)


def test_without_games_a_level_is_what_is_likely_of_anybody_and_whoever_wins_or_loses_everything_has_one():
    level = level_of([])
    assert level.value == pytest.approx(PRIOR_MEAN, abs=0.5)
    assert (level.low, level.high) == pytest.approx((PRIOR_MEAN - 1.96 * PRIOR_SD, PRIOR_MEAN + 1.96 * PRIOR_SD), abs=5)
    for points, rung in ((1.0, RUNGS[-1]), (0.0, RUNGS[0])):
        level = level_of([Met(rung.name, rung.rating, points)] * 200)
        assert -500 < level.low < level.value < level.high < 3500


def anybody(generator):
    return lambda _: RUNGS[generator.integers(len(RUNGS))]


@pytest.mark.parametrize(("games", "draws", "most"), [(20, 0.0, 393 / 400), (15, 0.4, 1.0)])
def test_intervals_of_simulated_people_hold_their_level_as_often_as_they_say(games, draws, most):
    """Of 400 people 95 % are 380, and by chance 367 to 393 (three standard errors); with draws they may be wider."""
    generator = np.random.default_rng(games)
    hits, errors = 0, []
    for level in generator.normal(PRIOR_MEAN, PRIOR_SD, 400):
        found = level_of(play(level, games, generator, anybody(generator), draws))
        hits += found.low <= level <= found.high
        errors.append(found.value - level)
    assert 367 / 400 <= hits / 400 <= most
    assert abs(np.mean(errors)) < 20


def test_chosen_opponents_tell_more_than_any():
    """The interval after 20 games, of people at each level."""
    generator = np.random.default_rng(0)

    def width(choose):
        levels = generator.normal(PRIOR_MEAN, PRIOR_SD, 80)
        found = [level_of(play(level, 20, generator, choose)) for level in levels]
        return np.mean([level.high - level.low for level in found])

    assert width(next_rung) < 0.97 * width(anybody(generator))


def test_nobody_is_met_three_times_running_while_another_is_about_as_near():
    assert next_rung([]).name == "uniform"
    assert next_rung([], [Rung("only", 2000.0)]).name == "only"
    generator = np.random.default_rng(3)
    for level in (700.0, 1000.0, 1205.0):
        games = play(level, 30, generator)
        for number in range(2, len(games)):
            now = level_of(games[:number]).value
            far = sorted(abs(rung.rating - now) for rung in RUNGS)
            is_alone = far[1] > far[0] + AS_NEAR
            assert is_alone or len({game.opponent for game in games[number - 2 : number + 1]}) > 1
