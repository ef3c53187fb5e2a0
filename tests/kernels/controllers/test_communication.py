"""Talk that reaches only so far or gets lost, and drones that fail."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from swarm_pz.config import CaptureConfig, ControllerConfig, DynamicsConfig, GameConfig
from swarm_pz.kernels.controllers.communication import communication_parameters, who_hears_whom
from swarm_pz.kernels.game import swarm_of
from swarm_pz.simulator import Simulator
from tests.kernels.states import PEACE, SOFT, assert_mirrored, put, random_state, solved
from tests.reference import ControllerReference, basis
from tests.reference_variants import VariantRules, heard_within, relayed

REFERENCE = ControllerReference(r=20.0)
"""The slow controller with the gains of SOFT."""


def communication(**options) -> ControllerConfig:
    """Return soft gains with these fields."""
    return SOFT.replace(**options)


def clear_radius(generator, positions) -> float:
    """Draw a radius that no two drones are apart by, to 1e-6."""
    distances = np.linalg.norm(positions[:, None].astype(float) - positions[None], axis=-1)
    while True:
        radius = float(generator.uniform(0.02, 0.8))
        if np.abs(distances - radius).min() > 1e-6:
            return radius


def test_local_talk_matches_the_reference():
    generator = np.random.default_rng(0)
    for _ in range(30):
        state = random_state(generator, int(generator.integers(1, 31)))
        radius = clear_radius(generator, state.positions)
        simulator = solved(state, controller=communication(communication_radius=radius, message_loss=0.0))
        assert_mirrored(simulator, state, REFERENCE, heard=heard_within(state.positions, radius))


def test_a_radius_beyond_the_square_is_none():
    generator = np.random.default_rng(1)
    for _ in range(10):
        state = random_state(generator, 20)
        far = solved(state, controller=communication(communication_radius=2.0)).games.accelerations
        everybody = solved(state, controller=SOFT).games.accelerations
        np.testing.assert_allclose(far, everybody, atol=1e-4 * np.abs(everybody).max())


def test_a_radius_of_zero_and_the_loss_of_every_message_leave_each_drone_alone():
    generator = np.random.default_rng(2)
    for _ in range(5):
        state = random_state(generator, 8)
        no_reach = solved(state, controller=communication(communication_radius=0.0)).games.accelerations[0]
        no_luck = solved(state, controller=communication(message_loss=1.0)).games.accelerations[0]
        np.testing.assert_allclose(no_reach, no_luck, atol=1e-4 * np.abs(no_reach).max())
        for i in range(8):
            only = slice(i, i + 1)
            one = state._replace(
                **{
                    name: getattr(state, name)[only]
                    for name in ("positions", "velocities", "teams", "memory", "memory_weight")
                }
            )
            alone = solved(one, controller=SOFT).games.accelerations[0, 0]
            np.testing.assert_allclose(no_reach[i], alone, atol=1e-4 * np.abs(alone).max())


# --- messages that are passed on --------------------------------------------------------------------------------------


def test_relays_match_the_reference():
    generator = np.random.default_rng(6)
    farther = 0
    for _ in range(30):
        state = random_state(generator, int(generator.integers(2, 31)))
        failed = generator.random(len(state.teams)) < 0.2
        radius = clear_radius(generator, state.positions)
        simulator = solved(
            state,
            failed,
            controller=communication(communication_radius=radius, relay=True),
            dynamics=DynamicsConfig(failure_rate=1e-9),
        )
        near = heard_within(state.positions, radius)
        heard = relayed(near, state.teams, failed)
        assert_mirrored(simulator, state, REFERENCE, heard=heard, failed=failed)
        farther += int((heard & ~near).sum())
    assert farther > 100


def in_a_row(generator, drones, apart):
    """Return a state of one team whose drones stand side by side, so far apart, in an order of their own."""
    along = 0.05 + apart * generator.permutation(drones)
    return random_state(generator, drones)._replace(
        positions=np.stack([along, np.full(drones, 0.4)], axis=1).astype(np.float32), teams=np.zeros(drones, np.int8)
    )


def test_a_connected_team_with_relays_is_one_in_which_all_hear_all():
    generator = np.random.default_rng(7)
    for drones in (2, 3, 9):
        state = in_a_row(generator, drones, 0.1)
        row = solved(state, controller=communication(communication_radius=0.11, relay=True)).games.accelerations
        everybody = solved(state, controller=SOFT).games.accelerations
        np.testing.assert_allclose(row, everybody, atol=1e-4 * np.abs(everybody).max())


def test_relays_bring_nothing_to_a_drone_that_hears_nobody():
    generator = np.random.default_rng(8)
    for options in ({"communication_radius": 0.0}, {"message_loss": 1.0}, {"communication_radius": 0.09}):
        state = in_a_row(generator, 8, 0.1)
        silent = solved(state, controller=communication(**options)).games.accelerations
        relaying = solved(state, controller=communication(**options, relay=True)).games.accelerations
        np.testing.assert_array_equal(relaying, silent)


def test_relays_of_a_team_do_not_pass_through_the_other():
    state = in_a_row(np.random.default_rng(9), 3, 0.1)
    between = state.positions[:, 0].argsort()[1]
    teams = (np.arange(3) == between).astype(np.int8)
    state = state._replace(teams=teams)
    radius = {"communication_radius": 0.11}
    relaying = solved(state, controller=communication(**radius, relay=True)).games.accelerations
    np.testing.assert_array_equal(relaying, solved(state, controller=communication(**radius)).games.accelerations)


@njit
def heard_in_game(games, parameters, luck):
    return who_hears_whom(swarm_of(games, 0), parameters, luck, 3)


@pytest.mark.parametrize("loss", [0.0, 0.6])
def test_a_relayed_message_is_one_that_a_chain_of_messages_carries(loss):
    generator = np.random.default_rng(10)
    for seed in range(10):
        state = random_state(generator, 20)
        simulator = Simulator(GameConfig(drones_per_team=(20, 0), capture=PEACE))
        put(simulator, state)
        luck = np.uint64(seed)
        options = communication(communication_radius=0.3, message_loss=loss)
        one_hop, closed = (
            heard_in_game(simulator.games, communication_parameters(GameConfig(controller=controller)), luck)
            for controller in (options, options.replace(relay=True))
        )
        np.testing.assert_array_equal(closed, relayed(one_hop, state.teams))
        if loss == 0.0:  # else who hears me may not be heard by me
            np.testing.assert_array_equal(closed, closed.T)


# --- messages that get lost -------------------------------------------------------------------------------------------


def heard_by_two(simulator, state) -> np.ndarray:
    """Return which of two team-mates heard the other in each game's last solve, (E, 2) bool."""
    lone, *_ = REFERENCE.solve(*state[:5], simulator.games.coefficients[0], heard=np.eye(2, dtype=bool))
    both, *_ = REFERENCE.solve(*state[:5], simulator.games.coefficients[0])
    accelerations = simulator.games.accelerations
    to_lone = np.linalg.norm(accelerations - lone, axis=-1)
    to_both = np.linalg.norm(accelerations - both, axis=-1)
    assert np.minimum(to_lone, to_both).max() < 0.01 * np.linalg.norm(lone - both, axis=-1).min()
    return to_both < to_lone


@pytest.mark.parametrize("loss", [0.2, 0.5])
def test_each_message_is_lost_by_itself_and_anew_at_every_solve(loss):
    games = 1000
    state = random_state(np.random.default_rng(3), 2)._replace(teams=np.zeros(2, np.int8))
    simulator = Simulator(
        GameConfig(drones_per_team=(2, 0), capture=PEACE, controller=communication(message_loss=loss)), num_games=games
    )
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


UNLUCKY = GameConfig(
    controller=ControllerConfig(communication_radius=0.4, message_loss=0.5),
    dynamics=DynamicsConfig(failure_rate=0.2, repair_rate=1.0),
)


def play(simulator, seconds, streams) -> None:
    """Send random commands every second, drawn per game."""
    generators = [np.random.default_rng(stream) for stream in streams]
    for _ in range(seconds):
        commands = np.stack([generator.random((2, 10, 10)) ** 8 for generator in generators])
        simulator.command(0, commands[:, 0])
        simulator.command(1, commands[:, 1])
        simulator.advance(30)


def assert_same_game(one, row, other, other_row) -> None:
    for name, array, other_array in zip(one.games._fields, one.games, other.games, strict=True):
        np.testing.assert_array_equal(array[row], other_array[other_row], err_msg=name)


def test_luck_is_of_the_seed_and_not_of_the_batch_the_row_or_the_threads():
    seeds = list(range(8))
    batch = Simulator(UNLUCKY, num_games=8, threads=2)
    batch.reset(seeds)
    play(batch, 10, seeds)
    for row in (0, 3, 7):
        alone = Simulator(UNLUCKY)
        alone.reset([row])
        play(alone, 10, [row])
        assert_same_game(batch, row, alone, 0)
        # A game that was played before leaves nothing behind.
        alone.reset([row])
        play(alone, 10, [row])
        assert_same_game(batch, row, alone, 0)


def test_games_of_one_scenario_differ_by_their_luck():
    state = random_state(np.random.default_rng(4), 20)._replace(teams=np.arange(20) % 2)
    simulator = Simulator(UNLUCKY, num_games=2)
    put(simulator, state)
    simulator.advance(30)
    assert not np.array_equal(simulator.positions[0], simulator.positions[1])


def test_a_snapshot_continues_with_the_same_luck():
    simulator = Simulator(UNLUCKY, num_games=2)
    simulator.reset([1, 2])
    play(simulator, 2, [1, 2])
    saved = simulator.snapshot(rows=[1])
    play(simulator, 3, [3, 4])
    other = Simulator(UNLUCKY)
    other.restore(saved)
    play(other, 3, [4])
    assert_same_game(simulator, 1, other, 0)


# --- failures ---------------------------------------------------------------------------------------------------------


def test_nobody_fails_by_default():
    simulator = Simulator()
    simulator.advance(30)
    assert simulator.games.failed.shape == (1, 20)
    assert simulator.games.failed.dtype == np.bool_
    assert not simulator.games.failed.any()


def test_drones_fail_and_return_at_their_rates_each_by_itself():
    games = 200
    config = GameConfig(capture=PEACE, dynamics=DynamicsConfig(failure_rate=3.0, repair_rate=6.0))
    simulator = Simulator(config, num_games=games)
    simulator.reset(range(games))
    fails, returns = 1 - math.exp(-0.3), 1 - math.exp(-0.6)
    before = simulator.games.failed.copy()
    assert not before.any()
    for _ in range(4):
        simulator.advance(1)
        after = simulator.games.failed.copy()
        for share, chance in ((after[~before], fails), (~after[before], returns)):
            if share.size:
                assert abs(share.mean() - chance) < 4 * math.sqrt(chance * (1 - chance) / share.size)
        simulator.advance(2)
        np.testing.assert_array_equal(simulator.games.failed, after)
        before = after
    # Games and drones have luck of their own.
    assert len({row.tobytes() for row in after}) > games // 2
    assert len({row.tobytes() for row in after.T}) == 20


def test_a_failed_drone_stands_still_writes_no_trail_and_returns_with_an_empty_memory():
    config = GameConfig(
        capture=CaptureConfig(threshold=0.5), dynamics=DynamicsConfig(failure_rate=0.5, repair_rate=2.0)
    )
    returned, captured, captured_failed = 0, 0, 0
    for seed in range(4):
        simulator, generator = Simulator(config), np.random.default_rng(seed)
        simulator.reset([seed])
        games = simulator.games
        rules = VariantRules(simulator.teams[0], threshold=0.5)
        for tick in range(300):
            if tick % 30 == 0:
                for team in range(2):
                    simulator.command(team, generator.random((1, 10, 10)) ** 4)
            before = simulator.snapshot()
            simulator.advance(1)
            failed = games.failed[0].copy()
            np.testing.assert_array_equal(simulator.positions[0, failed], before.positions[0, failed])
            assert not simulator.velocities[0, failed].any()
            assert not games.accelerations[0, failed].any()

            back = before.failed[0] & ~failed
            assert tick % 3 == 0 or not back.any()
            for drone in np.flatnonzero(back & (simulator.teams[0] == before.teams[0])):
                assert games.memory_weight[0, drone] == 1.0
                np.testing.assert_allclose(
                    games.memory[0, :, :, drone], basis(before.positions[0, drone].astype(float)), atol=1e-5
                )
                returned += 1

            lost = rules.tick(simulator.positions[0], failed=failed)
            np.testing.assert_array_equal(simulator.teams[0], rules.teams)
            np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
            captured, captured_failed = captured + len(lost), captured_failed + int(failed[lost].sum())
            if simulator.decided[0]:
                break
    assert returned > 20
    assert captured > captured_failed > 0


@pytest.mark.parametrize("radius", [None, 0.3])
def test_working_drones_do_not_hear_failed_ones(radius):
    generator = np.random.default_rng(5)
    for _ in range(10):
        state = random_state(generator, int(generator.integers(2, 25)))
        failed = generator.random(len(state.teams)) < 0.4
        simulator = solved(
            state,
            failed,
            controller=communication(communication_radius=radius),
            dynamics=DynamicsConfig(failure_rate=1e-9),
        )
        heard = heard_within(state.positions, math.inf if radius is None else radius)
        assert_mirrored(simulator, state, REFERENCE, heard=heard, failed=failed)


@pytest.mark.parametrize("config", [GameConfig(), GameConfig.preset("released")], ids=["paper", "released"])
def test_a_team_of_which_every_drone_has_failed_stands(config):
    dynamics = config.dynamics.replace(failure_rate=1e-9)
    simulator = Simulator(config.replace(dynamics=dynamics, capture=config.capture.replace(enabled=False)))
    simulator.reset([0])
    simulator.advance(60)
    games = simulator.games
    games.failed[0, 10:], games.velocities[0, 10:], games.accelerations[0, 10:] = True, 0.0, 0.0
    there = simulator.positions[0, 10:].copy()
    simulator.advance(90)
    np.testing.assert_array_equal(games.failed[0], simulator.teams[0] == 1)
    np.testing.assert_array_equal(simulator.positions[0, 10:], there)
    for array in (simulator.positions, simulator.capture_field, games.memory):
        assert np.isfinite(array).all()
