from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.figures import coverage
from swarm_pz.figures.claims import flocking_flights


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


def test_the_first_time_that_a_metric_is_low_enough():
    metric = np.array([[0.1, 0.004, 0.1], [0.1, 0.1, 0.1], [0.001, 0.1, 0.1]])
    assert flocking_flights.first_reached(metric).tolist() == [2.0, np.inf, 1.0]


def test_what_is_near_a_mode():
    squared = flocking_flights.near_modes(np.array([[0.25, 0.35], [0.75, 0.75], [0.5, 0.5]]))
    assert squared[0] == pytest.approx([0.01, np.nan], nan_ok=True)
    assert squared[1] == pytest.approx([np.nan, 0.0], nan_ok=True)
    assert np.isnan(squared[2]).all()


def test_what_the_target_asks_near_its_modes():
    shares, reaches = flocking_flights.asked()
    # A Gaussian has 1 - exp(-a) of its mass within r, a = r^2 / (2 sigma^2), at a mean square of
    # 2 sigma^2 (1 - a exp(-a) / (1 - exp(-a))).
    for (_, _, sigma), share, reach in zip(coverage.BIMODAL, shares, reaches, strict=True):
        a = flocking_flights.NEAR**2 / (2 * sigma**2)
        inside = 1 - np.exp(-a)
        assert share == pytest.approx(inside / 2, abs=0.02)  # the square cuts off what lies beyond its walls
        assert reach == pytest.approx(np.sqrt(2 * sigma**2 * (1 - a * np.exp(-a) / inside)), rel=0.02)
