"""Every figure decides its claim by the rule that stands in it: by the interval's end, not by the mean.

Games are not played here: a figure is given what they might have said, on either side of its bound.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.evaluation import intervals
from swarm_pz.evaluation.match import MatchResult
from swarm_pz.evaluation.rollout import Game, Rollout
from swarm_pz.figures.claims import (
    FIGURES,
    adversary,
    capture_geometry,
    comebacks,
    communication,
    compactness,
    dropout,
    ensemble_tactic,
    flocking_comparison,
    flocking_flights,
    permutation_invariance,
    scale_invariance,
    team_sizes,
)

SEED = 3


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    """Take fewer resamples than results do: no case here is near its bound."""
    monkeypatch.setattr(intervals, "RESAMPLES", 250)


def game(number, outcome="win", *, seconds=10.0, captures=3, sizes=(10, 20)):
    return Game(
        pair=number // 2,
        side=("red", "blue")[number % 2],
        outcome=outcome,
        share=float(outcome == "win"),
        seconds=seconds,
        captures=captures,
        recaptures=0,
        fingerprint=str(number).encode(),
        sizes=list(sizes),
    )


def results(wins, count, losing="loss"):
    return ["win"] * wins + [losing] * (count - wins)


# --- uniform coverage as an adversary -----------------------------------------------------------------


def adversaries(monkeypatch, wins):
    """Let scripts win so many of the 60 games of each set of rules; return what was asked for."""
    asked = []

    def play(name, opponent, **options):
        rules = options["config"]
        asked.append((name, opponent, rules, options["games"], options["seed"]))
        count = wins[rules == GameConfig.preset("released")][name]
        # Won from the same starts on both sides, so that intervals are as wide as pairs make them.
        outcomes = np.repeat(results(count // 2, 30), 2)
        return MatchResult(
            policy=name, opponent=opponent, seed=SEED, config=rules, limit_s=300.0,
            games=[game(number, str(outcome)) for number, outcome in enumerate(outcomes)],
        )  # fmt: skip

    monkeypatch.setattr(adversary, "play_match", play)
    monkeypatch.setattr(adversary, "scripts", lambda: ["a", "b", "c"])
    return asked


WEAK, CLOSE, STRONG = {"a": 4, "b": 12, "c": 50}, {"a": 26, "b": 28, "c": 30}, {"a": 40, "b": 50, "c": 10}


@pytest.mark.parametrize(
    ("paper", "released", "holds"),
    [(WEAK, WEAK, True), (CLOSE, WEAK, False), (WEAK, CLOSE, False), (WEAK, STRONG, False), (STRONG, WEAK, False)],
)
def test_uniform_coverage_is_hard_where_the_median_is_surely_below_half_under_all_rules(
    monkeypatch, paper, released, holds
):
    asked = adversaries(monkeypatch, (paper, released))
    finding = adversary.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {
        "median_win_rate_paper": pytest.approx(np.median([*paper.values()]) / 60),
        "median_win_rate_released": pytest.approx(np.median([*released.values()]) / 60),
    }
    assert asked == [
        (name, "uniform", GameConfig.preset(preset), 60, SEED) for preset in ("paper", "released") for name in "abc"
    ]
    assert [row["wins"] for row in finding.series["released"]] == [*released.values()]
    # A pair is drawn with both of its games.
    won = [[[count / 2 > pair] * 2 for count in paper.values()] for pair in range(30)]
    _, *ends = intervals.bootstrap(np.array(won, float), adversary.median_win_rate)
    assert finding.interval["median_win_rate_paper"] == pytest.approx(tuple(map(float, ends)))


# --- geometry -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", [0, 1])
def test_one_cell_that_is_not_as_expected_is_one_too_many(monkeypatch, wrong):
    def probe(drones):
        expected = next(cells for own, cells in capture_geometry.SCENES.values() if own == drones)
        captured = np.zeros((50, 50), bool)
        for column, row in expected:
            captured[row, column] = True
        if drones == [(7, 7)] and wrong:
            captured[30, 40] = True
        return np.zeros((50, 50)), captured

    monkeypatch.setattr(capture_geometry, "probe", probe)
    finding = capture_geometry.measure(SEED)
    assert finding.supported == (wrong == 0)
    assert finding.statistic["cells_that_differ"] == wrong / (4 * 2500)
    assert finding.seen.startswith("Of 10,000 games") and f" {wrong} differ" in finding.seen


# --- comebacks ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("far", "near", "holds"),
    # Of 100 games 7 are more than 5 %, but not surely; 11 are.
    [(11, 40, True), (7, 40, False), (11, 7, False), (0, 0, False)],
)
def test_a_comeback_needs_surely_more_than_a_few_wins_of_the_strongest_from_both_handicaps(
    monkeypatch, far, near, holds
):
    asked = []

    def play(player, opponent, numbers, *, seed, config):
        asked.append((player, opponent, config.drones_per_team, [*numbers] == [*range(0, 200, 2)], seed))
        wins = {(1, 19): far, (3, 17): near}[config.drones_per_team] if player == "champion" else 100 - far
        return [game(2 * number, outcome) for number, outcome in enumerate(results(wins, 100, "draw"))]

    monkeypatch.setattr(comebacks, "play_games", play)
    monkeypatch.setattr(comebacks, "installed", lambda names, config: list(names))
    finding = comebacks.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {"win_rate_from_1_against_19": far / 100, "win_rate_from_3_against_17": near / 100}
    assert asked == [
        (player, "uniform", sizes, True, SEED)
        for sizes in ((1, 19), (3, 17))
        for player in ("ring", "hunter", "champion")
    ]
    assert finding.series["strongest"] == "champion"
    assert [(row["wins"], row["draws"]) for row in finding.series["rows"]][2] == (far, 100 - far)


# --- communication ------------------------------------------------------------------------------------


def flights(monkeypatch, module, values_of):
    """Let every flight's metric be what a function of rules, seeds and seconds says; return what was flown."""
    flown = []

    def start(config, seeds, command):
        flown.append((config, tuple(seeds), np.asarray(command).tobytes()))
        return config, seeds, command

    def metric(flight, seconds=60):
        config, seeds, command = flight
        return values_of(config, command, len(seeds), seconds)

    monkeypatch.setattr(module, "start", start)
    monkeypatch.setattr(module, "metric_over_time", metric)
    return flown


RADII, LOSSES = communication.RADII, communication.LOSSES
RISING = dict(zip(RADII, np.linspace(1.0, 2.0, len(RADII)), strict=True))
LOSING = dict(zip(LOSSES, np.linspace(1.0, 2.0, len(LOSSES)), strict=True))
NOISE = np.linspace(-0.02, 0.02, communication.SEEDS)


@pytest.mark.parametrize(
    ("changed", "lone", "holds"),
    [
        ({}, 2.0, True),
        ({"radius": {0.2: 1.0}}, 2.0, False),  # hears less and surely does better
        ({"loss": {0.9: 1.0}}, 2.0, False),
        ({}, 2.6, False),  # lone drones are worse than a team that hears nobody
        ({}, 1.6, False),
        ({}, 2.4, True),
    ],
)
@pytest.mark.parametrize("target", communication.TARGETS)
def test_talk_counts_where_no_step_to_less_of_it_helps_and_silence_is_loneliness(
    monkeypatch, target, changed, lone, holds
):
    everywhere = communication.TARGETS

    def values(config, command, seeds, seconds):
        assert (seeds, seconds) == (communication.SEEDS, communication.JUDGED)
        here = command is everywhere[target]
        radius, loss = config.controller.communication_radius, config.controller.message_loss
        by_radius = RISING | (changed.get("radius", {}) if here else {})
        by_loss = LOSING | (changed.get("loss", {}) if here else {})
        value = by_radius[radius] if radius in by_radius and loss == 0.0 and radius != WHOLE else by_loss[loss]
        return np.tile((value + NOISE)[:, None], (1, 3)) * [5.0, 7.0, 1.0]

    flights(monkeypatch, communication, values)
    monkeypatch.setattr(
        communication,
        "alone",
        lambda seeds, name: np.full(len(seeds), lone if name == target else 2.0) + NOISE[: len(seeds)],
    )
    finding = communication.measure(SEED)
    assert finding.supported == holds
    assert finding.seeds == [3000 + number for number in range(20)]
    assert finding.statistic[f"lone_drones_over_all_to_all_{target}"] == pytest.approx(lone, rel=0.01)
    assert finding.statistic[f"radius_0_over_lone_drones_{target}"] == pytest.approx(2.0 / lone, rel=0.01)
    assert finding.statistic[f"steps_of_loss_that_fall_{target}"] == int("loss" in changed)


WHOLE = GameConfig().controller.communication_radius


# --- compactness --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("high", "holds"), [(-0.001, True), (0.001, False)])
def test_bunching_up_is_a_risk_where_the_whole_interval_says_so(monkeypatch, high, holds):
    played = []

    class Unplayed(Rollout):
        def __init__(self, *given, **options):
            played.append((*given, options))
            super().__init__(*given, **options)

        def play(self, *, after_step):
            for _ in range(compactness.AHEAD):
                after_step(self)

    monkeypatch.setattr(compactness, "GAMES", 8)
    monkeypatch.setattr(compactness, "PLAYERS", ("uniform", "ring", "noise"))
    monkeypatch.setattr(compactness, "Rollout", Unplayed)
    monkeypatch.setattr(compactness, "rank_correlation", lambda games: (-0.1, (-0.2, high)))
    assert compactness.measure(SEED).supported == holds
    options = {"seed": SEED, "config": GameConfig()}
    numbers = [*range(0, 16, 2)]
    assert played == [
        (*pair, numbers, options) for pair in (("uniform", "ring"), ("uniform", "noise"), ("ring", "noise"))
    ]


def test_losses_are_counted_from_each_look_to_the_next_and_to_the_end(monkeypatch):
    config = GameConfig(drones_per_team=(6, 5))
    rollout = Rollout("uniform", "uniform", [0, 2], config=config)
    watcher = compactness.Watcher(2)
    games = rollout.simulator.games
    watcher(rollout)
    for step in range(1, 9):
        games.ticks[:] = 30 * step
        if step == 3:
            games.capture_ticks[0, :3] = 75
            games.teams[0, :3] = 1
        if step == 5:
            looked = games.positions[0].copy()
        if step == 7:  # ends between two looks: blue takes the others
            games.capture_ticks[0, 3:6] = 200
            games.teams[0, 3:6] = 1
            rollout.batch.running[0] = False
        watcher(rollout)
        rollout.rows = np.flatnonzero(rollout.batch.running)
    first, second = watcher.samples
    assert [share for _, share in first] == [0.5, 0.0, 0.0], "red's half; blue; what blue has grown to, at the end"
    assert first[-1][0] == pytest.approx(compactness.spread_of(looked, np.array([1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1]) > 0))
    assert [share for _, share in second] == [0.0, 0.0]


# --- drones that come and go --------------------------------------------------------------------------

COVERED = dropout.COVERED


def spread_around(mean, apart, seeds):
    """Samples of a mean, whose interval reaches about 0.31 times `apart` to each side for 40, 0.43 for 20."""
    return mean + apart * np.where(np.arange(seeds) % 2, 1.0, -1.0)


@pytest.mark.parametrize(
    ("by_rate", "holds"),
    [
        ({}, True),
        ({0.0: (0.95, 0.5)}, False),  # below on average, not with the whole interval
        ({0.05: (0.95, 0.5)}, False),
        ({0.1: (0.95, 0.5)}, False),
        ({0.1: (1.5, 0.1)}, False),
        ({0.3: (9.0, 0.1)}, True),  # more than half out: not claimed
        ({"fewer": (9.0, 0.1)}, True),
    ],
)
def test_a_target_is_kept_where_the_whole_interval_is_low_with_up_to_half_of_the_drones_out(
    monkeypatch, by_rate, holds
):
    def values(config, command, seeds, seconds):
        rate = config.dynamics.failure_rate if config.drones_per_team == (12, 0) else "fewer"
        assert config.dynamics.repair_rate == (0.0 if rate == "fewer" else dropout.REPAIR_RATE)
        assert command is dropout.TARGETS["bimodal"]
        mean, apart = by_rate.get(rate, (0.5, 0.1))
        found = np.full((seeds, seconds), 100.0)
        found[:, dropout.JUDGED - 1] = COVERED * spread_around(mean, apart, seeds)
        return found

    flown = flights(monkeypatch, dropout, values)
    finding = dropout.measure(SEED)
    assert finding.supported == holds
    assert {seeds for _, seeds, _ in flown} == {tuple(range(3000, 3040))} == {tuple(finding.seeds)}
    assert len(flown) == len(dropout.FAILURE_RATES) + 1
    assert set(finding.statistic) == set(finding.interval) >= {"metric_at_30_s_50_percent_out"}


# --- one command for every size -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mean", "apart", "holds"), [(0.5, 0.1, True), (0.95, 0.5, False), (0.95, 0.01, True), (1.2, 0.1, False)]
)
@pytest.mark.parametrize(("size", "target"), [(6, "uniform"), (24, "bimodal")])
def test_all_sizes_must_surely_cover_all_targets(monkeypatch, mean, apart, holds, size, target):
    def values(config, command, seeds, seconds):
        judged = config.drones_per_team[0] == size and command is scale_invariance.TARGETS[target]
        found = np.full((seeds, seconds), 100.0)
        found[:, scale_invariance.JUDGED - 1] = COVERED * (spread_around(mean, apart, seeds) if judged else 0.3)
        return found

    flown = flights(monkeypatch, scale_invariance, values)
    finding = scale_invariance.measure(SEED)
    assert finding.supported == holds
    assert len(flown) == 9 and {seeds for _, seeds, _ in flown} == {tuple(range(3000, 3020))}
    assert finding.statistic["worst_metric_at_30_s"] == pytest.approx(COVERED * mean)
    assert finding.statistic["largest_difference_at_30_s"] == pytest.approx(COVERED * (mean - 0.3))


# --- a tactic of two commands -------------------------------------------------------------------------


LAST_ALONE = np.zeros((2, 2, 25, 25), np.uint8)
"""Opposing drones at the right, near the bottom: two of 20, and one."""
LAST_ALONE[:, 0, 4, 20] = 64
LAST_ALONE[:, 1] = np.array([round(255 * 18 / 20), round(255 * 19 / 20)])[:, None, None]


@pytest.mark.parametrize(("wins", "holds"), [(40, False), (55, False), (62, True), (90, True)])
def test_a_tactic_wins_where_it_surely_wins_more_than_half(monkeypatch, wins, holds):
    asked, shown, tracks, looked = [], [], [], []

    def play(policy, opponent, numbers, *, seed, config):
        asked.append((opponent, [*numbers], seed, config))
        alone = policy.act(LAST_ALONE, np.arange(2))
        tracks.append(not np.allclose(alone[0], alone[1]))
        won = wins if len(asked) == 1 else wins - 10
        # The last drone is alone for the longest in the game of pair 7.
        sizes = [[10, 15, *[19] * (30 if number == 7 else 3), 20] for number in range(100)]
        return [game(2 * number, outcome, sizes=sizes[number]) for number, outcome in enumerate(results(won, 100))]

    class Looked(Rollout):
        def __init__(self, policy, opponent, numbers, **options):
            shown.append((opponent, [*numbers], options))
            super().__init__(policy, opponent, numbers, **options)
            looked.append(self.simulator)

        def play(self, *, after_control_period):
            super().play(1.0, after_control_period=after_control_period)

    monkeypatch.setattr(ensemble_tactic, "play_games", play)
    monkeypatch.setattr(ensemble_tactic, "Rollout", Looked)
    monkeypatch.setattr(ensemble_tactic, "moments", lambda sizes: [1, 3, 5, len(sizes) - 1])
    finding = ensemble_tactic.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {"win_rate": wins / 100, "win_rate_gained_by_tracking": pytest.approx(0.1)}
    assert asked == [("uniform", [*range(0, 200, 2)], SEED, GameConfig())] * 2
    assert shown == [("uniform", [14], {"seed": SEED, "config": GameConfig()})]
    assert tracks == [True, False]
    assert finding.series["pair"] == 7
    for team, cells in enumerate(finding.series["frames"][-1]["captured_cells"]):
        grounds = np.zeros((50, 50), bool)
        for column, row in cells:
            grounds[row, column] = True
        np.testing.assert_array_equal(grounds, looked[0].captures_here[0, team])
    assert [frame["seconds"] for frame in finding.series["frames"]] == [0.2, 0.4, 0.6, 1.0]


def test_the_tactic_with_one_command_never_leaves_the_centre_and_the_other_goes_to_the_last_drone():
    config = GameConfig()
    rows = np.arange(2)
    tracking = ensemble_tactic.Ensemble(config).act(LAST_ALONE, rows)
    staying = ensemble_tactic.Ensemble(config, last=0).act(LAST_ALONE, rows)
    np.testing.assert_array_equal(tracking[0], staying[0])
    np.testing.assert_array_equal(staying[0], staying[1])
    np.testing.assert_allclose(staying[0], staying[0].T)
    np.testing.assert_allclose(staying[0], staying[0][::-1, ::-1])
    centres = (np.arange(10) + 0.5) / 10
    around = np.hypot(*(np.stack(np.meshgrid(centres, centres)) - np.array([20.5 / 25, 4.5 / 25])[:, None, None]))
    np.testing.assert_allclose(tracking[1], np.exp(-(((around - 0.2) / 0.08) ** 2)))


# --- beside flocking ----------------------------------------------------------------------------------


def flight(seconds):
    seconds = np.array(seconds, float)
    return SimpleNamespace(
        seconds=seconds, metric=np.full((len(seconds), 60), 0.01), reaches=np.array([0.1, 0.2]), config=GameConfig(),
        series=lambda commands: {"commands": commands},
    )  # fmt: skip


def reached(count, soonest, latest=None, seeds=20):
    latest = soonest if latest is None else latest
    return [*np.linspace(soonest, latest, count), *[np.inf] * (seeds - count)]


@pytest.mark.parametrize(
    ("ergodic", "sequence", "adapter", "holds"),
    [
        (reached(20, 5, 9), reached(20, 40, 50), reached(0, 1), True),
        (reached(12, 5, 9), reached(0, 1), reached(0, 1), False),  # more than half, not surely
        (reached(20, 5, 9), reached(20, 40, 50), reached(8, 5), False),  # fewer than half, not surely
        (reached(20, 5, 25), reached(20, 10, 30), reached(0, 1), False),  # sooner, not surely
        (reached(20, 40, 50), reached(20, 5, 9), reached(0, 1), False),
    ],
)
def test_one_density_does_what_takes_a_flock_two_where_all_three_intervals_say_so(
    monkeypatch, ergodic, sequence, adapter, holds
):
    flown = []

    def fly(seeds):
        flown.append(seeds)
        names = flocking_comparison.ERGODIC, flocking_comparison.SEQUENCE, flocking_comparison.ADAPTER
        return dict(zip(names, map(flight, (ergodic, sequence, adapter)), strict=True))

    monkeypatch.setattr(flocking_comparison, "fly", fly)
    finding = flocking_comparison.measure(SEED)
    assert finding.supported == holds
    assert flown == [[3000 + number for number in range(20)]]
    assert finding.statistic["reached_by_ergodic"] == np.isfinite(ergodic).mean()
    assert finding.statistic["reached_by_density_to_flock"] == np.isfinite(adapter).mean()
    assert finding.statistic["median_seconds_two_attractors"] == np.median(sequence)
    assert [flight["commands"] for flight in finding.series["flights"].values()] == [1, 2, 1]


def test_flocks_get_the_second_attractor_half_way_and_are_compared_with_the_whole_target(monkeypatch):
    sent, command = [], flocking_flights.Simulator.command

    def note(simulator, team, commands):
        sent.append((simulator, int(simulator.games.ticks[0]), commands[0]))
        command(simulator, team, commands)

    monkeypatch.setattr(flocking_flights.Simulator, "command", note)
    found = flocking_flights.fly([0])
    attractors = [(simulator, tick, given) for simulator, tick, given in sent if hasattr(given, "position")]
    assert [(tick, tuple(given.position)) for _, tick, given in attractors] == [
        (0, flocking_flights.BIMODAL[0][:2]),
        (30 * 30, flocking_flights.BIMODAL[1][:2]),
    ]
    densities = [simulator for simulator, _, given in sent if not hasattr(given, "position")]
    controllers = [simulator.config.team_controllers[0] for simulator in densities]
    assert sorted(controllers) == ["ergodic", "flocking", "flocking"]
    wanted = densities[1].games.coefficients
    np.testing.assert_array_equal(attractors[0][0].games.coefficients, wanted)
    names = (flocking_flights.ERGODIC, flocking_flights.SEQUENCE, flocking_flights.ADAPTER)
    assert [found[name].config.team_controllers[0] for name in names] == ["ergodic", "flocking", "flocking"]
    # At first at the one mode alone, at (0.25, 0.25), in the end at the other: as often at each.
    assert found[flocking_flights.SEQUENCE].shares.min() > 0.2


def test_a_map_of_where_drones_were_is_upright():
    upper_left = np.zeros((10, 10))
    upper_left[9, 0] = 1.0
    simulator = flocking_flights.start(flocking_flights.lone_team(1), [0], upper_left)
    found = flocking_flights.Flight(simulator)
    assert found.map[13:, :12].sum() > found.map[:12, 13:].sum()
    assert found.map.mean() == pytest.approx(1.0)


# --- the order of drones ------------------------------------------------------------------------------

SAME, ROUNDING = permutation_invariance.SAME, permutation_invariance.ROUNDING


@pytest.mark.parametrize(
    ("farthest", "mean", "apart", "holds"),
    [
        (0.5 * ROUNDING, 0.0, 0.1, True),
        (2.0 * ROUNDING, 0.0, 0.1, False),
        (0.5 * ROUNDING, 0.9, 0.1, True),
        (0.5 * ROUNDING, 0.9, 0.8, False),
        (0.5 * ROUNDING, -0.9, 0.8, False),
        (0.5 * ROUNDING, -3.0, 0.1, False),
    ],
)
def test_which_drone_is_which_is_the_same_to_the_rounding_and_to_the_whole_interval(
    monkeypatch, farthest, mean, apart, holds
):
    seen = []

    class Metric:
        def __init__(self, simulator, team):
            self.is_other = len(seen) % 2
            seen.append(simulator)

        def observe(self):
            pass

        def value(self):
            difference = SAME * spread_around(mean, apart, permutation_invariance.SEEDS)
            return 0.01 + self.is_other * difference

    calls = []

    def distance(one, other, order):
        calls.append((int(one.games.ticks[0]), int(other.games.ticks[0]), order.tolist()))
        return np.array([0.0, 0.0, farthest] if len(calls) == 1 else [9.0])

    monkeypatch.setattr(permutation_invariance, "ErgodicMetric", Metric)
    monkeypatch.setattr(permutation_invariance, "distance", distance)
    monkeypatch.setattr(permutation_invariance, "JUDGED", 1)
    monkeypatch.setattr(permutation_invariance, "DRONES", 5)
    finding = permutation_invariance.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic["largest_distance_after_a_control_period"] == farthest
    assert finding.statistic["difference_of_metric_at_1_s"] == pytest.approx(SAME * mean, abs=1e-9)
    assert finding.seeds == [3000 + number for number in range(20)]
    assert calls[0][:2] == (153, 153) and [ticks[:2] for ticks in calls[1:]] == [(3 * n, 3 * n) for n in range(1, 11)]
    assert sorted(calls[0][2]) == [0, 1, 2, 3, 4] != calls[0][2]


# --- cadence ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rates", "holds"), [([0.3] * 20, True), ([0.1, 0.35] * 10, False), ([0.21, 0.23] * 10, True), ([0.1] * 20, False)]
)
def test_sizes_fluctuate_rapidly_where_the_lower_end_says_so(monkeypatch, rates, holds):
    asked = []

    def play(policy, opponent, numbers, *, seed, config):
        asked.append((policy, opponent, [*numbers], seed, config))
        seconds = np.random.default_rng(0).permutation(20) + 10.0
        return [
            game(2 * number, seconds=float(length), captures=rate * length, sizes=[10, 12, 9])
            for number, (length, rate) in enumerate(zip(seconds, rates, strict=True))
        ]

    monkeypatch.setattr(team_sizes, "play_games", play)
    finding = team_sizes.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic == {
        "captures_a_second": pytest.approx(np.mean(rates)), "turns_of_the_lead_a_game": 1.0
    }  # fmt: skip
    assert asked == [("ring", "uniform", [*range(0, 40, 2)], SEED, GameConfig())]
    assert finding.series["seconds"][finding.series["bold"]] == 20.0


def test_every_figure_has_its_rule_tried_here():
    tried = {module.FIGURE.name for module in globals().values() if hasattr(module, "FIGURE")}
    assert tried == set(FIGURES)
