from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import ConfigError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import planner as module
from swarm_pz.policies import scripted, zoo
from swarm_pz.policies.planner import Planner, PlannerConfig
from swarm_pz.policy import PrivilegedPolicy
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


@pytest.mark.parametrize("model", [None, "ring"])
def test_answers_do_not_depend_on_the_batch(model):
    batch, rows, teams = a_game(), np.arange(2), np.array([1, 0])

    def answer(rows):
        planner = Planner(CONFIG, model, SMALL.replace(drone_steps=1))
        planner.reset([5 + row for row in rows.tolist()], rows)
        return batch.ask(planner, teams[rows], rows)

    np.testing.assert_array_equal(answer(rows), np.concatenate([answer(rows[:1]), answer(rows[1:])]))


@pytest.mark.parametrize("model", [None, "guess"])
def test_a_new_game_owes_nothing_to_the_one_before(model):
    config = GameConfig(drones_per_team=5, capture=CaptureConfig(enabled=False))
    red, blue, only = np.array([0]), np.array([1]), np.zeros(1, int)

    def play(planner, name, steps):
        batch, opponent, sent = BatchEnv(config), policies.load(name, config), []
        batch.reset([0])
        planner.reset([1], only)
        opponent.reset([2], only)
        for _ in range(steps):
            sent.append(batch.ask(planner, red, only))
            batch.step(np.stack([sent[-1], batch.ask(opponent, blue, only)], axis=1))
        return sent

    fresh, used = (Planner(config, model, PlannerConfig(drone_steps=2_000)) for _ in range(2))
    play(used, "ring", 6)
    np.testing.assert_array_equal(play(fresh, "wavefront", 3), play(used, "wavefront", 3))


class Slope:
    """Stands in for a look ahead: the more a candidate asks for one cell, the better it is; and notes what is asked."""

    candidates, rounds = 20, 6

    def __init__(self, clock=None):
        self.generator = np.random.default_rng(0)
        self.tried, self.bred, self.last, self.clock = [], [], [], clock

    def propose(self, game, team, last, generator):
        self.last.append(last)
        return -self.generator.random((self.candidates, 10, 10))

    def breed(self, elites, spread, generator):
        self.bred.append((elites, spread))
        return -self.generator.random((self.candidates, 10, 10))

    def try_out(self, game, team, candidates, model):
        self.tried.append(candidates)
        if self.clock:
            self.clock.now += 0.01
        return candidates[:, 3, 7]


def look_through(monkeypatch, slope, settings=SMALL):
    monkeypatch.setattr(module, "Lookahead", lambda *_: slope)
    batch, planner, only = a_game(), Planner(CONFIG, settings=settings), np.zeros(1, int)
    planner.reset([5], only)
    return [batch.ask(planner, only, only)[0] for _ in range(2)], planner


def test_the_best_of_all_rounds_is_sent_and_the_best_tenth_of_each_has_offspring_ever_closer(monkeypatch):
    slope = Slope()
    sent, _ = look_through(monkeypatch, slope)
    assert len(slope.tried) == 12 and len(slope.bred) == 10
    assert [spread for _, spread in slope.bred] == 2 * [1.0, 0.5, 0.25, 0.125, 0.125]
    for decision, answer in enumerate(sent):
        tried = np.concatenate(slope.tried[6 * decision : 6 * decision + 6])
        np.testing.assert_array_equal(answer, np.exp(tried[tried[:, 3, 7].argmax()]))
    for (elites, _), candidates in zip(slope.bred[:5], slope.tried[:5], strict=True):
        np.testing.assert_array_equal(elites, candidates[np.argsort(-candidates[:, 3, 7])[:2]])
    assert slope.last[0] is None
    np.testing.assert_allclose(np.exp(slope.last[1]), sent[0])


def test_of_candidates_that_are_worth_the_same_the_first_is_sent(monkeypatch):
    slope = Slope()
    tried = slope.try_out
    monkeypatch.setattr(slope, "try_out", lambda *given: np.zeros_like(tried(*given)))
    sent, _ = look_through(monkeypatch, slope)
    for decision, answer in enumerate(sent):
        np.testing.assert_array_equal(answer, np.exp(slope.tried[6 * decision][0]))


@pytest.mark.parametrize(("milliseconds", "rounds"), [(5.0, 1), (29.0, 2), (30.5, 3), (200.5, 20)])
def test_it_searches_on_as_long_as_another_round_would_fit_and_notes_how_long_it_took(
    monkeypatch, milliseconds, rounds
):
    class Clock:
        now = 0.0

        def perf_counter(self):
            return self.now

    clock = Clock()
    slope = Slope(clock)
    monkeypatch.setattr(module, "time", clock)
    _, planner = look_through(monkeypatch, slope, SMALL.replace(milliseconds=milliseconds))
    assert len(slope.tried) == 2 * rounds
    assert planner.milliseconds == pytest.approx(2 * [10.0 * rounds])


def test_its_settings_reach_the_search(monkeypatch):
    given = []
    monkeypatch.setattr(module, "Lookahead", lambda *args: given.append(args))
    Planner(CONFIG, "ring", PlannerConfig(drone_steps=7_000, horizon=1.5, promise=0.25))
    Planner(CONFIG)
    assert given == [(CONFIG, 1.5, 7_000, 0.25), (CONFIG, 3.0, 200_000, 0.5)]
    assert PlannerConfig().milliseconds is None


def test_it_is_called_by_its_model():
    assert [policies.load(name, CONFIG).name for name in ("planner", "planner:ring", "planner:guess")] == [
        "planner",
        "planner:ring",
        "planner:guess",
    ]


def test_it_guesses_among_the_own_tactics_learned_ones_first(monkeypatch):
    asked = []
    monkeypatch.setattr(module, "load", lambda name, config: asked.append((name, config)))
    Planner(CONFIG, "guess", SMALL)
    learned = sorted(path.parent.name for path in Path(zoo.__file__).parent.glob("*/policy.json"))
    scripts = sorted(script.__name__ for script in scripted.SCRIPTS)
    assert asked == [(name, CONFIG) for name in (*learned, *scripts)]


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


@pytest.mark.parametrize(("name", "team"), [("ring", 0), ("halo", 1), ("evade", 1)])
def test_it_finds_out_who_the_opponent_is_and_no_odd_command_misleads_it(name, team):
    config = GameConfig(time_limit=60.0)
    planner = Planner(config, "guess", PlannerConfig(drone_steps=1))
    batch = BatchEnv(config)
    opponent = policies.load(name, config)
    batch.reset([3])
    only, own, other = np.zeros(1, int), np.array([team]), np.array([1 - team])
    planner.reset([5], only)
    opponent.reset([6], only)
    for step in range(6):
        commands = np.ones((1, 2, 10, 10))
        commands[0, team] = batch.ask(planner, own, only)
        answer = batch.ask(opponent, other, only)
        commands[0, 1 - team] = answer if step < 5 else 1.0
        batch.step(commands)
    assert planner._explain(planner._bench(config), batch.simulator.snapshot([0]), team, 0).name == name


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


@pytest.mark.parametrize("controllers", ["flocking", ("ergodic", "direct")], ids=str)
def test_it_plays_with_other_control_systems_and_against_them(controllers):
    """Its trials sent densities as they are, which flocks and numbers beside them do not take."""
    config = GameConfig(drones_per_team=2, time_limit=2.0, controllers=controllers)
    model = "guess" if controllers == "flocking" else None
    planner = Planner(config, model, SMALL.replace(drone_steps=500))
    assert len(play_match(planner, "hold", games=2, config=config).games) == 2


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
