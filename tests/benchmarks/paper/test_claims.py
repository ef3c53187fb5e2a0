"""Claims about games and about teams alone: each statistic on data with a result known by hand."""

from __future__ import annotations

import importlib
import itertools
import re
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from benchmarks.paper import coverage
from benchmarks.paper.claims import (
    FIGURES,
    bunching_up,
    capture_geometry,
    flocking_comparison,
    permutation_invariance,
    team_sizes,
    wavefront,
)
from benchmarks.paper.coverage import ErgodicMetric
from benchmarks.paper.drawings import painted
from benchmarks.paper.figure import Setting, verdict
from benchmarks.paper.players import Captures, Ensemble, Fixed, Person, most_within, player, shaped
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Game, Rollout
from swarm_pz.simulator import Simulator

SEED = 3
SETTING, RELEASED = Setting("paper", SEED), Setting("released", SEED)


# --- data that deny a claim -----------------------------------------------------------------------------


def games_of(outcome, sizes):
    """Return a `play_games` whose games are all alike, of 30 s and with one capture."""
    return lambda policy, opponent, numbers, **_: [
        Game(
            pair=number,
            side="red",
            outcome=outcome,
            share=0.0,
            seconds=30.0,
            captures=1,
            recaptures=0,
            fingerprint=b"",
            sizes=sizes,
        )
        for number in numbers
    ]


def in_a_corner(*_):
    """Return flights of teams that stay in a corner."""
    return SimpleNamespace(
        metric=np.ones((2, coverage.SECONDS)),
        places=np.full((2, 10, 3, 2), 0.01),
        maps=lambda cells: np.full((2, cells, cells), cells**-2.0),
    )


def no_turns(games):
    return SimpleNamespace(totals=[[np.zeros(2, int)] * 100 + [np.full(2, 20)]] * games)


def other_order(*_):
    metric = np.ones((10 * coverage.JUDGED, 2, 2))
    metric[:, 0] = 0.5
    return metric, np.ones((10 * coverage.JUDGED, 2))


SHARES = itertools.cycle((0.0, 1.0, 0.0))
"""Time near both spots: with one drawing, with one attractor, with attractors in turn."""


DENIED = {
    "capture_geometry": {"probe": lambda *_: (np.ones((50, 50)), np.zeros((50, 50), bool))},
    "scale_invariance": {"fly": in_a_corner},
    "permutation_invariance": {
        **dict.fromkeys(("start", "permuted"), lambda *_: Mock()),
        "distance": lambda *_: np.ones(2),
        "fly_both": other_order,
    },
    "fluctuation": {"fly": lambda *_: np.ones((2, coverage.SECONDS))},
    "ensemble_tactic": {"play_games": games_of("loss", [10, 8, 0])},
    "team_sizes": {"play_games": games_of("win", [10, 10, 20]), "Captures": no_turns},
    "flocking_comparison": {
        **dict.fromkeys(("Flight", "flock", "start"), in_a_corner),
        "spreads": lambda *_: np.ones((2, 3)),
        "best_schedule": lambda *_: (4, 2),
        "times_near": lambda *_: np.full((2, 2), next(SHARES)),
    },
    "adversary": {"play_games": games_of("win", [10, 20])},
    "bunching_up": {"play": lambda *_: (np.zeros(10, bool), np.ones(10))},
    "wavefront": {"counts": lambda *_: (np.ones((10, 3)), np.zeros((10, 2)))},
    "comebacks": {"play_games": games_of("loss", [1, 0]), "installed": lambda *_: ["ring"]},
}
"""For each claim, made-up measurements in which it is false."""


@pytest.mark.parametrize("name", FIGURES)
def test_a_claim_that_is_false_in_the_data_is_not_reproduced(name, monkeypatch):
    module = importlib.import_module(f"benchmarks.paper.claims.{name}")
    for attribute, data in DENIED[name].items():
        monkeypatch.setattr(module, attribute, data)
    parts = FIGURES[name].measure(Setting("paper", SEED, 0.2)).parts
    assert {part.answer for part in parts if not part.ours} <= {"no", "undecided"}
    assert re.match("not reproduced|never seen|undecided", verdict(parts))


# --- what stands still captures -------------------------------------------------------------------------


def test_drones_that_stand_still_capture_by_either_field():
    for setting in (SETTING, RELEASED):
        field, captured = capture_geometry.probe([(7, 7)], capture_geometry.still(setting.config))
        assert field.max() == 1.0 and captured.any()


@pytest.mark.parametrize(("centre", "cells"), [((9, 9), 16), ((49, 25), 9), ((1, 1), 7)])
def test_walls_shorten_the_ring_around_a_cell(centre, cells):
    ring = capture_geometry.ring_around(centre)
    assert len(ring) == len(set(ring)) == cells
    assert all(max(abs(x - centre[0]), abs(y - centre[1])) == 2 for x, y in ring)


# --- who wins --------------------------------------------------------------------------------------------


def test_the_tactic_of_two_commands_stays_in_the_centre_until_one_drone_is_left():
    config, rows = GameConfig(), np.arange(2)
    images = np.zeros((2, 2, 25, 25), np.uint8)
    images[:, 0, 4, 20] = 64  # at the right, near the bottom
    images[:, 1] = np.array([round(255 * 18 / 20), round(255 * 19 / 20)])[:, None, None]
    make = shaped(config)
    tracking, staying = (Ensemble(config, make, last).act(images, rows) for last in (1, 0))
    np.testing.assert_array_equal(tracking[0], staying[0])
    np.testing.assert_array_equal(staying[0], staying[1])
    np.testing.assert_allclose(staying[0], staying[0][::-1, ::-1])
    assert np.unravel_index(tracking[1].argmax(), (10, 10)) == (1, 8)


# --- how sizes change ------------------------------------------------------------------------------------


LATE, EARLY = [10, 12, 9, 11, 8, 9, 8, 9, 11, 15, 20], [10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20]
"""Sizes of a team whose lead is gone within seconds, and of one that leads from the start."""
CALM = [4 * (second // 20) for second in range(101)] + [20 + (second // 10) for second in range(60)]
"""Captures so far: first in bursts, then steadily."""


def test_the_course_of_a_game():
    before, near = team_sizes.unsteadiness(CALM)
    assert before > near == 0.0 and team_sizes.unsteadiness([0, 1, 2]) is None
    assert team_sizes.brief_lead(LATE, 20) and not team_sizes.brief_lead(EARLY, 20)
    assert team_sizes.turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2, "equal teams do not count"


# --- what costs drones ------------------------------------------------------------------------------------


def test_rates_are_of_all_minutes_together_and_from_the_attackers_side(monkeypatch):
    class Told(Rollout):
        def play(self, after_step):
            self.simulator.games.captures[:] = [[7, 2], [1, 3]]
            self.simulator.games.ticks[:] = [1800, 900]
            after_step(self)

    monkeypatch.setattr(wavefront, "Rollout", Told)
    monkeypatch.setattr(wavefront, "GAMES", 2)
    counted, most = wavefront.counts("wavefront", "program", SETTING)
    assert counted.tolist() == [[7, 2, 1.0], [1, 3, 0.5]] and most.tolist() == [[7, 2], [1, 3]]
    assert wavefront.rates(counted[:, None]).tolist() == [[8 / 1.5, 5 / 1.5]]
    totals = [np.array(pair) for pair in ((0, 0), (1, 0), (4, 0), (5, 5), (5, 6))]
    assert most_within(totals, 2).tolist() == [4, 6] and len(Captures(3).totals) == 3


def test_blue_starts_on_the_side_of_the_square_that_it_holds_and_red_where_it_would_have():
    command = np.zeros((10, 10))
    command[1, 8] = 1.0  # y = 0.1 to 0.2, x = 0.8 to 0.9
    rollout, other = (Rollout("chase", Fixed(command), [0], seed=SEED) for _ in range(2))
    bunching_up.place_blue(rollout, command, SEED)
    np.testing.assert_array_equal(rollout.simulator.positions[:, :10], other.simulator.positions[:, :10])
    x, y = rollout.simulator.positions[0, 10:].T
    assert (x >= 0.8).all() and (x <= 0.9).all() and (y >= 0.1).all() and (y <= 0.2).all()


def test_a_team_is_lost_whole_so_many_seconds_after_its_first_loss():
    rollout = Rollout("chase", "uniform", [0, 2], seed=SEED)
    simulator = rollout.simulator
    simulator.games.positions[:, 10:] = [[0.5, 0.4], [0.5, 0.6]] * 5
    losses = bunching_up.Losses(rollout)
    for ticks, blue in ((30, 9), (60, 0)):  # the first game loses one drone after 1 s, and all after 2 s
        simulator.games.ticks[:] = ticks
        simulator.games.teams[0, : 20 - blue] = 0
        losses(rollout)
    assert losses.first.tolist() == [1.0, np.inf] and losses.last.tolist() == [2.0, np.inf]
    assert losses.whole_within(1.0).tolist() == [True, False] and not losses.whole_within(0.9).any()
    assert losses.spread[0] == pytest.approx(0.1)


class Echo:
    """A policy that returns what it sees."""

    name = "echo"
    observation = ObservationConfig()

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return np.full((len(rows), 2, 2), float(observations[0]))


def test_a_person_sends_every_third_answer_and_holds_it_until_the_next():
    player = Person(Echo())
    for _ in range(2):  # a reset starts the count again
        player.reset([0, 1], np.arange(2))
        sent = [player.act(np.full(2, step), np.arange(2))[1, 0, 0] for step in range(7)]
        assert sent == [0, 0, 0, 3, 3, 3, 6]


def test_a_person_paints_the_ground_that_a_tactic_wants_most_and_the_table_makes_the_command():
    density = np.zeros((10, 10))
    density[:, :2], density[:, 2] = 1.0, 0.4
    firm, paper, repelling = (
        painted(density, *mapping, repels=repels)
        for mapping, repels in ((("firm",), False), (("paper",), False), (("firm",), True))
    )
    assert firm[5, 0] > 0.95 and firm[5, 3] < 0.05 and repelling[5, 3] < 0.01
    assert 0.4 < paper[5, 9] / paper[5, 0] < 0.7, "ground that is left alone weighs half, and all is smoothed"
    np.testing.assert_array_equal(painted(np.full((10, 10), 0.3), "paper"), np.ones((10, 10)))
    drawn, raw = (player("centre", way, RELEASED) for way in ("person", "program"))
    images = np.zeros((1, len(raw.observation.channels), raw.observation.grid, raw.observation.grid), np.uint8)
    for one in (drawn, raw):
        one.reset([0], np.zeros(1, int))
    sent, wanted = (one.act(images, np.zeros(1, int))[0] for one in (drawn, raw))
    np.testing.assert_array_equal(sent, painted(wanted, "paper"))
    assert sent.min() > 0.4 > wanted.min()


# --- one command, any team --------------------------------------------------------------------------------


def test_a_permutation_moves_every_drone_with_all_that_is_its_own():
    simulator = Simulator(GameConfig(drones_per_team=(2, 11)), num_games=2)
    simulator.reset([0, 1])
    simulator.advance(6)
    order = np.random.default_rng(0).permutation(13)
    permuted = permutation_invariance.permuted(simulator.snapshot(), order)
    back = permutation_invariance.permuted(permuted, np.argsort(order))
    states = (games._replace(memory=games.memory[..., :13]) for games in (simulator.games, permuted, back))
    for name, one, moved, again in zip(permuted._fields, *states, strict=True):
        axes = [axis for axis, length in enumerate(one.shape) if axis and length == 13]
        np.testing.assert_array_equal(moved, np.take(one, order, axes[0]) if axes else one, name)
        np.testing.assert_array_equal(again, one, name)
    other = Simulator(simulator.config, num_games=2)
    other.restore(permuted)
    assert permutation_invariance.distance(simulator, other, order).tolist() == [0.0, 0.0]


def test_a_drone_that_is_handed_over_has_a_new_team_and_no_past_and_nobody_else_has():
    simulator = coverage.start(GameConfig(drones_per_team=3), [4, 5], bunching_up.disc(0.1, 10))
    simulator.advance(30)
    before, chosen = simulator.snapshot(), np.zeros((2, 6), bool)
    chosen[0, 1] = chosen[1, 4] = True
    coverage.hand_over(simulator, chosen)
    games = simulator.games
    np.testing.assert_array_equal(games.teams != before.teams, chosen)
    for drones, factor in ((chosen, 0.0), (~chosen, 1.0)):
        for game in range(2):
            now, then = (one.memory[game][..., np.flatnonzero(drones[game])] for one in (games, before))
            np.testing.assert_array_equal(now, factor * then)
        np.testing.assert_array_equal(games.memory_weight[drones], factor * before.memory_weight[drones])
    simulator.advance(30)
    assert simulator.occupancy.sum() == 2 * 6 * 30, "fields say what trails add up to"


# --- beside flocking --------------------------------------------------------------------------------------


def test_what_is_near_a_mode_and_when_a_metric_is_first_low_enough():
    second = np.array(flocking_comparison.MODES[1])
    squared = flocking_comparison.near_modes(np.array([[0.3, 0.4], second, [0.53, 0.53]]))
    expected = [[0.01, np.nan], [np.nan, 0.0], [np.nan, np.nan]]
    np.testing.assert_allclose(squared, expected, atol=1e-12)
    places = np.array([[[[0.4, 0.3], [0.3, 0.5], [0.99, 0.01], [0.77, 0.67]]]])
    sums = flocking_comparison.widths(SimpleNamespace(places=places))
    np.testing.assert_allclose(sums, [[[0.05, 0.01], [2, 1]]])
    assert flocking_comparison.diffuse_over_compact(sums) == pytest.approx(np.sqrt(0.025 / 0.01))
    assert flocking_comparison.diffuse_over_compact(sums * [1, 0]) == 0.0
    metric = np.array([[0.1, 0.004, 0.1], [0.1, 0.1, 0.1]])
    assert flocking_comparison.first_reached(metric).tolist() == [2.0, np.inf]
    for_good = flocking_comparison.kept_from(np.array([[0.1, 0.004, 0.004], [0.004, 0.004, 0.1], [0.001] * 3]))
    assert for_good.tolist() == [2.0, np.inf, 1.0]


# --- flights ----------------------------------------------------------------------------------------------


def test_the_metric_is_that_of_each_second_of_the_seeds_own_games():
    config, target = coverage.lone_team(4), bunching_up.disc(0.2, 10)
    found = coverage.metric_over_time(coverage.start(config, [5, 9], target), seconds=2)
    simulator = Simulator(config, 2)
    simulator.reset([5, 9])
    simulator.command(0, np.stack([target] * 2))
    metric = ErgodicMetric(simulator, 0)
    for second in range(2):
        for _ in range(10):
            simulator.advance(3)
            metric.observe()
        np.testing.assert_array_equal(found[:, second], metric.value())


def test_a_flight_is_told_of_second_by_second_and_its_maps_are_upright(monkeypatch):
    monkeypatch.setattr(coverage, "SECONDS", 4)
    upper_left, seconds = np.zeros((10, 10)), []
    upper_left[9, 0] = 1.0
    flight = coverage.Flight(coverage.start(coverage.lone_team(2), [0, 1, 2], upper_left), seconds.append)
    assert seconds == [1, 2, 3, 4] and flight.metric.shape == (3, 4) and flight.places.shape == (3, 40, 2, 2)
    for game, shares in enumerate(flight.maps(5)):
        cells = np.minimum(np.floor(5 * flight.places[game].reshape(-1, 2)), 4)
        assert shares.sum() == 1.0 and shares[4, 0] == (cells == [0, 4]).all(axis=1).mean()
