from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.figures.coverage import BIMODAL, lone_team
from swarm_pz.figures.systems import traits
from swarm_pz.figures.systems.bimodal import bimodal_commands, spread
from swarm_pz.simulator import Simulator


@pytest.fixture
def lone():
    simulator = Simulator(lone_team(10, GameConfig()), 3)
    simulator.reset([0, 1, 2])
    return simulator


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(traits, "SIZES", (2, 4, 5))


def test_traits_are_numbers_with_intervals_and_the_same_again(small):
    found, again = (traits.measure_traits("ergodic", GameConfig(), seed=0, starts=2, seconds=2) for _ in range(2))
    assert found == again
    assert set(found["coverage"]) == {"2", "4", "5"} and found["takes"] == "density"
    for name in ("size", "permutation", "captured", "leader", "talk", "loss"):
        low, high = found[name]["ci95"]
        assert 0 < low <= found[name]["mean"] * (1 + 1e-3) and found[name]["mean"] <= high * (1 + 1e-3)
    assert found["bimodal"]["starts"] == 2 and found["bimodal"]["sent"] == 1


def test_who_does_nothing_is_as_bad_in_another_order_and_with_hard_talk(small):
    found = traits.measure_traits("direct", GameConfig(), seed=0, starts=2, seconds=1)
    for name in ("permutation", "talk", "loss"):
        assert found[name]["mean"] == pytest.approx(1.0)


def test_a_share_of_the_drones_changes_sides(lone):
    traits._capture(lone, 0.3, np.random.default_rng(0))
    assert (lone.sizes[:, BLUE] == 3).all()


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


def test_places_are_spread_over_both_modes():
    places = spread(40)
    for number, (x, y, sigma) in enumerate(BIMODAL):
        own = places[20 * number : 20 * number + 20]
        np.testing.assert_allclose(own.mean(axis=0), [x, y], atol=sigma / 3)
        assert sigma / 2 < own.std(axis=0).mean() < 1.3 * sigma
