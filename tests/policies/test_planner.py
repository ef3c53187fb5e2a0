from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig
from swarm_pz.config.registry import registered, system_of
from swarm_pz.config.system import serves_densities
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import KindError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import planner as module
from swarm_pz.policies import scripted, zoo
from swarm_pz.policies.planner import Planner, PlannerConfig
from swarm_pz.policy import PrivilegedPolicy

TINY = PlannerConfig(drone_steps=1_000, horizon=2.0)
CONFIG = GameConfig(drones_per_team=4, time_limit=40.0)
CALM = CaptureConfig(enabled=False)
ONLY, RED, BLUE = np.zeros(1, int), np.array([0]), np.array([1])


def a_game(seconds=3, config=CONFIG):
    batch = BatchEnv(config, 2)
    batch.reset([0, 1])
    for _ in range(seconds):
        batch.step(np.ones((2, 2, 10, 10)))
    return batch


def begun(config=CONFIG, model=None, settings=TINY):
    planner = Planner(config, model, settings)
    planner.reset([5], ONLY)
    return planner


@pytest.mark.parametrize("model", [None, "ring"])
def test_the_same_seed_gives_the_same_commands_in_any_batch_and_the_game_is_left_alone(model):
    batch, rows, teams = a_game(), np.arange(2), np.array([1, 0])
    before = batch.simulator.snapshot()

    def answer(rows):
        planner = Planner(CONFIG, model, TINY.replace(drone_steps=1))
        planner.reset([5 + row for row in rows.tolist()], rows)
        answers = batch.ask(planner, teams[rows], rows)
        assert len(planner.milliseconds) == len(rows)
        return answers

    np.testing.assert_array_equal(answer(rows), np.concatenate([answer(rows[:1]), answer(rows[1:])]))
    for array, copied in zip(batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_a_new_game_owes_nothing_to_the_one_before():
    config = GameConfig(drones_per_team=5, capture=CALM)

    def play(planner, name, steps):
        batch, opponent, sent = BatchEnv(config), policies.load(name, config), []
        batch.reset([0])
        planner.reset([1], ONLY)
        opponent.reset([2], ONLY)
        for _ in range(steps):
            sent.append(batch.ask(planner, RED, ONLY))
            batch.step(np.stack([sent[-1], batch.ask(opponent, BLUE, ONLY)], axis=1))
        return sent

    fresh, used = (Planner(config, "guess", PlannerConfig(drone_steps=2_000)) for _ in range(2))
    play(used, "ring", 4)
    np.testing.assert_array_equal(play(fresh, "wavefront", 3), play(used, "wavefront", 3))


def test_it_is_called_by_its_model_which_may_be_any_policy_or_a_guess_among_the_own_ones():
    for name in ("planner", "planner:ring", "planner:guess"):
        planner = policies.load(name, CONFIG)
        assert planner.name == name and isinstance(planner, PrivilegedPolicy)
    with pytest.raises(PolicyError, match="no policy 'rign'"):
        policies.load("planner:rign")
    learned = sorted(path.parent.name for path in Path(zoo.__file__).parent.glob("*/policy.json"))
    densities = [*learned, *sorted(script.__name__ for script in scripted.SCRIPTS)]
    assert module.known_tactics(CONFIG.team_systems[0], CONFIG) == densities
    assert module.known_tactics(system_of("direct"), CONFIG) == ["hem_in", "scatter", "tighten"]


def test_it_beats_uniform_coverage_quickly():
    planner = Planner(GameConfig(time_limit=60.0), settings=PlannerConfig(drone_steps=20_000))
    summary = play_match(planner, "uniform", games=2, config=GameConfig(time_limit=60.0)).summary()
    assert summary["privileged"] == ["planner"] and summary["wins"] == 2 and summary["restricted_mean_seconds"] < 40


@pytest.mark.parametrize(("name", "team"), [("ring", 0), ("halo", 1)])
def test_it_finds_out_who_the_opponent_is_and_no_odd_command_misleads_it(name, team):
    config = CONFIG.replace(capture=CALM)
    planner, batch = begun(config, "guess", TINY.replace(drone_steps=1)), BatchEnv(config)
    opponent = policies.load(name, config)
    batch.reset([3])
    opponent.reset([6], ONLY)
    for step in range(6):
        commands = np.ones((1, 2, 10, 10))
        commands[0, team] = batch.ask(planner, np.array([team]), ONLY)
        answer = batch.ask(opponent, np.array([1 - team]), ONLY)
        commands[0, 1 - team] = answer if step < 5 else 1.0
        batch.step(commands)
    bench = planner._bench(config)
    models = planner._models(bench, config.team_systems[0])
    assert planner._explain(bench, models, batch.simulator.snapshot([0]), team, 0).name == name


@pytest.mark.parametrize("name", sorted(registered()))
def test_it_commands_every_system_that_serves_densities_and_refuses_the_others_by_name(name):
    config = GameConfig(drones_per_team=2, time_limit=2.0, controllers=name)
    if serves_densities(system_of(name), config):
        assert len(play_match(Planner(config, None, TINY), "hold", games=2, config=config).games) == 2
        return
    with pytest.raises(KindError, match=f"planner searches for densities, but the control system {name} takes"):
        Planner(config)


@pytest.mark.parametrize("model", [None, "hold", "guess", "encircle"])
def test_its_model_commands_the_system_that_flies_the_opponent(model):
    config = GameConfig(drones_per_team=2, time_limit=2.0, controllers=("ergodic", "formation"))
    assert len(play_match(Planner(config, model, TINY), "hold", games=2, config=config).games) == 2


@pytest.mark.parametrize("controllers", [("ergodic", "formation"), ("coverage", "formation")])
def test_a_model_that_cannot_command_the_opponents_system_is_refused_by_name(controllers):
    with pytest.raises(KindError, match=r"planner:ring cannot take its opponent for 'ring': .* formation takes"):
        policies.load("planner:ring", GameConfig(controllers=controllers))


@pytest.mark.parametrize("sizes", [(4, 0), (0, 4)])
def test_it_plays_against_nobody_and_for_nobody(sizes):
    config = GameConfig(drones_per_team=sizes, capture=CALM)
    planner, batch = begun(config, "guess"), BatchEnv(config)
    batch.reset([0])
    for _ in range(2):
        answer = batch.ask(planner, RED, ONLY)
        batch.step(np.stack([answer, np.ones((1, 10, 10))], axis=1))
    assert answer.max() == pytest.approx(1.0)


@pytest.mark.parametrize("other", [CONFIG.replace(drones_per_team=(2, 9)), CONFIG.replace(command_cells=6)])
def test_it_plays_by_the_rules_of_the_game_that_it_is_shown(other):
    answers = []
    for loaded in (CONFIG, other):
        planner, batch = begun(loaded, "ring"), BatchEnv(other)
        batch.reset([0])
        batch.step(np.ones((1, 2, other.command_cells, other.command_cells)))
        answers.append(batch.ask(planner, RED, ONLY))
    np.testing.assert_array_equal(*answers)


def test_it_does_not_know_what_will_happen_by_chance():
    config = CONFIG.replace(dynamics=DynamicsConfig(failure_rate=1.0, repair_rate=1.0))
    answers = []
    for chance in (1, 2):
        planner, batch = begun(config), BatchEnv(config)
        batch.reset([0])
        batch.simulator.games.seeds[:] = chance
        answers.append(batch.ask(planner, RED, ONLY))
    np.testing.assert_array_equal(*answers)
