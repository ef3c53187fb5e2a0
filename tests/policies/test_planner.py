from __future__ import annotations

import time

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import ConfigError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies.lookahead import Lookahead
from swarm_pz.policies.planner import Planner, PlannerConfig
from swarm_pz.policy import PrivilegedPolicy
from swarm_pz.simulator import Simulator
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

SMALL = PlannerConfig(drone_steps=3_000, horizon=2.0)
CONFIG = GameConfig(drones_per_team=4, time_limit=40.0)


def a_game(seconds: int = 3) -> BatchEnv:
    batch = BatchEnv(CONFIG, 2)
    batch.reset([0, 1])
    for _ in range(seconds):
        batch.step(np.ones((2, 2, 10, 10)))
    return batch


def test_the_same_budget_and_seed_give_the_same_commands_and_the_game_is_left_alone():
    batch = a_game()
    before = batch.simulator.snapshot()
    answers = []
    for _ in range(2):
        planner = Planner(CONFIG, settings=SMALL)
        planner.reset([5, 6], np.arange(2))
        answers.append(batch.ask(planner, np.array([0, 1]), np.arange(2)))
    np.testing.assert_array_equal(answers[0], answers[1])
    for array, copied in zip(batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)
    assert len(planner.milliseconds) == 2


def test_answers_do_not_depend_on_the_batch():
    batch = a_game()
    together, alone = Planner(CONFIG, settings=SMALL), Planner(CONFIG, settings=SMALL)
    together.reset([5, 6], np.arange(2))
    alone.reset([6], np.array([1]))
    both = batch.ask(together, np.array([0, 1]), np.arange(2))
    np.testing.assert_array_equal(both[1], batch.ask(alone, np.array([1]), np.array([1]))[0])


def test_a_candidate_is_worth_what_the_simulator_says():
    batch = a_game()
    lookahead = Lookahead(CONFIG, horizon=2.0, drone_steps=3_000, promise=0.0)
    logs = lookahead.propose(batch.simulator.snapshot([0]), 0, None, np.random.default_rng(0))
    worths = lookahead.try_out(batch.simulator.snapshot([0]), 0, logs, None)
    for log, worth in zip(logs, worths, strict=True):
        game = a_game()
        game.simulator.command(0, np.stack([np.exp(log), np.ones((10, 10))]))
        game.simulator.advance(60)
        if game.simulator.sizes[0].min() > 0:
            assert worth == pytest.approx(game.simulator.sizes[0, 0] / 8)


@pytest.mark.parametrize("team", [0, 1])
def test_a_modelled_opponent_sees_and_commands_its_own_side(team):
    class Watching:
        observation = ObservationConfig(channels=("own_positions",))
        seen = ()

        def reset(self, seeds, rows):
            pass

        def act(self, observations, rows):
            self.seen = (*self.seen, observations[0].copy())
            commands = np.zeros((len(rows), 10, 10))
            commands[:, 8, 1] = 1.0
            return commands

    batch, model = a_game(), Watching()
    lookahead = Lookahead(CONFIG, horizon=2.0, drone_steps=3_000, promise=0.0)
    evenly = np.zeros((lookahead.candidates, 10, 10))
    lookahead.try_out(batch.simulator.snapshot([0]), team, evenly, model)
    assert len(model.seen) == 2
    np.testing.assert_array_equal(model.seen[0], batch.observe(model.observation, 1 - team)[0])
    targets = lookahead._trials.simulator.targets[0]
    assert np.ptp(targets[team]) < 1e-12
    assert targets[1 - team].argmax() == 81


@pytest.mark.parametrize("team", [0, 1])
def test_what_threatens_a_drone_is_the_opposing_field_where_it_is(team, monkeypatch):
    lookahead = Lookahead(CONFIG, horizon=2.0, drone_steps=3_000, promise=1.0)
    positions = np.full((8, 2), 0.1)
    positions[4 * team], positions[4 * (1 - team)] = (0.31, 0.71), (0.71, 0.31)
    batch = BatchEnv(CONFIG)
    batch.reset([0], scenario={"positions": positions})
    lookahead._trials.simulator.restore(batch.simulator.snapshot([0]))

    def worth(side, x, y):
        field = np.zeros((lookahead.candidates, 2, 50, 50))
        field[:, side, int(50 * y), int(50 * x)] = 1.0
        field[:, 1 - side, 49, 0] = 100.0  # where nobody is: each side's field has a maximum of its own
        monkeypatch.setattr(Simulator, "capture_field", field)
        return lookahead._worth(team, 0)[0]

    assert worth(1 - team, 0.31, 0.71) == pytest.approx(0.5 - 1 / 8)
    assert worth(1 - team, 0.71, 0.31) == pytest.approx(0.5)
    assert worth(team, 0.31, 0.71) == pytest.approx(0.5)
    assert worth(team, 0.71, 0.31) == pytest.approx(0.5 + 1 / 8)


def test_it_beats_uniform_coverage_quickly():
    config = GameConfig(time_limit=60.0)
    planner = Planner(config, settings=PlannerConfig(drone_steps=20_000))
    summary = play_match(planner, "uniform", games=4, config=config).summary()
    assert summary["wins"] == 4
    assert summary["restricted_mean_seconds"] < 40


def test_it_may_know_the_opponents_policy():
    planner = policies.load("planner:ring", CONFIG)
    assert isinstance(planner, PrivilegedPolicy)
    assert planner.name == "planner:ring"
    known = Planner(CONFIG, "ring", SMALL)
    batch = a_game()
    known.reset([5], np.zeros(1, int))
    assert batch.ask(known, np.zeros(1, int), np.zeros(1, int)).max() == pytest.approx(1.0)
    with pytest.raises(PolicyError, match="no policy 'rign'"):
        policies.load("planner:rign")


@pytest.mark.parametrize("name", ["ring", "halo", "evade"])
def test_it_finds_out_who_the_opponent_is(name):
    config = GameConfig(time_limit=60.0)
    planner = Planner(config, "guess", PlannerConfig(drone_steps=1))
    batch = BatchEnv(config)
    opponent = policies.load(name, config)
    batch.reset([3])
    only, red, blue = np.zeros(1, int), np.zeros(1, int), np.ones(1, int)
    planner.reset([5], only)
    opponent.reset([6], only)
    for _ in range(4):
        commands = np.stack([batch.ask(planner, red, only), batch.ask(opponent, blue, only)], axis=1)
        batch.step(commands)
    assert planner._explain(planner._bench(config), batch.simulator.snapshot([0]), 0, 0).name == name


def test_a_wall_clock_budget_is_kept():
    batch = a_game()
    planner = Planner(CONFIG, settings=SMALL.replace(milliseconds=150.0))
    planner.reset([5], np.zeros(1, int))
    began = time.perf_counter()
    batch.ask(planner, np.zeros(1, int), np.zeros(1, int))
    assert 1000 * (time.perf_counter() - began) < 1000  # generous: machines stall


def test_other_sizes_and_cells_work():
    config = GameConfig(drones_per_team=(1, 3), command_cells=6, time_limit=5.0)
    planner = Planner(config, settings=PlannerConfig(drone_steps=1))
    assert play_match(planner, "uniform", games=2, config=config).summary()["games"] == 2


@pytest.mark.parametrize("model", [None, "guess", "ring"])
@pytest.mark.parametrize("sizes", [(4, 0), (0, 4)])
def test_it_plays_against_nobody_and_for_nobody(sizes, model):
    config = GameConfig(drones_per_team=sizes, capture=CaptureConfig(enabled=False))
    planner, batch = Planner(config, model, SMALL.replace(drone_steps=1_000)), BatchEnv(config)
    batch.reset([0])
    planner.reset([5], np.zeros(1, int))
    for _ in range(2):
        answer = batch.ask(planner, np.zeros(1, int), np.zeros(1, int))
        batch.step(np.stack([answer, np.ones((1, 10, 10))], axis=1))
    assert answer.max() == pytest.approx(1.0)


@pytest.mark.parametrize(
    "other", [CONFIG.replace(drones_per_team=(2, 9)), CONFIG.replace(command_cells=6), GameConfig.preset("released")]
)
def test_it_plays_by_the_rules_of_the_game_that_it_is_shown(other):
    answers = []
    for loaded in (CONFIG, other):
        planner, batch = Planner(loaded, "ring", SMALL), BatchEnv(other)
        batch.reset([0])
        batch.step(np.ones((1, 2, other.command_cells, other.command_cells)))
        planner.reset([5], np.zeros(1, int))
        answers.append(batch.ask(planner, np.zeros(1, int), np.zeros(1, int)))
    np.testing.assert_array_equal(answers[0], answers[1])


def test_it_is_met_in_training_at_every_size_that_is_dealt():
    coarse = CONFIG.replace(observation=ObservationConfig(grid=10))
    env = StackedVecEnv([SwarmVecEnv(coarse.replace(drones_per_team=size), 1, seed=0) for size in (2, 3)])
    env.deal([Planner(coarse, settings=SMALL.replace(drone_steps=1_000))])
    env.reset()
    for _ in range(2):
        env.step(np.zeros((2, 10, 10), np.float32))
    env.close()


@pytest.mark.parametrize("model", [None, "ring", "guess"])
@pytest.mark.parametrize("row", [0, 1])
def test_it_does_not_know_what_will_happen_by_chance(model, row):
    config = CONFIG.replace(dynamics=DynamicsConfig(failure_rate=1.0, repair_rate=1.0))
    settings, rows = SMALL.replace(drone_steps=1_000), np.array([row])
    answers = []
    for chance in (1, 2):
        planner, batch = Planner(config, model, settings), BatchEnv(config, 2)
        batch.reset([0, 0])
        batch.simulator.games.seeds[:] = chance
        planner.reset([5], rows)
        answers.append(batch.ask(planner, np.zeros(1, int), rows))
    np.testing.assert_array_equal(answers[0], answers[1])


@pytest.mark.parametrize("change", [{"drone_steps": 0}, {"milliseconds": 0.0}, {"horizon": 0.0}, {"promise": -1.0}])
def test_bad_settings_are_refused(change):
    with pytest.raises(ConfigError, match=next(iter(change))):
        PlannerConfig(**change)
