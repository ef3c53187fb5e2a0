from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper import coverage
from benchmarks.paper.claims import flocking_flights


def sent_by(monkeypatch, fly):
    """Call a function, and return what it returns and all commands: simulator, tick and command of the first game."""
    sent, command = [], flocking_flights.Simulator.command

    def note(simulator, team, commands):
        sent.append((simulator, int(simulator.games.ticks[0]), commands[0]))
        command(simulator, team, commands)

    monkeypatch.setattr(flocking_flights.Simulator, "command", note)
    return fly([0]), sent


def test_flocks_get_the_compact_spot_after_the_diffuse_ones_share_and_are_compared_with_the_whole_target(monkeypatch):
    found, sent = sent_by(monkeypatch, flocking_flights.fly)
    attractors = [(simulator, tick, given) for simulator, tick, given in sent if hasattr(given, "position")]
    assert [(tick, given.position, given.weight) for _, tick, given in attractors] == [
        (0, flocking_flights.MODES[0], 50.0),
        (30 * flocking_flights.switch(), flocking_flights.MODES[1], 100.0),
    ]
    densities = [simulator for simulator, _, given in sent if not hasattr(given, "position")]
    controllers = [simulator.config.team_controllers[0] for simulator in densities]
    assert sorted(controllers) == ["ergodic", "flocking", "flocking"]
    wanted = densities[1].games.coefficients[:, 0]
    np.testing.assert_array_equal(attractors[0][0].games.coefficients[:, 0], wanted)
    names = (flocking_flights.ERGODIC, flocking_flights.SEQUENCE, flocking_flights.ADAPTER)
    assert [found[name].config.team_controllers[0] for name in names] == ["ergodic", "flocking", "flocking"]
    # At first at the one mode alone, in the end at the other: at each as long as the drawing asks, about.
    shares = flocking_flights.series(found[flocking_flights.SEQUENCE], 2)["share"]["mean"]
    asked, _ = flocking_flights.asked()
    assert shares == pytest.approx(asked / asked.sum(), abs=0.2)


def test_flocks_stay_longer_at_the_spot_that_holds_more():
    shares, _ = flocking_flights.asked()
    assert 30 < flocking_flights.switch() == round(60 * shares[0] / sum(shares)) < 60


def test_spreads_are_of_flocks_that_have_come_to_an_attractor_of_each_weight(monkeypatch):
    monkeypatch.setattr(coverage, "SECONDS", 2)
    found, sent = sent_by(monkeypatch, flocking_flights.spreads)
    attractors = [given for _, _, given in sent if hasattr(given, "position")]
    assert [given.weight for given in attractors] == flocking_flights.weights() == [50, 60, 70, 80, 90, 100]
    assert {given.position for given in attractors} == {(0.5, 0.5)}
    assert found.shape == (1, 6) and (found > 0.02).all() and (found < 0.3).all()


def test_the_first_time_that_a_metric_is_low_enough():
    metric = np.array([[0.1, 0.004, 0.1], [0.1, 0.1, 0.1], [0.001, 0.1, 0.1]])
    assert flocking_flights.first_reached(metric).tolist() == [2.0, np.inf, 1.0]


def test_what_is_near_a_mode():
    squared = flocking_flights.near_modes(np.array([[0.3, 0.4], flocking_flights.MODES[1], [0.53, 0.53]]))
    assert squared[0] == pytest.approx([0.01, np.nan], nan_ok=True)
    assert squared[1] == pytest.approx([np.nan, 0.0], nan_ok=True)
    assert np.isnan(squared[2]).all()


def test_what_a_drawing_asks_near_its_modes(monkeypatch):
    density = np.zeros((10, 10))
    density[2:4, 2:4] = 3.0  # around (0.3, 0.3)
    density[7, 7] = 1.0  # at (0.75, 0.75)
    monkeypatch.setattr(flocking_flights, "DRAWING", flocking_flights.DRAWING.__class__((), density))
    shares, reaches = flocking_flights.asked()
    assert shares == pytest.approx([12 / 13, 1 / 13], rel=1e-3)
    # Along an axis, bilinear cells are hats of variance 0.1^2 / 6; four are off the middle by 0.05, one by 0.02.
    assert reaches == pytest.approx(np.sqrt(2 * (0.1**2 / 6 + np.array([0.05, 0.02]) ** 2)), rel=0.01)


def test_the_reach_is_the_root_mean_square_distance_of_who_is_near_a_mode():
    second = np.array(flocking_flights.MODES[1])
    places = np.array([[[0.4, 0.3], [0.3, 0.5], [0.99, 0.01]]])
    assert flocking_flights.reaches_of(places) == pytest.approx([np.sqrt((0.01 + 0.04) / 2), np.nan], nan_ok=True)
    assert flocking_flights.reaches_of(np.array([second - [0.03, 0.04]])) == pytest.approx([np.nan, 0.05], nan_ok=True)
