"""Talk that reaches only so far or gets lost, and drones that fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig
from swarm_pz.kernels.controllers.communication import communication_parameters
from swarm_pz.kernels.game import find_heard
from swarm_pz.simulator import Simulator
from tests.kernels.states import PEACE, SOFT, assert_mirrored, put, random_state, solved
from tests.reference import ControllerReference, basis
from tests.reference_variants import VariantRules, heard_within, relayed

REFERENCE = ControllerReference(r=20.0)
"""The slow controller with the gains of SOFT."""


def clear_radius(generator, positions) -> float:
    """Draw a radius that no two drones are apart by, to 1e-6."""
    distances = np.linalg.norm(positions[:, None].astype(float) - positions[None], axis=-1)
    while np.abs(distances - (radius := float(generator.uniform(0.02, 0.8)))).min() <= 1e-6:
        pass
    return radius


@pytest.mark.parametrize("fails", [False, True])
@pytest.mark.parametrize("how", ["near", "relays", "lost", "all"])
def test_it_does_what_its_slow_mirror_does(how, fails):
    generator, farther = np.random.default_rng(0), 0
    for _ in range(6):
        state = random_state(generator, int(generator.integers(1, 31)))
        failed = generator.random(len(state.teams)) < 0.3 * fails
        radius = clear_radius(generator, state.positions) if how in ("near", "relays") else None
        talk = {"communication_radius": radius, "message_loss": float(how == "lost"), "relay": how == "relays"}
        dynamics = DynamicsConfig(failure_rate=1e-9 if fails else 0.0)
        simulator = solved(state, failed, controller=SOFT.replace(**talk), dynamics=dynamics)
        alone = np.eye(len(state.teams), dtype=bool)
        near = alone if how == "lost" else heard_within(state.positions, radius or math.inf)
        heard = relayed(near, state.teams, failed) if how == "relays" else near
        assert_mirrored(simulator, state, REFERENCE, heard=heard, failed=failed)
        farther += int((heard & ~near).sum())
    assert farther > 0 or how != "relays"


def heard_in_game(games, parameters, luck):
    heard, first = np.empty((1, 20, 20), np.bool_), np.zeros(1, np.int64)
    find_heard(games.positions, games.teams, first, np.array([luck]), first + 3, parameters, heard)
    return heard[0]


@pytest.mark.parametrize("loss", [0.0, 0.6])
def test_a_relayed_message_is_one_that_a_chain_of_messages_carries(loss):
    generator = np.random.default_rng(10)
    for seed in range(4):
        state = random_state(generator, 20)
        simulator = Simulator(GameConfig(drones_per_team=(20, 0), capture=PEACE))
        put(simulator, state)
        options = SOFT.replace(communication_radius=0.3, message_loss=loss)
        one_hop, closed = (
            heard_in_game(simulator.games, communication_parameters(GameConfig(controller=one)), np.uint64(seed))
            for one in (options, options.replace(relay=True))
        )
        np.testing.assert_array_equal(closed, relayed(one_hop, state.teams))
        if loss == 0.0:  # else who hears me may not be heard by me
            np.testing.assert_array_equal(closed, closed.T)


def heard_by_two(simulator, state) -> np.ndarray:
    """Return which of two team-mates heard the other in each game's last solve, (E, 2) bool."""
    lone, *_ = REFERENCE.solve(*state[:5], simulator.games.coefficients[0], heard=np.eye(2, dtype=bool))
    both, *_ = REFERENCE.solve(*state[:5], simulator.games.coefficients[0])
    to_lone, to_both = (np.linalg.norm(simulator.games.accelerations - one, axis=-1) for one in (lone, both))
    assert np.minimum(to_lone, to_both).max() < 0.01 * np.linalg.norm(lone - both, axis=-1).min()
    return to_both < to_lone


def test_each_message_is_lost_by_itself_and_anew_at_every_solve():
    games, loss = 1000, 0.3
    state = random_state(np.random.default_rng(3), 2)._replace(teams=np.zeros(2, np.int8))
    controller = SOFT.replace(message_loss=loss)
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=PEACE, controller=controller), num_games=games)
    put(simulator, state)
    simulator.advance(1)
    first = heard_by_two(simulator, state)
    simulator.advance(2)
    # The same drones once more: only the luck is another.
    simulator.games.positions[:], simulator.games.velocities[:] = state.positions, state.velocities
    simulator.games.memory[:] = np.moveaxis(state.memory, 0, -1)
    simulator.games.memory_weight[:] = state.memory_weight
    simulator.advance(1)
    second = heard_by_two(simulator, state)

    share, four_sigma = 1.0 - loss, 4 * math.sqrt(loss * (1 - loss) / games)
    for heard in (*first.T, *second.T):
        assert abs(heard.mean() - share) < four_sigma
    for one, other in ((first[:, 0], first[:, 1]), (first[:, 0], second[:, 0]), (first[:, 1], second[:, 0])):
        assert abs((one & other).mean() - share**2) < 4 * math.sqrt(share**2 * (1 - share**2) / games)


def test_a_failed_drone_stands_still_writes_no_trail_and_returns_with_an_empty_memory():
    dynamics = DynamicsConfig(failure_rate=0.5, repair_rate=2.0)
    config = GameConfig(capture=CaptureConfig(threshold=0.5), dynamics=dynamics)
    returned, captured, captured_failed = 0, 0, 0
    for seed in range(2):
        simulator, generator = Simulator(config), np.random.default_rng(seed)
        simulator.reset([seed])
        games, rules = simulator.games, VariantRules(simulator.teams[0], threshold=0.5)
        for tick in range(200):
            if tick % 30 == 0:
                for team in range(2):
                    simulator.command(team, generator.random((1, 10, 10)) ** 4)
            before = simulator.snapshot()
            simulator.advance(1)
            failed = games.failed[0].copy()
            np.testing.assert_array_equal(simulator.positions[0, failed], before.positions[0, failed])
            assert not simulator.velocities[0, failed].any() and not games.accelerations[0, failed].any()

            back = before.failed[0] & ~failed
            assert tick % 3 == 0 or not back.any()
            for drone in np.flatnonzero(back & (simulator.teams[0] == before.teams[0])):
                assert games.memory_weight[0, drone] == 1.0
                place = before.positions[0, drone].astype(float)
                np.testing.assert_allclose(games.memory[0, :, :, drone], basis(place), atol=1e-5)
                returned += 1

            lost = rules.tick(simulator.positions[0], failed=failed)
            np.testing.assert_array_equal(simulator.teams[0], rules.teams)
            np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
            captured, captured_failed = captured + len(lost), captured_failed + int(failed[lost].sum())
            if simulator.decided[0]:
                break
    assert returned > 10
    assert captured > captured_failed > 0


@pytest.mark.parametrize("preset", ["paper", "released"])
def test_a_team_of_which_every_drone_has_failed_stands(preset):
    config = GameConfig.preset(preset)
    capture, dynamics = config.capture.replace(enabled=False), config.dynamics.replace(failure_rate=1e-9)
    simulator = Simulator(config.replace(dynamics=dynamics, capture=capture))
    simulator.reset([0])
    simulator.advance(30)
    games = simulator.games
    games.failed[0, 10:], games.velocities[0, 10:], games.accelerations[0, 10:] = True, 0.0, 0.0
    there = simulator.positions[0, 10:].copy()
    simulator.advance(30)
    np.testing.assert_array_equal(games.failed[0], simulator.teams[0] == 1)
    np.testing.assert_array_equal(simulator.positions[0, 10:], there)
    for array in (simulator.positions, simulator.capture_field, games.memory):
        assert np.isfinite(array).all()
