from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.coverage import BIMODAL, lone_team
from benchmarks.systems_ladder import traits
from benchmarks.systems_ladder.asking import commands_for, density_of, spread
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric


@pytest.fixture
def lone():
    simulator = Simulator(lone_team(10, GameConfig()), 3)
    simulator.reset([0, 1, 2])
    return simulator


def test_each_trait_is_the_ratio_of_what_was_changed_to_what_was_not(monkeypatch):
    def kept(simulator, system, seconds, change=None):
        """Return a number that says how the games were flown, in place of the metric."""
        controller = simulator.config.controller
        if change is not None:
            change(simulator)
        size = int((simulator.teams == RED).sum(axis=1)[0])
        hard = 2.0 if controller.communication_radius == traits.TALK else 1.0
        return np.full(2, hard * 7.0**size)

    monkeypatch.setattr(traits, "SIZE", 4)
    monkeypatch.setattr(traits, "SIZES", (2, 5))
    monkeypatch.setattr(traits, "_kept", kept)
    monkeypatch.setattr(traits, "measure_bimodal", lambda *_, **__: None)
    found = traits.measure_traits("direct", GameConfig(), seed=0, starts=2, seconds=1)
    ratios = {name: found[name]["mean"] for name in ("size", "permutation", "captured", "leader", "talk")}
    expected = {"size": 7.0**3, "permutation": 1.0, "captured": 1 / 7, "leader": 1 / 7, "talk": 2.0}
    assert ratios == pytest.approx(expected)


@pytest.mark.parametrize("name", sorted(registered()))
def test_every_system_of_ours_reaches_the_target_that_changes_are_judged_by(name):
    config = lone_team(10, GameConfig(controllers=name))
    simulator = Simulator(config, 4)
    simulator.reset(range(4))
    metric = ErgodicMetric(simulator, RED)
    metric.observe()  # in the corner where they start
    missed = traits._value(metric, density_of(traits.own_target(name))).mean()
    assert traits._kept(simulator, name, 20).mean() < 0.1 * missed


def test_a_target_counts_from_a_change_on(lone):
    def leave(simulator):
        assert (simulator.games.ticks == 30).all()
        simulator.games.positions[:] = 0.01

    moved = traits._kept(lone, "ergodic", 1, leave)
    again = Simulator(lone.config, 3)
    again.reset([0, 1, 2])
    assert (again.games.ticks == 0).all() and (lone.games.ticks == 60).all()
    assert (moved != traits._kept(again, "ergodic", 1)).all()


def test_the_commands_that_it_takes_are_those_sent_until_both_modes_were_covered(monkeypatch):
    pushes = iter([0.1, 0.1, 0.2, 0.3, 0.3, 0.4])
    values = iter([[1.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [1.0, 0.0], [5.0, 7.0]])
    monkeypatch.setattr(traits, "commands_for", lambda *_: lambda *_: np.full((2, 10, 2), next(pushes)))
    monkeypatch.setattr(traits, "_value", lambda *_: np.array(next(values)))
    found = traits.measure_bimodal("direct", GameConfig(), seed=0, starts=2, seconds=6)
    assert (found["reached"], found["sent"]) == (2, 4)
    assert found["commands"] == pytest.approx(2.5), "the second game took two commands, the first one three"
    assert found["metric"]["mean"] == pytest.approx(6.0)


def test_the_leader_is_the_drone_nearest_to_the_middle(lone):
    nearest = np.hypot(*np.moveaxis(lone.positions - 0.5, -1, 0)).argmin(axis=1)
    traits._capture_leader(lone)
    assert [np.flatnonzero(teams == BLUE).tolist() for teams in lone.teams] == [[drone] for drone in nearest]


@pytest.mark.parametrize("name", sorted(registered()))
def test_every_kind_of_command_of_ours_asks_for_two_modes(name):
    config = lone_team(4, GameConfig(controllers=name))
    simulator = Simulator(config, 2)
    simulator.reset([0, 1])
    commands = commands_for(BIMODAL, system_of(name), config)
    for second in (0, 8, 9):
        simulator.command(RED, commands(second, simulator))
        simulator.advance(3)


def test_one_mode_is_asked_for_long_enough_to_get_there():
    config = lone_team(4, GameConfig(controllers="flocking"))
    simulator = Simulator(config, 1)
    commands = commands_for(BIMODAL, system_of("flocking"), config)
    places = [commands(second, simulator)[0][0, :2].tolist() for second in range(24)]
    first, second = ([x, y] for x, y, _ in BIMODAL)
    np.testing.assert_allclose(places, [first] * 8 + [second] * 8 + [first] * 8)


def test_places_are_spread_over_both_modes():
    places = spread(40, BIMODAL)
    for number, (x, y, sigma) in enumerate(BIMODAL):
        own = places[20 * number : 20 * number + 20]
        np.testing.assert_allclose(own.mean(axis=0), [x, y], atol=sigma / 3)
        assert sigma / 2 < own.std(axis=0).mean() < 1.3 * sigma
