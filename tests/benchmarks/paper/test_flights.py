"""Claims about teams alone: each verdict on either side of its bound, and each statistic on an answer known by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.paper import coverage
from benchmarks.paper.claims import flocking_comparison, fluctuation, permutation_invariance, scale_invariance
from benchmarks.paper.coverage import ErgodicMetric, basis
from benchmarks.paper.drawings import DRAWINGS, interpolated
from benchmarks.paper.figure import CONVERGED
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.benchmarks.paper.given import SETTING, found_by, spread_around

COVERED, SAME, ROUNDING = coverage.COVERED, permutation_invariance.SAME, permutation_invariance.ROUNDING


def falling_to(end, judged, apart, seeds):
    """Return a metric (seeds, 60) that begins at 1, and is in the end and when it is judged so many times a bound."""
    found = np.ones((seeds, 60))
    found[:, -1] = CONVERGED * spread_around(end, apart, seeds)
    found[:, coverage.JUDGED - 1] = COVERED * spread_around(judged, apart, seeds)
    return found


# --- one command, any team --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("end", "judged", "away", "papers", "ours"),
    [
        (0.5, 0.9, 0, [True, True], [True]),
        (0.5, 1.1, 0, [True, True], [False]),  # our bound decides nothing
        (1.1, 0.9, 0, [False, True], [True]),
        (0.5, 0.9, 6, [True, False], [True]),  # most maps are nearest to another drawing
    ],
)
def test_all_sizes_converge_to_all_drawings_where_the_worst_does(monkeypatch, end, judged, away, papers, ours):
    flown = []

    def fly(config, seeds, command):
        flown.append((config, command))
        size, drawing = config.drones_per_team[0], (len(flown) - 1) // 6
        here = size == 6 and drawing == 1 and config.team_controllers[0] == "ergodic"
        other = list(DRAWINGS.values())[(drawing + (size <= 12 if away else 0)) % 3].density(SETTING.mapping)
        cells = np.argwhere(other > 0.8)[:, ::-1]
        places = np.broadcast_to((cells + 0.5) / 10, (len(seeds), 1, *cells.shape))

        def maps(cells):
            found = np.zeros((len(seeds), cells, cells))
            found[:, 0, int(size == 24)] = 1.0
            return found

        metric = falling_to(*((end, judged) if here else (0.3, 0.3)), 0.01, len(seeds))
        return SimpleNamespace(config=config, metric=metric, maps=maps, places=places)

    monkeypatch.setattr(scale_invariance, "fly", fly)
    found = found_by(scale_invariance)
    assert (found.papers, found.ours) == (papers, ours) and found.record["seeds"] == [*range(3000, 3020)]
    assert found.values[0] == pytest.approx(CONVERGED * end) and found.values[-2:] == [1.0, 1.0]
    assert found.verdict == ("reproduced" if all(papers) else "partly")
    np.testing.assert_array_equal(flown[6][1], DRAWINGS["two_spots"].density("firm"))


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
    assert all(found.ours) == holds
    assert found.values == pytest.approx([1.0, SAME * mean, farthest * ROUNDING], rel=1e-5, abs=1e-9)
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
    ("way", "target", "end", "judged"), [(1, "uniform", 0.5, 0.9), (1, "uniform", 1.1, 0.9), (2, "bimodal", 0.5, 1.1)]
)
def test_a_team_converges_whoever_is_captured_where_the_worst_target_says_so(monkeypatch, way, target, end, judged):
    ways = [*fluctuation.CHANGES]

    def fly(config, seeds, name, changes):
        here = (changes, name) == (ways[way], target)
        return falling_to(*((end, judged) if here else (0.3, 0.3)), 0.01, len(seeds))

    monkeypatch.setattr(fluctuation, "fly", fly)
    found = found_by(fluctuation)
    assert found.papers == [end < 1 or changes != ways[way] for changes in ways[1:]]
    assert found.ours == [judged < 1 or changes != ways[way] for changes in ways]


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


def test_a_drawing_serves_both_spots_and_an_attractor_one_where_all_intervals_say_so(monkeypatch):
    lower, upper = flocking_comparison.MODES
    near = {"ergodic": (lower, upper), "alone": (lower, lower), "turns": (lower, upper)}

    def flight(way, seeds, soon=5):
        places = np.empty((len(seeds), 10, 4, 2))
        places[:, :5], places[:, 5:] = near[way]
        places[:, :5, :, 0] += 0.08
        places[:, 5:, :, 0] += 0.04
        metric = np.where(np.arange(1, 61) < soon, 0.1, 0.001) * np.ones((len(seeds), 1))
        maps = np.full((len(seeds), 25, 25), 1 / 625)
        return SimpleNamespace(metric=metric, places=places, maps=lambda cells: maps)

    tried = []

    def flock(config, seeds, target, weights, schedule=None):
        tried.append((seeds, schedule, weights))
        return flight("alone" if schedule is None else "turns", seeds, 16 if schedule == (12, 3) else 40)

    monkeypatch.setattr(flocking_comparison, "start", lambda config, seeds, target: seeds)
    monkeypatch.setattr(flocking_comparison, "Flight", lambda seeds: flight("ergodic", seeds))
    monkeypatch.setattr(flocking_comparison, "flock", flock)
    widths = np.linspace(0.13, 0.12, 3) * spread_around(1.0, 0.001, 20)[:, None]
    monkeypatch.setattr(flocking_comparison, "spreads", lambda *given: widths)
    found = found_by(flocking_comparison)
    assert found.papers == [True] * 5 and found.ours == [False]
    by_name = {part["asked"]: part["value"] for part in found.record["parts"]}
    assert by_name["one drawing: diffuse spot over compact one, rms, above 1"] == pytest.approx(2.0)
    assert by_name["drawn spots, s to E=0.005 first, flock: best schedule"] == 16.0
    assert by_name["drawn spots, best schedule: lower one, s"] == 12.0
    searched, measured = ({tuple(seeds) for seeds, when, _ in tried if len(seeds) == n} for n in (5, 20))
    assert searched == {(3500, 3501, 3502, 3503, 3504)} and measured == {tuple(range(3000, 3020))}
    assert {weights for *_, weights in tried} == {(50.0, 100.0), (100.0, 100.0)}, "equal spots, equal weights"
    near["ergodic"] = (lower, lower)
    assert found_by(flocking_comparison).papers[0] is False
    near["alone"] = (lower, upper)
    assert found_by(flocking_comparison).papers[1] is False


def test_attractors_take_turns_as_the_schedule_says():
    sent = []
    told = flocking_comparison.turns((4, 2), lambda mode: sent.append((second, mode)))
    for second in range(1, 13):
        told(second)
    assert sent == [(4, 1), (6, 0), (10, 1), (12, 0)]


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


def test_each_spot_of_the_drawing_lies_around_its_middle_and_the_target_is_what_drones_fly_for():
    density, cells = DRAWINGS["two_spots"].density("firm"), 200
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
