"""Claims about teams alone: each verdict on either side of its bound, and each statistic on an answer known by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.paper import coverage, talk
from benchmarks.paper.claims import flocking_comparison, fluctuation, permutation_invariance, scale_invariance
from benchmarks.paper.drawings import DRAWINGS, interpolated
from benchmarks.paper.ours import communication, dropout, relays, short_memory
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric, basis
from tests import reference
from tests.benchmarks.paper.given import flights, found_by, spread_around

COVERED, SAME, ROUNDING = coverage.COVERED, permutation_invariance.SAME, permutation_invariance.ROUNDING
NOISE = np.linspace(-0.02, 0.02, 20)
SURELY, PERHAPS = (0.95, 0.01, True), (0.95, 0.5, False)
"""A mean metric in times of its bound, how far seeds are apart, and whether it is surely at most the bound."""


def judged_at(mean, apart, seeds):
    """Return a metric (seeds, 60) that is low only when it is judged."""
    found = np.full((seeds, 60), 100.0)
    found[:, coverage.JUDGED - 1] = COVERED * spread_around(mean, apart, seeds)
    return found


# --- one command, any team --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("place", "mean", "apart", "holds"),
    [((6, "ring"), *SURELY), ((6, "ring"), *PERHAPS), ((12, "two_spots"), *PERHAPS)],
)
def test_all_sizes_must_surely_cover_all_drawings(monkeypatch, place, mean, apart, holds):
    def fly(config, seeds, drawing):
        size, controller = config.drones_per_team[0], config.team_controllers[0]
        here = (size, drawing) == place and controller == "ergodic"

        def maps(cells):
            found = np.zeros((len(seeds), cells, cells))
            found[:, 0, int(size == 24)] = 1.0
            return found

        judged = judged_at(*((mean, apart) if here else (0.3, 0.0)), len(seeds))
        return SimpleNamespace(config=config, metric=judged, maps=maps)

    monkeypatch.setattr(scale_invariance, "fly", fly)
    found = found_by(scale_invariance)
    assert found["supported"] == holds and found["seeds"] == [*range(3000, 3020)]
    assert found["statistic"]["worst_metric_at_30_s_ergodic"] == pytest.approx(COVERED * mean)
    assert found["statistic"]["6_and_24_apart_ring_flocking"] == 1.0


@pytest.mark.parametrize(
    ("farthest", "mean", "apart", "holds"),
    [(0.5, 0.9, 0.1, True), (2.0, 0.0, 0.1, False), (0.5, 0.9, 0.8, False), (0.5, -0.9, 0.8, False)],
)
def test_which_drone_is_which_is_the_same_to_the_rounding_and_the_interval(monkeypatch, farthest, mean, apart, holds):
    seen, calls = [], []

    class Metric:
        def __init__(self, simulator, team):
            self.is_other = len(seen) % 2
            seen.append(simulator)

        def observe(self):
            pass

        def value(self):
            return 0.01 + self.is_other * SAME * spread_around(mean, apart, 20)

    def distance(one, other, order):
        calls.append((int(one.games.ticks[0]), int(other.games.ticks[0])))
        return np.array([0.0, farthest * ROUNDING] if len(calls) == 1 else [9.0])

    monkeypatch.setattr(permutation_invariance, "ErgodicMetric", Metric)
    monkeypatch.setattr(permutation_invariance, "distance", distance)
    monkeypatch.setattr(permutation_invariance, "JUDGED", 1)
    monkeypatch.setattr(permutation_invariance, "DRONES", 5)
    found = found_by(permutation_invariance)
    assert found["supported"] == holds
    assert found["statistic"]["largest_distance_after_a_control_period"] == pytest.approx(farthest * ROUNDING)
    assert found["statistic"]["difference_of_metric_at_1_s"] == pytest.approx(SAME * mean, abs=1e-9)
    assert calls == [(153, 153), *((3 * number, 3 * number) for number in range(1, 11))]


def test_a_permutation_moves_every_drone_with_all_that_is_its_own():
    simulator = Simulator(GameConfig(drones_per_team=(2, 11)), num_games=2)
    simulator.reset([0, 1])
    simulator.advance(6)
    order = np.random.default_rng(0).permutation(13)
    there = permutation_invariance.permuted(simulator.snapshot(), order)
    back = permutation_invariance.permuted(there, np.argsort(order))
    for name, one, moved, again in zip(there._fields, simulator.games, there, back, strict=True):
        axes = [axis for axis, length in enumerate(one.shape) if axis and length == 13]
        np.testing.assert_array_equal(moved, np.take(one, order, axes[0]) if axes else one, name)
        np.testing.assert_array_equal(again, one, name)
    other = Simulator(simulator.config, num_games=2)
    other.restore(there)
    assert permutation_invariance.distance(simulator, other, order).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("way", "target", "mean", "apart", "holds"),
    [(1, "uniform", *SURELY), (1, "uniform", *PERHAPS), (2, "bimodal", *PERHAPS), (0, "centre", *PERHAPS)],
)
def test_all_targets_must_surely_be_covered_whoever_is_captured(monkeypatch, way, target, mean, apart, holds):
    ways = [*fluctuation.CHANGES]

    def fly(config, seeds, name, changes):
        return judged_at(*((mean, apart) if (changes, name) == (ways[way], target) else (0.3, 0.0)), len(seeds))

    monkeypatch.setattr(fluctuation, "fly", fly)
    found = found_by(fluctuation)
    assert found["supported"] == (holds or way == 0), "a team that nobody leaves is there to compare with"
    assert found["parts"] == {changes: holds or changes != ways[way] for changes in ways[1:]}


@pytest.mark.parametrize(
    ("way", "expected"), [(0, [0] * 120), (1, [0] * 99 + [4] + [0] * 20), (2, ([0] * 9 + [1]) * 12)]
)
def test_drones_change_sides_when_it_is_said_and_as_many(monkeypatch, way, expected):
    moved = []

    def watched(simulator, *, then):
        for number in range(1, 10 * 12 + 1):
            before = simulator.teams.copy()
            then(number)
            moved.append((simulator.teams != before).sum(axis=1).tolist())

    monkeypatch.setattr(fluctuation, "metric_over_time", watched)
    config = GameConfig(drones_per_team=12, capture=CaptureConfig(enabled=False))
    fluctuation.fly(config, [1, 2], "centre", [*fluctuation.CHANGES][way])
    assert moved == [[number, number] for number in expected]


def test_a_drone_that_is_handed_over_has_a_new_team_and_no_past_and_nobody_else_has():
    simulator = coverage.start(GameConfig(drones_per_team=3), [4, 5], coverage.TARGETS["centre"])
    simulator.advance(30)
    before, chosen = simulator.snapshot(), np.zeros((2, 6), bool)
    chosen[0, 1] = chosen[1, 4] = True
    coverage.hand_over(simulator, chosen)
    games = simulator.games
    np.testing.assert_array_equal(games.teams != before.teams, chosen)
    for drones, kept in ((chosen, 0.0), (~chosen, 1.0)):
        for game in range(2):
            now, then = (one.memory[game][..., drones[game]] for one in (games, before))
            np.testing.assert_array_equal(now, kept * then)
        np.testing.assert_array_equal(games.memory_weight[drones], kept * before.memory_weight[drones])
    simulator.advance(30)
    assert simulator.occupancy.sum() == 2 * 6 * 30, "fields say what trails add up to"


# --- beside flocking --------------------------------------------------------------------------------------


def reached(count, soonest, latest=None, seeds=20):
    return [*np.linspace(soonest, soonest if latest is None else latest, count), *[np.inf] * (seeds - count)]


@pytest.mark.parametrize(
    ("ergodic", "sequence", "adapter", "wider", "holds"),
    [
        (reached(20, 5, 9), reached(20, 40, 50), reached(0, 1), (1.1, 0.01), [True, True]),
        (reached(12, 5, 9), reached(0, 1), reached(0, 1), (1.1, 0.01), [False, True]),  # more than half, not surely
        (reached(20, 5, 9), reached(20, 40, 50), reached(8, 5), (1.1, 0.01), [False, True]),  # fewer, not surely
        (reached(20, 5, 25), reached(20, 10, 30), reached(0, 1), (1.1, 0.01), [False, True]),  # sooner, not surely
        (reached(20, 5, 9), reached(20, 40, 50), reached(0, 1), (1.1, 0.6), [True, False]),  # wider, not surely
    ],
)
def test_one_drawing_does_what_takes_a_flock_two_attractors_where_all_intervals_say_so(
    monkeypatch, ergodic, sequence, adapter, wider, holds
):
    _, reaches = flocking_comparison.asked()
    wanted = reaches[0] / reaches[1]

    def flight(seconds):
        metric = np.where(np.arange(1, 61) < np.array(seconds, float)[:, None], 0.1, 0.001)
        places = np.full((20, 600, 12, 2), flocking_comparison.MODES[0])
        maps = np.full((20, 25, 25), 1 / 625)
        return SimpleNamespace(metric=metric, places=places, config=GameConfig(), maps=lambda cells: maps)

    names = (flocking_comparison.ERGODIC, flocking_comparison.SEQUENCE, flocking_comparison.ADAPTER)
    ways = dict(zip(names, map(flight, (ergodic, sequence, adapter)), strict=True))
    widths = 0.1 * np.linspace(wanted * spread_around(*wider, 20), np.ones(20), 6, axis=1)
    monkeypatch.setattr(flocking_comparison, "fly", lambda seeds: ways)
    monkeypatch.setattr(flocking_comparison, "spreads", lambda seeds: widths)
    found = found_by(flocking_comparison)
    assert [*found["parts"].values()] == holds and found["supported"] == all(holds)
    assert found["statistic"]["reached_by_drawing_to_flock"] == np.isfinite(adapter).mean()
    assert found["statistic"]["flock_at_least_weight_over_largest"] == pytest.approx(wanted * wider[0], rel=1e-5)


def test_flocks_get_the_compact_spot_after_the_diffuse_ones_share_of_the_time(monkeypatch):
    sent, command = [], Simulator.command

    def note(simulator, team, commands):
        if simulator.config.team_controllers[0] == "flocking":
            sent.append((int(simulator.games.ticks[0]), commands[0]))
        command(simulator, team, commands)

    monkeypatch.setattr(Simulator, "command", note)
    flocking_comparison.fly([0])
    attractors = [(tick, given.position, given.weight) for tick, given in sent if hasattr(given, "position")]
    shares, _ = flocking_comparison.asked()
    second = round(60 * shares[0] / sum(shares))
    first, other = flocking_comparison.MODES
    assert attractors == [(0, first, 50.0), (30 * second, other, 100.0)] and 30 < second < 60


def test_what_is_near_a_mode_and_when_a_metric_is_first_low_enough():
    second = np.array(flocking_comparison.MODES[1])
    squared = flocking_comparison.near_modes(np.array([[0.3, 0.4], second, [0.53, 0.53]]))
    expected = [[0.01, np.nan], [np.nan, 0.0], [np.nan, np.nan]]
    np.testing.assert_allclose(squared, expected, atol=1e-12)
    places = np.array([[0.4, 0.3], [0.3, 0.5], [0.99, 0.01]])
    np.testing.assert_allclose(flocking_comparison.reaches_of(places), [np.sqrt((0.01 + 0.04) / 2), np.nan])
    metric = np.array([[0.1, 0.004, 0.1], [0.1, 0.1, 0.1]])
    assert flocking_comparison.first_reached(metric).tolist() == [2.0, np.inf]


def test_each_spot_of_the_drawing_lies_around_its_middle_and_the_target_is_what_drones_fly_for():
    density, cells = DRAWINGS["two_spots"].density, 200
    target, centres = interpolated(density, cells), (np.arange(cells) + 0.5) / cells
    lower = np.add.outer(centres, centres) < 1.1
    for mode, part in zip(flocking_comparison.MODES, (target * lower, target * ~lower), strict=True):
        middle = (part.sum(axis=0) @ centres / part.sum(), part.sum(axis=1) @ centres / part.sum())
        assert middle == pytest.approx(mode, abs=0.02)
    simulator = Simulator()
    simulator.command(0, density[None])
    places = np.stack(np.meshgrid(centres, centres), axis=-1)
    found = np.einsum("yx,yxkl->kl", target / target.sum(), basis(places, 4))
    np.testing.assert_allclose(found, simulator.games.coefficients[0, 0, :4, :4], atol=2e-3)


# --- less talk --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "lone", "holds"),
    [
        ({}, 2.4, True),
        ({"communication_radius": 0.2}, 2.0, False),  # hears less and surely does better
        ({"message_loss": 0.9}, 2.0, False),
        ({}, 2.6, False),  # lone drones are worse than a team that hears nobody
        ({}, 1.6, False),  # or better
    ],
)
def test_talk_counts_where_no_step_to_less_of_it_helps_and_silence_is_loneliness(monkeypatch, changed, lone, holds):
    whole = GameConfig().controller
    rising = dict(zip(communication.RADII, np.linspace(1.0, 2.0, len(communication.RADII)), strict=True))
    losing = dict(zip(communication.LOSSES, np.linspace(1.0, 2.0, len(communication.LOSSES)), strict=True))

    def values(config, command, seeds, seconds):
        controller = config.controller
        value = losing[controller.message_loss]
        if controller.communication_radius != whole.communication_radius:
            value = rising[controller.communication_radius]
        if command is coverage.TARGETS["centre"] and any(
            getattr(controller, key) == one for key, one in changed.items()
        ):
            value = 1.0
        return (value + NOISE)[:, None]

    flights(monkeypatch, talk, values)
    monkeypatch.setattr(communication, "alone", lambda seeds, name: (lone if name == "centre" else 2.0) + NOISE)
    found = found_by(communication)
    assert found["supported"] == holds
    statistic = found["statistic"]
    assert statistic["radius_0_over_lone_drones_centre"] == pytest.approx(2.0 / lone, rel=0.01)
    assert statistic["steps_of_loss_that_fall_centre"] == int("message_loss" in changed)
    assert statistic["steps_of_radius_that_fall_centre"] == int("communication_radius" in changed)


def test_lone_drones_know_of_nobody_and_are_judged_together(monkeypatch):
    monkeypatch.setattr(communication, "DRONES", 3)
    monkeypatch.setattr(communication, "JUDGED", 1)
    target = coverage.TARGETS["centre"]
    (found,), together = communication.alone([4], "centre"), coverage.start(coverage.lone_team(3), [4], target)
    places = []
    for drone in range(3):
        one = coverage.start(coverage.lone_team(1), [0], target)
        one.games.positions[0, 0] = together.positions[0, drone]
        coverage.periods(one, 1, lambda _, one=one: places.append(reference.basis(one.positions[0, 0])))
    phi = together.games.coefficients[0, 0]
    assert found == pytest.approx(reference.ergodic_metric(np.mean(places, axis=0), phi), rel=1e-6)


@pytest.mark.parametrize(("times", "apart", "holds"), [(1.1, 0.02, True), (1.17, 0.2, False)])
def test_relays_mend_it_where_no_radius_is_surely_worse_than_silence(monkeypatch, times, apart, holds):
    def values(config, command, seeds, seconds):
        controller, here = config.controller, command is coverage.TARGETS["bimodal"]
        value = np.ones(seeds)
        if controller.relay and here and controller.communication_radius == 0.1:
            value = spread_around(times, apart, seeds)
        if not controller.relay and controller.communication_radius:
            value = 3.0 * value
        return value[:, None]

    flown = flights(monkeypatch, talk, values)
    found = found_by(relays)
    assert found["supported"] == holds and len(flown) == 2 * 3 * len(talk.RADII)
    assert found["statistic"]["most_times_silence_with_one_hop"] == pytest.approx(3.0)
    assert found["statistic"]["most_times_silence_with_relays"] == pytest.approx(times, rel=1e-5)


@pytest.mark.parametrize(
    ("worst", "apart", "holds"),
    [
        ({2.0: 3.0, 4.0: 2.0, 8.0: 1.2}, 0.02, True),
        ({2.0: 3.0, 4.0: 2.0, 8.0: 1.95}, 0.9, False),  # falls, not surely
        ({2.0: 1.5, 4.0: 2.0, 8.0: 1.2}, 0.02, False),
    ],
)
def test_memory_is_why_where_each_longer_one_surely_makes_the_worst_radius_better(monkeypatch, worst, apart, holds):
    def values(config, command, seeds, seconds):
        tau, radius = config.memory.controller, config.controller.communication_radius
        here = command is coverage.TARGETS["uniform"] and radius == 0.2
        luck = apart * np.sin(10 * np.arange(seeds)) if here and tau == 8.0 else 0.0
        # Silence is not the same at every time constant.
        return np.broadcast_to(tau * ((worst[tau] if here else 1.0 if radius == 0.0 else 0.5) + luck), seeds)[:, None]

    flights(monkeypatch, talk, values)
    found = found_by(short_memory)
    assert found["supported"] == holds
    assert found["statistic"]["at_4_s_over_2_s"] == pytest.approx(worst[4.0] / worst[2.0], rel=1e-5)


# --- drones that fail -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "mean", "apart", "holds"),
    [(0.1, 0.5, 0.1, True), (0.0, 0.95, 0.5, False), (0.1, 0.95, 0.5, False), (0.3, 9.0, 0.1, True)],
)
def test_a_target_is_kept_where_the_interval_is_low_with_up_to_half_of_the_drones_out(
    monkeypatch, rate, mean, apart, holds
):
    def values(config, command, seeds, seconds):
        here = config.drones_per_team == (12, 0) and config.dynamics.failure_rate == rate
        return judged_at(*((mean, apart) if here else (0.5, 0.1)), seeds)

    flights(monkeypatch, dropout, values)
    monkeypatch.setattr(dropout, "captured_and_back", lambda seeds, rate: np.full((len(seeds), 60), 0.25 * COVERED))
    found = found_by(dropout)
    assert found["supported"] == holds
    half = mean if rate == 0.1 else 0.5
    assert found["statistic"]["failing_over_captured_50_percent_out"] == pytest.approx(half / 0.25, rel=1e-5)


def test_drones_are_captured_and_come_back_at_the_rates_at_which_others_fail(monkeypatch):
    changed = []

    def watched(simulator, *, then):
        for number in range(1, 301):
            before = simulator.teams.copy()
            then(number)
            for team in (0, 1):
                changed.append((team, (before == team).sum(), ((before == team) & (simulator.teams != team)).sum()))

    monkeypatch.setattr(dropout, "metric_over_time", watched)
    dropout.captured_and_back(range(40), dropout.HALF_OUT)
    for team in (0, 1):
        drones, leaving = np.sum([counts for of, *counts in changed if of == team], axis=0)
        chance = 1 - np.exp(-0.01)  # of 0.1 a second, in a control period
        assert abs(leaving / drones - chance) < 4 * np.sqrt(chance * (1 - chance) / drones)
    assert dropout.share_out(dropout.HALF_OUT, dropout.REPAIR_RATE) == 0.5


# --- flights ----------------------------------------------------------------------------------------------


def test_the_metric_is_that_of_each_second_of_the_seeds_own_games():
    config, target = coverage.lone_team(4), coverage.TARGETS["bimodal"]
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
    upper_left, told = np.zeros((10, 10)), []
    upper_left[9, 0] = 1.0
    flight = coverage.Flight(coverage.start(coverage.lone_team(2), [0, 1, 2], upper_left), told.append)
    assert told == [1, 2, 3, 4] and flight.metric.shape == (3, 4) and flight.places.shape == (3, 40, 2, 2)
    for game, found in enumerate(flight.maps(5)):
        cells = np.minimum(np.floor(5 * flight.places[game].reshape(-1, 2)), 4)
        assert found.sum() == 1.0 and found[4, 0] == (cells == [0, 4]).all(axis=1).mean()
