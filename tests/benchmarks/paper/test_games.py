"""Claims about games: each verdict on either side of its bound, and each statistic on an answer known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import (
    adversary,
    bunching_up,
    capture_geometry,
    comebacks,
    ensemble_tactic,
    team_sizes,
    wavefront,
)
from benchmarks.paper.drawings import dot, painted
from benchmarks.paper.figure import Setting
from benchmarks.paper.players import Captures, Ensemble, Fixed, Person, most_within, player, shaped
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import MissingExtraError
from swarm_pz.evaluation.rollout import Rollout
from tests.benchmarks.paper.given import SEED, SETTING, found_by, game, results

RELEASED = Setting("released", SEED)


# --- what stands still captures -------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [0, 1])
def test_one_cell_that_is_not_as_expected_is_one_too_many_and_more_must_lie_inside_a_ring(monkeypatch, wrong):
    def probe(drones, rules):
        expected = next(cells for own, cells in capture_geometry.SCENES.values() if own == drones)
        captured, field = np.zeros((50, 50), bool), np.full((50, 50), 0.5)
        captured[tuple(np.array(expected)[:, ::-1].T)] = True
        field[captured] = 0.4 if len(drones) == 30 and wrong else 1.0
        captured[30, 40] = drones == [(7, 7)] and wrong
        return field, captured

    monkeypatch.setattr(capture_geometry, "probe", probe)
    found = found_by(capture_geometry)
    assert found.papers == [True, not wrong, True, True] and found.ours == [not wrong]
    assert found.values[-1] == pytest.approx(wrong / (4 * 2500))


def test_drones_that_stand_still_capture_by_either_field():
    for setting in (SETTING, RELEASED):
        field, captured = capture_geometry.probe([(7, 7)], capture_geometry.still(setting.config))
        assert field.max() == 1.0 and captured.any()


@pytest.mark.parametrize(("centre", "cells"), [((9, 9), 16), ((9, 0), 9), ((0, 0), 5), ((49, 25), 9), ((1, 1), 7)])
def test_walls_shorten_the_ring_around_a_cell(centre, cells):
    ring = capture_geometry.ring_around(centre)
    assert len(ring) == len(set(ring)) == cells
    assert all(max(abs(x - centre[0]), abs(y - centre[1])) == 2 for x, y in ring)


# --- who wins --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("least", "holds"), [(20, True), (27, False), (45, False)])
def test_uniform_coverage_is_a_challenge_where_a_naive_person_surely_wins_less_than_half(monkeypatch, least, holds):
    asked = []

    def play(policy, opponent, numbers, *, seed, config):
        asked.append((policy.name, opponent, [*numbers] == [*range(60)], seed, config))
        outcomes = np.repeat(results((least if len(asked) == 2 else 50) // 2, 30), 2)
        return [game(number, str(outcome)) for number, outcome in enumerate(outcomes)]

    monkeypatch.setattr(adversary, "play_games", play)
    monkeypatch.setattr(adversary, "NAIVE", ("centre", "noise", "evade"))
    found = found_by(adversary)
    assert found.papers == [holds] and found.ours == [False, False]
    assert found.values == pytest.approx([(least // 2) / 30, 50 / 60, 50 / 60], rel=1e-5)
    assert [name for name, *_ in asked[:4]] == [f"{n}, every 3 steps" for n in ("centre", "noise", "evade")] + [
        "centre"
    ]
    assert {tuple(rest) for _, *rest in asked} == {("uniform", True, SEED, GameConfig())}


@pytest.mark.parametrize(("far", "near"), [(1, 40), (0, 40), (0, 0)])
def test_a_comeback_needs_a_game_won_by_a_person(monkeypatch, far, near):
    def play(policy, opponent, numbers, *, seed, config):
        assert (opponent, [*numbers], seed) == ("uniform", [*range(0, 120, 2)], SEED)
        person = policy.name.endswith("steps")
        wins = {(1, 19): far, (3, 17): near}[config.drones_per_team] if person else 60
        return [game(2 * number, outcome) for number, outcome in enumerate(results(wins, 60, "draw"))]

    monkeypatch.setattr(comebacks, "play_games", play)
    monkeypatch.setattr(comebacks, "installed", lambda names, setting: ["ring", "chase"])
    found = found_by(comebacks)
    assert (found.papers, found.ours) == ([far > 0, near > 0], [True, True])
    assert found.values == pytest.approx([far / 60, 1.0, near / 60, 1.0], rel=1e-5)
    assert found.verdict == {0: "not reproduced", 1: "partly", 2: "reproduced"}[(far > 0) + (near > 0)]


def test_the_comeback_shown_is_a_won_one_and_players_that_cannot_be_loaded_are_left_out(monkeypatch):
    histories = [[1, 1, 1, 0], [1, 2, 12, 20], [1, 2, 3, 20]]
    assert comebacks.longest_behind(histories, ["loss", "win", "win"], 20) == 2
    assert comebacks.longest_behind(histories, ["loss", "loss", "draw"], 20) is None

    def load(name, config):
        if name == "champion":
            raise MissingExtraError("torch is not installed")

    monkeypatch.setattr(comebacks, "load", load)
    assert comebacks.installed(("ring", "champion"), SETTING) == ["ring"]


@pytest.mark.parametrize(("wins", "papers", "ours"), [(40, [True] * 3, [True, True]), (1, [True] * 3, [False, False])])
def test_a_tactic_wins_where_a_person_wins_a_game_by_it(monkeypatch, wins, papers, ours):
    asked = []

    def play(policy, opponent, numbers, *, seed, config):
        name = [*ensemble_tactic.TACTICS][len(asked)]
        asked.append((policy, opponent, [*numbers] == [*range(0, 100, 2)], seed, config))
        won = {ensemble_tactic.TRACKED: wins, ensemble_tactic.DOTS[0]: 0, ensemble_tactic.ALONE: 0}.get(name, 50)
        # The last drone is alone for the longest in the game of pair 7.
        sizes = [[10, 15, *[19] * (30 if pair == 7 else 3), 20] for pair in range(50)]
        return [game(2 * pair, outcome, sizes=sizes[pair]) for pair, outcome in enumerate(results(won, 50))]

    monkeypatch.setattr(ensemble_tactic, "play_games", play)
    monkeypatch.setattr(ensemble_tactic, "frames", lambda *given: [given[2].pair])
    monkeypatch.setattr(ensemble_tactic, "draw_moments", lambda panels, frames: [])
    found = found_by(ensemble_tactic, RELEASED)
    assert (found.papers, found.ours) == (papers, ours)
    assert found.values == pytest.approx([1.0, wins / 100, *[wins / 50] * 3, 1.0, 1.0], rel=1e-5)
    assert found.record["series"]["shown"] == {"pair": 7 if wins > 7 else 0, "frames": [7 if wins > 7 else 0]}
    assert {tuple(rest) for _, *rest in asked} == {("uniform", True, SEED, RELEASED.config)}
    # A person's command is a drawing, as the table makes a command of it under these rules.
    images = np.zeros((1, 2, 25, 25), np.uint8)
    sent = asked[1][0].act(images, np.zeros(1, int))[0]
    np.testing.assert_array_equal(sent, dot((0.5, 0.5), 0.3).density("paper"))
    assert sent.min() > 0.4, "ground beside the dot is at one half, smoothed"


def test_moments_of_a_game_and_of_its_last_stand():
    sizes = [10] * 25 + [6] * 10 + [5] * 10 + [2] * 5 + [1] * 21 + [0]
    assert ensemble_tactic.moments(sizes) == [20, 35, 60, 71]
    assert ensemble_tactic.moments([4, 2, 0]) == [1, 1, 2, 2]
    assert ensemble_tactic.last_stand([10, 1, 3, 1, 1, 0]) == 2
    assert ensemble_tactic.last_stand([10, 4, 0]) == 0


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
"""Captures so far, which come in bursts and then steadily."""
STEADY = [second // 10 for second in range(161)]


@pytest.mark.parametrize(
    ("rates", "sizes", "totals", "papers"),
    [
        ([0.25, 0.35], [LATE], [CALM], [True, True, True]),
        ([0.1, 0.31], [LATE], [CALM], [False, True, True]),  # above, not surely
        ([0.3, 0.3], [EARLY], [CALM], [True, False, True]),
        ([0.3, 0.3], [LATE], [STEADY], [True, True, False]),
        ([0.3, 0.3], [LATE], [[0, 3]], [True, True, False]),  # games too short to tell
    ],
)
def test_sizes_change_rapidly_and_captures_steady_where_a_game_says_so(monkeypatch, rates, sizes, totals, papers):
    def play(policy, opponent, numbers, *, seed, config, after_step):
        assert (policy.name, opponent) == ("ring, every 3 steps", "uniform")
        assert ([*numbers], seed) == ([*range(0, 120, 2)], SEED)
        after_step.totals[:] = [[np.array([total, 0]) for total in totals[n % len(totals)]] for n in range(60)]
        lengths = np.random.default_rng(0).permutation(60) + 10.0
        return [
            game(2 * n, seconds=length, captures=rates[n % 2] * length, sizes=sizes[n % len(sizes)])
            for n, length in enumerate(lengths.tolist())
        ]

    monkeypatch.setattr(team_sizes, "play_games", play)
    found = found_by(team_sizes)
    assert found.papers == papers
    assert found.values[0] == pytest.approx(np.mean(rates), rel=1e-5)
    assert found.values[-1] == 39.5 and found.record["series"]["seconds"] == 40.0


def test_the_course_of_a_game():
    before, near = team_sizes.unsteadiness(CALM)
    assert before > near == 0.0 and team_sizes.unsteadiness([0, 1, 2]) is None
    assert team_sizes.brief_lead(LATE, 20) and not team_sizes.brief_lead(EARLY, 20)
    assert team_sizes.turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2, "equal teams do not count"


# --- what costs drones ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("most", "raw", "papers", "ours"),
    [
        ((5, 5), ([30], [21, 20]), [True, True], [True, True, True, True]),
        ((5, 4), ([30], [20]), [True, False], [True, False, True, False]),  # as many as others
        ((4, 4), ([70, 1, 1, 10], [30]), [False, False], [False, False, False, True]),  # more, not surely
    ],
)
def test_a_wave_may_capture_many_at_high_risk_where_a_game_says_so(monkeypatch, most, raw, papers, ours):
    def counts(name, way, setting):
        own = raw if name == "wavefront" else ([20], [20])
        extra = {"ring": 100, "noise": -10}.get(name, 0)
        quickly = np.zeros((40, 2), int)
        quickly[3] = most
        return np.stack([*(np.resize(one, 40) + extra for one in own), np.ones(40)], axis=1), quickly

    monkeypatch.setattr(wavefront, "counts", counts)
    found = found_by(wavefront)
    assert (found.papers, found.ours) == (papers, ours)
    assert found.values[-2:] == pytest.approx([np.mean(raw[0]) - 20, np.mean(raw[1]) - 20], rel=1e-5)


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


@pytest.mark.parametrize(
    ("drawn", "compact", "spread", "ours"),
    [
        ((0, 1), (2, 30), (5, 2), [True, True]),  # the better way to aim counts
        ((0, 0), (30, 0), (0, 28), [True, False]),  # more, not surely
        ((9, 0), (6, 6), (0, 0), [False, True]),  # more than one in ten, not surely
    ],
)
def test_to_bunch_up_is_a_risk_where_a_drawn_team_is_lost_whole(monkeypatch, drawn, compact, spread, ours):
    played = []

    def play(command, aimer, way, setting):
        sigma = bunching_up.SIGMAS[(len(played) - 2) // 2] if way == "program" else 0.0
        played.append(way)
        close, wide = sigma and sigma <= 0.15, not sigma or sigma >= 0.25
        by_way = drawn if way == "person" else compact if close else spread if wide else (25, 25)
        return np.arange(50) < by_way[("chase", "ring").index(aimer)], np.full(50, 0.1)

    monkeypatch.setattr(bunching_up, "play", play)
    found = found_by(bunching_up)
    assert (found.papers, found.ours) == ([max(drawn) > 0], ours)
    expected = [max(drawn) / 50, max(compact) / 50, (max(compact) - max(spread)) / 50]
    assert found.values == pytest.approx(expected)


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
    """Answers with what it sees."""

    name = "echo"
    observation = ObservationConfig()

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return np.full((len(rows), 2, 2), float(observations[0]))


def test_a_person_sends_every_third_answer_and_holds_it_until_the_next():
    player = Person(Echo())
    for _ in range(2):  # the next games begin anew
        player.reset([0, 1], np.arange(2))
        sent = [player.act(np.full(2, step), np.arange(2))[1, 0, 0] for step in range(7)]
        assert sent == [0, 0, 0, 3, 3, 3, 6]


def test_a_person_paints_the_ground_that_a_tactic_wants_most_and_the_table_makes_the_command():
    density = np.zeros((10, 10))
    density[:, :2], density[:, 2] = 1.0, 0.4
    firm, paper, repelling = (
        painted(density, *given, repels=repels)
        for given, repels in ((("firm",), False), (("paper",), False), (("firm",), True))
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
