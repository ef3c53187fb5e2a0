"""Claims about games: each verdict on either side of its bound, and each statistic on an answer known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import (
    adversary,
    bunching_up,
    capture_geometry,
    comebacks,
    drawing_attention,
    ensemble_tactic,
    team_sizes,
    wavefront,
)
from benchmarks.paper.players import Ensemble, Fixed, Held
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import MissingExtraError
from swarm_pz.evaluation.rollout import Rollout
from tests.benchmarks.paper.given import SEED, found_by, game, results

WEAK, CLOSE, STRONG = (4, 12, 50), (26, 28, 30), (40, 50, 10)
"""Games of 60 that three tactics win."""
LATE, EARLY = [10, 12, 9, 11, 8, 9, 8, 9, 11, 15, 20], [10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20]
"""Sizes of a team whose lead is settled late, and of one that leads from the start."""
CALM, RISING = [0, 9, 12, 15, 18, 21, 24, 27, 30, 31, 32], [0, 1, 2, 3, 4, 5, 6, 7, 8, 19, 30]
"""Captures so far, rarer in the end and more frequent."""


# --- what stands still captures -------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [0, 1])
def test_one_cell_that_is_not_as_expected_is_one_too_many(monkeypatch, wrong):
    def probe(drones):
        expected = next(cells for own, cells in capture_geometry.SCENES.values() if own == drones)
        captured = np.zeros((50, 50), bool)
        captured[tuple(np.array(expected)[:, ::-1].T)] = True
        captured[30, 40] = drones == [(7, 7)] and wrong
        return np.zeros((50, 50)), captured

    monkeypatch.setattr(capture_geometry, "probe", probe)
    found = found_by(capture_geometry)
    assert found["supported"] == (wrong == 0)
    assert found["statistic"]["cells_that_differ"] == wrong / (4 * 2500)


@pytest.mark.parametrize(("centre", "cells"), [((9, 9), 16), ((9, 0), 9), ((0, 0), 5), ((49, 25), 9), ((1, 1), 7)])
def test_walls_shorten_the_ring_around_a_cell(centre, cells):
    ring = capture_geometry.ring_around(centre)
    assert len(ring) == len(set(ring)) == cells
    assert all(max(abs(x - centre[0]), abs(y - centre[1])) == 2 for x, y in ring)


# --- who wins --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wins", [(WEAK,) * 4, (CLOSE, WEAK, WEAK, WEAK), (WEAK, WEAK, WEAK, STRONG)])
def test_uniform_coverage_is_a_challenge_where_the_median_is_surely_below_half(monkeypatch, wins):
    asked = []

    def play(player, opponent, numbers, *, seed, config):
        asked.append((player.name, opponent, [*numbers] == [*range(60)], seed, config))
        part, place = divmod(len(asked) - 1, 3)
        # Both games of a pair come out alike, so that intervals are as wide as pairs make them.
        outcomes = np.repeat(results(wins[part][place] // 2, 30), 2)
        return [game(number, str(outcome)) for number, outcome in enumerate(outcomes)]

    monkeypatch.setattr(adversary, "play_games", play)
    monkeypatch.setattr(adversary, "NAIVE", ("centre", "noise", "evade"))
    found = found_by(adversary)
    assert [*found["parts"].values()] == [won == WEAK for won in wins]
    assert found["supported"] == (wins == (WEAK,) * 4)
    assert [*found["statistic"].values()] == pytest.approx([np.median(won) / 60 for won in wins], rel=1e-5)
    rules = [GameConfig.preset(name) for name in ("paper", "paper", "released", "released")]
    assert asked == [
        (f"{name}, every {seconds} steps", "uniform", True, SEED, config)
        for seconds, config in zip((1, 3, 1, 3), rules, strict=True)
        for name in ("centre", "noise", "evade")
    ]


@pytest.mark.parametrize(
    ("far", "near", "holds"),
    # Of 100 games 7 are more than 5 %, but not surely; 11 are.
    [(11, 40, True), (7, 40, False), (11, 7, False)],
)
def test_a_comeback_needs_surely_more_than_a_few_wins_from_both_handicaps(monkeypatch, far, near, holds):
    def play(player, opponent, numbers, *, seed, config):
        assert (opponent, [*numbers], seed) == ("uniform", [*range(0, 200, 2)], SEED)
        wins = {(1, 19): far, (3, 17): near}[config.drones_per_team] if player == "champion" else 100 - far
        return [game(2 * number, outcome) for number, outcome in enumerate(results(wins, 100, "draw"))]

    monkeypatch.setattr(comebacks, "play_games", play)
    monkeypatch.setattr(comebacks, "installed", lambda names, config: list(names))
    found = found_by(comebacks)
    assert found["supported"] == holds
    assert found["statistic"] == {"win_rate_from_1_against_19": far / 100, "win_rate_from_3_against_17": near / 100}


def test_the_comeback_shown_is_a_won_one_and_players_that_cannot_be_loaded_are_left_out(monkeypatch):
    histories = [[1, 1, 1, 0], [1, 2, 12, 20], [1, 2, 3, 20]]
    assert comebacks.longest_behind(histories, ["loss", "win", "win"], 20) == 2
    assert comebacks.longest_behind(histories, ["loss", "loss", "draw"], 20) is None

    def load(name, config):
        if name == "champion":
            raise MissingExtraError("torch is not installed")

    monkeypatch.setattr(comebacks, "load", load)
    assert comebacks.installed(("ring", "champion"), GameConfig()) == ["ring"]


@pytest.mark.parametrize(
    ("wins", "shown"), [((28, 40), "released"), ((40, 40), "released"), ((40, 0), "paper"), ((0, 0), None)]
)
def test_a_tactic_wins_where_it_surely_wins_more_than_half_under_all_rules(monkeypatch, wins, shown):
    asked = []

    def play(policy, opponent, numbers, *, seed, config):
        place, number = divmod(len(asked), len(ensemble_tactic.TACTICS))
        asked.append((opponent, [*numbers] == [*range(0, 100, 2)], seed, config))
        named = [*ensemble_tactic.TACTICS][number]
        won = {ensemble_tactic.SAID: wins[place], ensemble_tactic.ALONE: 0}.get(named, 50)
        # The last drone is alone for the longest in the game of pair 7.
        sizes = [[10, 15, *[19] * (30 if pair == 7 else 3), 20] for pair in range(50)]
        return [game(2 * pair, outcome, sizes=sizes[pair]) for pair, outcome in enumerate(results(won, 50))]

    monkeypatch.setattr(ensemble_tactic, "play_games", play)
    monkeypatch.setattr(ensemble_tactic, "frames", lambda *given: [given[2].pair])
    monkeypatch.setattr(ensemble_tactic, "draw_moments", lambda panels, frames: [])
    found = found_by(ensemble_tactic)
    assert found["parts"] == {"paper": wins[0] == 40, "released": wins[1] == 40}
    assert found["supported"] == (wins == (40, 40))
    for name, won in zip(("paper", "released"), wins, strict=True):
        for key, count in (("win_rate", won), ("loss_rate", 50 - won), ("win_rate_gained_by_tracking", won)):
            assert found["statistic"][f"{key}_{name}"] == count / 50
    rules = [GameConfig.preset("paper")] * 6 + [GameConfig.preset("released")] * 6
    assert asked == [("uniform", True, SEED, config) for config in rules]
    assert found["series"]["shown"] == (None if shown is None else {"rules": shown, "pair": 7, "frames": [7]})


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
    tracking, staying = Ensemble(config).act(images, rows), Ensemble(config, last=0).act(images, rows)
    np.testing.assert_array_equal(tracking[0], staying[0])
    np.testing.assert_array_equal(staying[0], staying[1])
    np.testing.assert_allclose(staying[0], staying[0][::-1, ::-1])
    assert np.unravel_index(tracking[1].argmax(), (10, 10)) == (1, 8)


# --- how sizes change ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rates", "sizes", "totals", "holds"),
    [
        ([0.15, 0.35], [LATE], [CALM], [True, True, True]),
        ([0.1, 0.31], [LATE], [CALM], [False, True, True]),  # above, not surely
        ([0.3, 0.3], [LATE], [CALM, RISING], [True, False, True]),
        ([0.3, 0.3], [EARLY, LATE], [CALM], [True, True, False]),  # the median between both: not surely
    ],
)
def test_sizes_change_rapidly_and_settle_late_where_all_three_intervals_say_so(
    monkeypatch, rates, sizes, totals, holds
):
    def play(policy, opponent, numbers, *, seed, config, after_step):
        assert (policy, opponent, [*numbers], seed) == ("ring", "uniform", [*range(0, 120, 2)], SEED)
        after_step.totals[:] = [totals[number % len(totals)] for number in range(60)]
        lengths = np.random.default_rng(0).permutation(60) + 10.0
        return [
            game(2 * n, seconds=length, captures=rates[n % 2] * length, sizes=sizes[n % len(sizes)])
            for n, length in enumerate(lengths.tolist())
        ]

    monkeypatch.setattr(team_sizes, "play_games", play)
    found = found_by(team_sizes)
    assert [*found["parts"].values()] == holds and found["supported"] == all(holds)
    assert found["statistic"]["captures_a_second"] == pytest.approx(np.mean(rates), rel=1e-5)
    assert found["statistic"]["mean_seconds"] == 39.5
    shown = found["series"]["seconds"]
    assert len(shown) == 20 and shown[found["series"]["bold"]] == sorted(shown)[10]


def test_games_that_are_drawn_are_not_asked_when_they_were_settled(monkeypatch):
    played = [game(0, sizes=LATE), game(2, "draw", sizes=EARLY, seconds=300.0)]

    def play(*given, after_step, **options):
        after_step.totals[:] = [CALM, RISING]
        return played

    monkeypatch.setattr(team_sizes, "GAMES", 2)
    monkeypatch.setattr(team_sizes, "play_games", play)
    statistic = found_by(team_sizes)["statistic"]
    assert statistic["captures_at_the_end_over_middle"] == pytest.approx((2 / 2) / (18 / 6), rel=1e-5)
    assert (statistic["lead_taken_after_share_of_game"], statistic["mean_seconds"]) == (0.8, 155.0)
    played[0] = game(0, "draw")  # where nobody wins nothing settles
    found = found_by(team_sizes)
    assert [*found["parts"].values()][1:] == [False, False]
    assert "lead_taken_after_share_of_game" not in found["statistic"]


def test_the_course_of_a_game():
    middle, end = team_sizes.rates_of_middle_and_end([0, 9, 9, 10, 12, 15, 16, 18, 21, 21, 25])
    assert (middle, end) == (12 / 6, 4 / 2)
    assert team_sizes.lead_taken([10, 12, 8, 10, 11, 15, 20], 20) == pytest.approx(4 / 6)
    assert team_sizes.lead_taken([15, 16, 20], 20) == 0.0
    assert team_sizes.turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2, "equal teams do not count"


# --- what costs drones ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("taken", "lost", "holds"),
    [
        ([30], [21, 20], [True, True]),
        ([30], [20], [True, False]),  # as many as others
        ([70, 1, 1, 10], [30], [False, True]),  # more, not surely
    ],
)
def test_a_wave_captures_many_at_high_risk_where_both_are_surely_above_the_median(monkeypatch, taken, lost, holds):
    def counts(name, seed, config):
        own = (taken, lost) if name == "wavefront" else ([20], [20])
        extra = {"ring": 100, "noise": -10}.get(name, 0)
        return np.stack([*(np.resize(one, 40) + extra for one in own), np.ones(40)], axis=1)

    monkeypatch.setattr(wavefront, "counts", counts)
    found = found_by(wavefront)
    assert [*found["parts"].values()] == holds and found["supported"] == all(holds)
    assert found["statistic"]["taken_a_minute"] == pytest.approx(np.mean(taken), rel=1e-5)
    assert found["statistic"]["lost_a_minute_above_the_median"] == pytest.approx(np.mean(lost) - 20, rel=1e-5)


def test_rates_are_of_all_minutes_together_and_from_the_attackers_side(monkeypatch):
    class Told(Rollout):
        def play(self):
            self.simulator.games.captures[:] = [[7, 2], [1, 3]]
            self.simulator.games.ticks[:] = [1800, 900]

    monkeypatch.setattr(wavefront, "Rollout", Told)
    monkeypatch.setattr(wavefront, "GAMES", 2)
    counted = wavefront.counts("wavefront", SEED, GameConfig())
    assert counted.tolist() == [[7, 2, 1.0], [1, 3, 0.5]]
    assert wavefront.rates(counted[:, None]).tolist() == [[8 / 1.5, 5 / 1.5]]


@pytest.mark.parametrize(
    ("compact", "spread", "holds"),
    [
        ((2, 30), (5, 2), True),  # the better way to aim counts
        ((30, 0), (0, 28), False),  # more, not surely
        ((6, 6), (0, 0), False),  # more than one in ten, not surely
    ],
)
def test_to_bunch_up_is_a_risk_where_compact_teams_are_surely_lost_whole_and_more_often(
    monkeypatch, compact, spread, holds
):
    played = []

    class Unplayed:
        def __init__(self, aimer, holder, numbers, *, seed, config):
            self.aimer, self.command = aimer, holder.act(None, np.zeros(1))[0]

        def play(self, seconds, *, after_control_period):
            played.append(self.aimer)

    class Told:
        def __init__(self, rollout):
            self.rollout, self.spread = rollout, np.full(50, 0.1)

        def whole_within(self, seconds):
            sigma = bunching_up.SIGMAS[(len(played) - 1) // 2]
            np.testing.assert_array_equal(self.rollout.command, bunching_up.disc(sigma, 10))
            by_way = compact if sigma and sigma <= 0.15 else spread if not sigma or sigma >= 0.25 else (25, 25)
            return np.arange(50) < by_way[("chase", "ring").index(self.rollout.aimer)]

    monkeypatch.setattr(bunching_up, "Rollout", Unplayed)
    monkeypatch.setattr(bunching_up, "place_blue", lambda rollout, density, seed: None)
    monkeypatch.setattr(bunching_up, "Losses", Told)
    found = found_by(bunching_up)
    assert found["supported"] == holds
    assert found["statistic"] == {
        "all_at_once_compact": max(compact) / 50,
        "all_at_once_spread": max(spread) / 50,
        "difference": pytest.approx((max(compact) - max(spread)) / 50),
    }


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


@pytest.mark.parametrize(
    ("more", "apart", "holds"), [((3.0, 3.0), 1.0, True), ((3.0, -0.5), 1.0, False), ((0.4, 3.0), 9.0, False)]
)
def test_drawing_costs_drones_where_more_are_surely_lost_against_both(monkeypatch, more, apart, holds):
    def tally(seconds, opponent, seed, looks="begin"):
        lost = np.full(100, 10.0)
        if seconds == drawing_attention.JUDGED:
            gain = more[drawing_attention.OPPONENTS.index(opponent)] if looks == "begin" else 1.0
            lost += gain + apart * np.where(np.arange(100) % 2, 1.0, -1.0)
        return np.stack([lost, np.full(100, 30.0), np.full(100, 0.4)], axis=1)

    monkeypatch.setattr(drawing_attention, "tally", tally)
    found = found_by(drawing_attention)
    assert found["supported"] == holds
    for name, gain in zip(drawing_attention.OPPONENTS, more, strict=True):
        statistic = found["statistic"]
        assert statistic[f"more_lost_a_minute_by_3_s_of_drawing_against_{name}"] == pytest.approx(2 * gain)
        assert statistic[f"more_lost_a_minute_by_looking_away_for_3_s_against_{name}"] == pytest.approx(2 * gain - 2)


class Echo:
    """Answers with what it sees."""

    name = "echo"
    observation = ObservationConfig()

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return np.full((len(rows), 2, 2), float(observations[0]))


@pytest.mark.parametrize(
    ("make", "sent"),
    [
        (lambda tactic: drawing_attention.Drawer(tactic, 0), [0, 1, 2, 3, 4, 5, 6]),
        (lambda tactic: drawing_attention.Drawer(tactic, 3), [1, 1, 1, 0, 0, 0, 3]),  # at first, uniform coverage: ones
        (lambda tactic: drawing_attention.Drawer(tactic, 3, "send"), [0, 0, 0, 3, 3, 3, 6]),
        (lambda tactic: Held(tactic, 3), [0, 0, 0, 3, 3, 3, 6]),
    ],
)
def test_a_command_answers_what_was_seen_when_it_was_begun_and_stays_until_the_next(make, sent):
    player = make(Echo())
    for _ in range(2):  # the next games begin anew
        player.reset([0, 1], np.arange(2))
        assert [player.act(np.full(2, step), np.arange(2))[1, 0, 0] for step in range(7)] == sent
