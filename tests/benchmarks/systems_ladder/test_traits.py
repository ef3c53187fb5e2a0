from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.coverage import BIMODAL, lone_team
from benchmarks.systems_ladder import traits
from benchmarks.systems_ladder.bimodal import bimodal_commands, spread
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.simulator import Simulator


@pytest.fixture
def lone():
    simulator = Simulator(lone_team(10, GameConfig()), 3)
    simulator.reset([0, 1, 2])
    return simulator


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(traits, "SIZES", (2, 4, 5))


def test_each_trait_is_the_ratio_of_what_was_changed_to_what_was_not(small, monkeypatch):
    flown = []

    def metric(simulator, seconds):
        """Return a number that says how the games were flown, in place of the metric."""
        controller = simulator.config.controller
        flown.append(controller)
        size = int((simulator.teams == RED).sum(axis=1)[0])
        hard = 2.0 if controller.communication_radius == traits.TALK else 3.0 if controller.message_loss else 1.0
        simulator.games.ticks[:] += 30
        return hard * 7.0**size * simulator.games.ticks.astype(float)

    monkeypatch.setattr(traits, "_metric", metric)
    monkeypatch.setattr(traits, "measure_bimodal", lambda *_, **__: None)
    found = traits.measure_traits("direct", GameConfig(), seed=0, starts=2, seconds=1)
    ratios = {name: found[name]["mean"] for name in ("size", "permutation", "captured", "leader", "talk", "loss")}
    expected = {"size": 7.0**3, "permutation": 1.0, "captured": 1 / 7, "leader": 1 / 7, "talk": 2.0, "loss": 3.0}
    assert ratios == pytest.approx(expected)
    (lossy,) = [one for one in flown if one.message_loss]
    assert lossy.message_loss == traits.LOSS


def test_coverage_counts_from_a_change_on(lone):
    def leave(simulator):
        assert (simulator.games.ticks == 30).all()
        simulator.games.positions[:] = 0.01

    moved = traits._after(lone, 1, leave)
    again = Simulator(lone.config, 3)
    again.reset([0, 1, 2])
    assert (again.games.ticks == 0).all() and (lone.games.ticks == 60).all()
    assert (moved != traits._after(again, 1)).all()


def test_the_commands_that_it_takes_are_those_sent_until_both_modes_were_covered(monkeypatch):
    pushes = iter([0.1, 0.1, 0.2, 0.3, 0.3, 0.4])
    values = iter([[1.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [1.0, 0.0], [5.0, 7.0]])
    monkeypatch.setattr(traits, "bimodal_commands", lambda *_: lambda *_: np.full((2, 10, 2), next(pushes)))
    monkeypatch.setattr(traits, "_value", lambda *_: np.array(next(values)))
    found = traits.measure_bimodal("direct", GameConfig(), seed=0, starts=2, seconds=6)
    assert (found["reached"], found["sent"]) == (2, 4)
    assert found["commands"] == pytest.approx(2.5), "the second game took two commands, the first one three"
    assert found["metric"]["mean"] == pytest.approx(6.0)


def test_the_leader_is_the_drone_nearest_to_the_peak(lone):
    peak = np.zeros((3, 10, 10))
    peak[:, 2, 7] = 1.0
    lone.command(RED, peak)
    lone.advance(3)
    nearest = np.hypot(*np.moveaxis(lone.positions - [0.75, 0.25], -1, 0)).argmin(axis=1)
    traits._capture_leader(lone)
    assert [np.flatnonzero(teams == BLUE).tolist() for teams in lone.teams] == [[drone] for drone in nearest]


@pytest.mark.parametrize("name", sorted(registered()))
def test_every_kind_of_command_of_ours_asks_for_two_modes(name):
    config = lone_team(4, GameConfig(controllers=name))
    simulator = Simulator(config, 2)
    simulator.reset([0, 1])
    commands = bimodal_commands(system_of(name), config)
    for second in (0, 8, 9):
        simulator.command(RED, commands(second, simulator))
        simulator.advance(3)


def test_one_mode_is_asked_for_long_enough_to_get_there():
    config = lone_team(4, GameConfig(controllers="flocking"))
    simulator = Simulator(config, 1)
    commands = bimodal_commands(system_of("flocking"), config)
    places = [commands(second, simulator)[0][0, :2].tolist() for second in range(24)]
    first, second = ([x, y] for x, y, _ in BIMODAL)
    np.testing.assert_allclose(places, [first] * 8 + [second] * 8 + [first] * 8)


def test_places_are_spread_over_both_modes():
    places = spread(40)
    for number, (x, y, sigma) in enumerate(BIMODAL):
        own = places[20 * number : 20 * number + 20]
        np.testing.assert_allclose(own.mean(axis=0), [x, y], atol=sigma / 3)
        assert sigma / 2 < own.std(axis=0).mean() < 1.3 * sigma
