from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, ControllerConfig, MemoryConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.policies import load
from swarm_pz.policies.lookahead import Lookahead, search
from swarm_pz.simulator import Simulator
from tests.policies.test_planner import CONFIG, a_game

PLACES = np.repeat([[0.2, 0.3], [0.85, 0.6]], 4, axis=0)


def look(promise=0.0, drone_steps=3_000, config=CONFIG, horizon=2.0):
    return Lookahead(config, horizon, drone_steps, promise)


def a_start(positions=PLACES, config=CONFIG):
    """Return a game with drones at these positions; by default, each team is in a place of its own."""
    batch = BatchEnv(config)
    batch.reset([0], scenario={"positions": positions})
    return batch.simulator.snapshot([0])


@pytest.mark.parametrize("team", [0, 1])
def test_candidates_begin_with_the_last_command_and_simple_tactics_around_the_opponents(team):
    lookahead, last = look(drone_steps=10_240), np.linspace(-9.0, -1.0, 100).reshape(10, 10)
    x, y = [(0.85, 0.6), (0.2, 0.3)][team]

    def ring(px, py, radius, width):
        return [
            [-(((math.hypot((c + 0.5) / 10 - px, (r + 0.5) / 10 - py) - radius) / width) ** 2) for c in range(10)]
            for r in range(10)
        ]

    first = [last, np.zeros((10, 10)), ring(0.5, 0.5, 0.25, 0.15), ring(x, y, 0.25, 0.08), ring(x, y, 0.15, 0.08)]
    first = np.array([np.maximum(np.subtract(logs, np.max(logs)), -4.0) for logs in first])
    for previous, expected in ((last, first), (None, first[1:])):
        proposed = lookahead.propose(a_start(), team, previous, np.random.default_rng(0))
        np.testing.assert_allclose(proposed[: len(expected)], expected, atol=1e-4)
        np.testing.assert_array_equal(proposed.max(axis=(1, 2)), 0.0)
        assert proposed.min() == -4.0 and len({logs.tobytes() for logs in proposed}) == len(proposed) == 64
    drawn = [np.exp(lookahead.propose(a_start(), team, None, np.random.default_rng(seed))[4:]) for seed in range(30)]
    masses = sum((logs / logs.sum(axis=(1, 2), keepdims=True)).sum(axis=0) for logs in drawn)
    near = [masses[1:5, :4].sum(), masses[4:8, 6:].sum()]
    assert near[1 - team] > 1.2 * near[team], "mixtures are nearer to the opponents"


def test_offspring_is_between_pairs_of_elites_and_around_them():
    lookahead = look(drone_steps=10_240)
    one, other = np.random.default_rng(0).uniform(-1.5, -0.5, (2, 10, 10))
    one[0, 0] = other[0, 0] = 0.0
    plain, near, far = (
        lookahead.breed(np.stack([one, other]), spread, np.random.default_rng(1)) for spread in (0.0, 0.05, 0.1)
    )
    shares = ((plain - other) * (one - other)).sum(axis=(1, 2)) / ((one - other) ** 2).sum()
    np.testing.assert_allclose(plain, other + shares[:, None, None] * (one - other), atol=1e-12)
    assert shares.min() == pytest.approx(0.0) and shares.max() == pytest.approx(1.0)
    assert 10 < np.count_nonzero((shares > 1e-6) & (shares < 1 - 1e-6)) < 54
    moved = [child - plain - (child - plain).mean(axis=(1, 2), keepdims=True) for child in (near, far)]
    np.testing.assert_allclose(moved[1], 2.0 * moved[0], atol=1e-12)  # up to a constant, since the largest value is 0
    assert 0.03 < moved[1].std() < 0.12


class Watching:
    """An opponent model that commands one cell, and records its calls and observations."""

    observation = ObservationConfig(channels=("own_positions",))

    def __init__(self):
        self.calls, self.observations = [], []

    def reset(self, seeds, rows):
        self.calls.append(("reset", rows.tolist()))

    def act(self, observations, rows):
        self.calls.append(("act", rows.tolist()))
        self.observations.append(observations[0].copy())
        commands = np.zeros((len(rows), 10, 10))
        commands[:, 8, 1] = 1.0
        return commands


@pytest.mark.parametrize("team", [0, 1])
def test_a_modelled_opponent_commands_its_own_side_once_a_second_and_begins_anew_at_every_trial(team):
    config = CONFIG.replace(capture=CaptureConfig(enabled=False))
    lookahead, model, batch = look(config=config, drone_steps=1, horizon=2.5), Watching(), a_game(config=config)
    for _ in range(2):
        lookahead.try_out(batch.simulator.snapshot([1]), team, np.zeros((4, 10, 10)), model)
    everybody = list(range(4))
    assert model.calls == 2 * [("reset", everybody), *3 * [("act", everybody)]]
    assert lookahead._trials.simulator.games.ticks.tolist() == 4 * [90 + 75]
    np.testing.assert_array_equal(model.observations[0], batch.observe(model.observation, 1 - team)[1])
    targets = lookahead._trials.simulator.targets[0]
    assert np.ptp(targets[team]) < 1e-12 and targets[1 - team].argmax() == 81


def test_a_candidate_is_worth_what_the_simulator_says():
    batch, lookahead = a_game(), look()
    logs = lookahead.propose(batch.simulator.snapshot([0]), 0, None, np.random.default_rng(0))
    worths = lookahead.try_out(batch.simulator.snapshot([0]), 0, logs, None)
    for log, worth in zip(logs[::4], worths[::4], strict=True):
        game = a_game()
        game.simulator.command(0, np.stack([np.exp(log), np.ones((10, 10))]))
        game.simulator.advance(60)
        if game.simulator.sizes[0].min() > 0:
            assert worth == pytest.approx(game.simulator.sizes[0, 0] / 8)


def test_a_look_ahead_holds_what_is_in_force_already_as_a_step_does():
    # An endless trail and a warm start, as in `released`, need no machine code of their own.
    memory = MemoryConfig(trail=None, controller=None, controller_forgotten_on=("sending",))
    peace, warm = CaptureConfig(enabled=False), ControllerConfig(warm_start=True)
    config = CONFIG.replace(memory=memory, capture=peace, controller=warm)
    batch, lookahead = BatchEnv(config), look(config=config, horizon=1.0)
    batch.reset([0])
    batch.step(np.ones((1, 2, 10, 10)))
    logs = np.zeros((lookahead.candidates, 10, 10))
    logs[1, 0, 0] = -4.0
    for model in (None, load("uniform", config)):
        lookahead.try_out(batch.simulator.snapshot(), 0, logs, model)
        weights = lookahead._trials.simulator.games.memory_weight
        red, blue = weights[:, 0].tolist(), weights[:, -1].tolist()
        assert red == [20.0, 10.0] + [20.0] * (len(logs) - 2) and set(blue) == {20.0}


@pytest.mark.parametrize("team", [0, 1])
def test_a_win_is_worth_more_the_sooner_it_comes_and_a_defeat_less(team, monkeypatch):
    lookahead = look(drone_steps=1)
    lookahead._trials.simulator.restore(a_start())
    own = np.array([8, 8, 0, 3])
    monkeypatch.setattr(Simulator, "sizes", np.stack([own, 8 - own][:: 1 - 2 * team], axis=1))
    lookahead._trials.simulator.games.ticks[:] = [90, 120, 120, 150]
    np.testing.assert_allclose(lookahead._worth(team, 90), [1 + 1.5, 1 + 1.25, -1.25, 3 / 8])


@pytest.mark.parametrize("team", [0, 1])
def test_what_threatens_a_drone_is_the_opposing_field_where_it_is(team, monkeypatch):
    config = CONFIG.replace(capture=CaptureConfig(threshold=0.6))
    lookahead = look(1.0, config=config)
    positions = np.full((8, 2), 0.1)
    positions[4 * team], positions[4 * (1 - team)] = (0.31, 0.71), (0.71, 0.31)
    lookahead._trials.simulator.restore(a_start(positions, config))

    def worth(side, x, y, value=1.0):
        field = np.zeros((lookahead.candidates, 2, 50, 50))
        field[:, side, int(50 * y), int(50 * x)] = value
        field[:, side, 49, 49] = 1.0
        field[:, 1 - side, 49, 0] = 100.0  # no drone is there; each side's field has its own maximum
        monkeypatch.setattr(Simulator, "capture_field", field)
        return lookahead._worth(team, 0)[0]

    assert worth(1 - team, 0.31, 0.71) == pytest.approx(0.5 - 1 / 8)
    assert worth(1 - team, 0.71, 0.31) == worth(team, 0.31, 0.71) == pytest.approx(0.5)
    assert worth(team, 0.71, 0.31) == pytest.approx(0.5 + 1 / 8)
    assert worth(1 - team, 0.31, 0.71, 0.3) == pytest.approx(0.5 - (0.3 / 0.6) ** 2 / 8)


class Slope:
    """A fake look-ahead: a candidate is worth its value in one cell, rounded to a tenth."""

    candidates, rounds = 20, 6

    def __init__(self):
        self.generator, self.tried, self.bred, self.last = np.random.default_rng(0), [], [], []

    def propose(self, game, team, last, generator):
        self.last.append(last)
        return -self.generator.random((self.candidates, 10, 10))

    def breed(self, elites, spread, generator):
        self.bred.append((elites, spread))
        return -self.generator.random((self.candidates, 10, 10))

    def try_out(self, game, team, candidates, model):
        self.tried.append(candidates)
        return candidates[:, 3, 7].round(1)


def test_the_first_of_the_best_is_found_and_the_best_tenth_of_each_round_has_offspring_ever_closer():
    slope = Slope()
    best = search(slope, None, 0, None, "the last", None, lambda done: done >= slope.rounds)
    assert len(slope.tried) == 6 and slope.last == ["the last"]
    assert [spread for _, spread in slope.bred] == [1.0, 0.5, 0.25, 0.125, 0.125]
    tried = np.concatenate(slope.tried)
    np.testing.assert_array_equal(best, tried[tried[:, 3, 7].round(1).argmax()])
    for (elites, _), candidates in zip(slope.bred, slope.tried[:5], strict=True):
        order = np.argsort(-candidates[:, 3, 7].round(1), kind="stable")
        np.testing.assert_array_equal(elites, candidates[order[:2]])
