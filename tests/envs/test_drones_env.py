"""Drones as agents: PettingZoo's tests, who plays and who sits out, and the books of the reward."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils import parallel_to_aec

from swarm_pz import GameConfig, ObservationConfig, RewardConfig, Simulator, drones_env
from swarm_pz.config import CaptureConfig, DynamicsConfig
from swarm_pz.envs.drones_batch import DronesBatch
from swarm_pz.envs.reward import drone_rewards
from swarm_pz.errors import CommandError, ConfigError, GameOverError, PolicyError

VARIANTS = {
    "discrete": {"drones_per_team": 2, "action": "discrete", "side": "blue"},
    "both": {"drones_per_team": 3, "side": "both"},
    "handicap": {"drones_per_team": (1, 4), "side": "blue", "opponent": "ring", "action_period": 0.1, "neighbours": 2},
}
PEACE = CaptureConfig(enabled=False)


@pytest.mark.parametrize("variant", VARIANTS)
def test_pettingzoos_tests_pass(variant):
    parallel_api_test(drones_env(**VARIANTS[variant]), num_cycles=30)
    parallel_seed_test(lambda: drones_env(**VARIANTS[variant], max_cycles=10))
    api_test(parallel_to_aec(drones_env(**VARIANTS[variant])), num_cycles=10)


def test_it_renders():
    render_test(lambda render_mode: parallel_to_aec(drones_env(render_mode=render_mode, drones_per_team=2)))
    environment = drones_env(render_mode="rgb_array_list", drones_per_team=2, action_period=0.5)
    environment.reset(seed=0)
    environment.render()
    environment.step(choose(environment, np.random.default_rng(0)))
    assert len(environment.render()) == 5
    assert environment.metadata["name"] == "swarm_pz_drones_v0"
    assert environment.state_space.contains(environment.state())


def choose(environment, generator):
    return {agent: generator.uniform(-1, 1, 2).astype(np.float32) for agent in environment.agents}


def test_agents_are_named_after_the_team_that_they_begin_with_and_stay():
    environment = drones_env(drones_per_team=(2, 1), side="blue")
    _, infos = environment.reset(seed=0)
    names = ["red_0_drone_0", "blue_0_drone_0", "blue_0_drone_1"]
    assert environment.possible_agents == environment.agents == names
    assert [infos[name]["flies"] for name in names] == [0, 1, 1]
    assert {infos[name]["side"] for name in names} == {1}
    with pytest.raises(ConfigError, match=r"give side='red' or side='blue', got side='random' .*\(2, 1\)"):
        drones_env(drones_per_team=(2, 1))


def play_by_ticks(batch, reference, accelerations):
    """Play a step in a simulator of its own, tick by tick; return the drones' teams after each tick."""
    sides = batch.sides[0]
    accelerations = np.where(batch.flies[0][:, None], accelerations, 0.0)
    reference.restore(batch.batch.simulator.snapshot())
    flown = [0, 1] if batch.duel is None else [int(sides[0])]
    for team in flown:
        reference.command(team, [accelerations])
    teams = []
    for _ in range(batch.config.step_ticks):
        reference.advance(1)
        teams.append(reference.teams[0].copy())
    return teams


def team_rewards(config, before, after):
    """What red gets of a tick: its gain over the mean size, and one for the game."""
    gain = (after == 0).sum() - (before == 0).sum()
    won = (1 if (after == 0).all() else -1 if (after == 1).all() else 0) if len(set(before.tolist())) > 1 else 0
    return config.reward.size_change * gain / (config.num_drones / 2) + config.reward.outcome * won


@pytest.mark.parametrize("side", ["red", "blue", "both"])
def test_every_agent_gets_its_teams_reward_to_the_tick_of_its_capture_and_nothing_while_it_sits_out(side):
    reward, capture = RewardConfig(size_change=0.5, outcome=2.0), CaptureConfig(threshold=0.5)
    config = GameConfig(drones_per_team=4, time_limit=30.0, reward=reward, capture=capture)
    batch = DronesBatch(config, 1, side=side, reward="own", action_period=1.0)
    reference, generator = Simulator(batch.config), np.random.default_rng(1)
    captured, returned = 0, 0
    for seed in range(6):
        batch.reset([np.random.SeedSequence(seed)], np.array([0]))
        reference.reset([0], swapped=batch.duel is not None and batch.duel.sides[0] == 1)
        for _ in range(300):
            if not batch.batch.running[0]:
                break
            accelerations = generator.uniform(-1, 1, (8, 2))
            before, flew, sides = batch.batch.simulator.teams[0].copy(), batch.flies[0], batch.sides[0]
            path = np.array([before, *play_by_ticks(batch, reference, accelerations)])
            result = batch.step(accelerations[None])
            teams = batch.batch.simulator.teams[0]
            assert (teams == path[-1]).all()
            flips = (np.diff(path, axis=0) != 0).sum(axis=0)
            red = [team_rewards(config, old, new) for old, new in itertools.pairwise(path)]
            assert result.result.rewards[0] == pytest.approx([sum(red), -sum(red)])
            for drone in range(8):
                if not flew[drone]:
                    assert result.rewards[0, drone] == 0.0
                elif (flips <= 1).all():  # of one that changes twice in a step, only where it ends counts
                    last = np.flatnonzero(np.diff(path[:, drone]) != 0)
                    got = sum(red[: last[0] + 1]) if len(last) else sum(red)
                    assert result.rewards[0, drone] == pytest.approx(got if sides[drone] == 0 else -got)
            captured += int((flew & (teams != before)).sum())
            returned += int((~flew & batch.flies[0]).sum())
    assert captured > 3 and (returned > 0 or side == "both")


@pytest.mark.parametrize("side", ["blue", "both"])
def test_a_captured_drone_pays_for_the_defeat_like_its_team(side):
    """Each agent gets all that its team gets, sitting out or not; else to be captured early is the best way to lose."""
    config = GameConfig(drones_per_team=3, capture=CaptureConfig(threshold=0.5))
    batch, generator = DronesBatch(config, 1, side=side, action_period=1.0), np.random.default_rng(1)
    captured = ends = 0
    for seed in range(4):
        batch.reset([np.random.SeedSequence(seed)], np.array([0]))
        for _ in range(300):
            if not batch.batch.running[0]:
                break
            sides, flew = batch.sides[0], batch.flies[0]
            result = batch.step(generator.uniform(-1, 1, (1, 6, 2)))
            assert result.rewards[0].tolist() == result.result.rewards[0, sides].tolist()
            assert side == "both" or len(set(result.rewards[0].tolist())) == 1
            captured += int((flew & ~batch.flies[0]).sum() if side != "both" else (sides != batch.sides[0]).sum())
            ends += int(result.terminated[0])
    assert captured > 3 and ends > 0


def shares(after, at, rewards, decided):
    """Return what four drones, two of each team, get of a step in which they come to these teams at these ticks."""
    before, plays = np.array([[0, 0, 1, 1]], np.int8), np.ones((1, 4), np.bool_)
    config, ended = GameConfig(drones_per_team=2), np.array([decided])
    after = np.array([after], np.int8)
    return drone_rewards(config, np.array([rewards]), plays, before, after, np.array([at]), ended)[0].tolist()


def test_who_is_captured_in_one_step_gets_what_each_has_seen_of_it_and_only_the_deciding_tick_loses_the_game():
    # Red loses one at 12, gains one at 13, loses one at 14.
    assert shares([1, 1, 0, 1], [12, 14, 13, -9], [-0.5, 0.5], False) == [-0.5, -0.5, 0.0, 0.5]
    assert shares([1, 1, 1, 1], [12, 14, -9, -9], [-2.0, 2.0], True) == [-0.5, -2.0, 2.0, 2.0]


def test_who_sits_out_sees_nothing_and_its_action_does_nothing():
    def play(pushes):
        environment = drones_env(drones_per_team=2, side="red", reward="own")
        sitting = ("blue_0_drone_0", "blue_0_drone_1")
        environment.reset(seed=3)
        for _ in range(5):
            actions = choose(environment, np.random.default_rng(1)) | dict.fromkeys(sitting, pushes)
            observations, rewards, _, _, infos = environment.step(actions)
            for agent in sitting:
                assert observations[agent][0] == -1 and not observations[agent][1:].any()
                assert rewards[agent] == 0.0 and infos[agent]["flies"] == 0
        return environment.batch.simulator.positions.copy()

    assert (play(np.ones(2)) == play(np.zeros(2))).all()


def test_an_agent_flies_its_drone_and_the_opponents_system_the_others():
    environment = drones_env(drones_per_team=2, side="blue", capture=PEACE)
    environment.reset(seed=0, options={"positions": np.full((4, 2), 0.5), "velocities": np.zeros((4, 2))})
    push = {"red_0_drone_0": [1, 1], "red_0_drone_1": [1, 1], "blue_0_drone_0": [0.5, 0], "blue_0_drone_1": [0, -1]}
    environment.step(push)
    velocities = environment.batch.simulator.velocities[0]
    assert velocities[2:] == pytest.approx(np.array([[0.1, 0], [0, -0.2]]), abs=1e-6)


def test_the_second_of_the_control_systems_flies_for_the_opponent_on_either_side():
    for side in ("red", "blue"):
        for controllers in ("flocking", ("direct", "flocking")):
            environment = drones_env(side=side, controllers=controllers, drones_per_team=2)
            assert environment.config.team_controllers == ("direct", "flocking")
    with pytest.raises(ConfigError, match=r"flown by 'direct': give controllers=\('direct', other\), got \('ergodic'"):
        drones_env(controllers=("ergodic", "flocking"))


def test_one_who_comes_over_coasts_until_its_agent_has_seen_something():
    batch = DronesBatch(GameConfig(drones_per_team=2), 1, side="red")
    batch.reset([np.random.SeedSequence(0)], np.array([0]))
    batch.step(np.ones((1, 4, 2)))
    assert batch.batch.simulator.games.commands[0, 0, :8].reshape(4, 2).tolist() == [[1, 1], [1, 1], [0, 0], [0, 0]]


def test_failed_drones_sit_out():
    dynamics = DynamicsConfig(failure_rate=5.0, repair_rate=5.0)
    environment = drones_env(drones_per_team=4, side="red", dynamics=dynamics, capture=PEACE)
    environment.reset(seed=0)
    flew = set()
    for _ in range(10):
        observations, _, _, _, infos = environment.step(choose(environment, np.random.default_rng(0)))
        for agent in ("red_0_drone_0", "red_0_drone_1"):
            assert observations[agent][0] == (1 if infos[agent]["flies"] else -1)
            flew.add(infos[agent]["flies"])
    assert flew == {0, 1}


class Noted:
    """A policy that notes when it is asked."""

    observation = ObservationConfig(grid=10)

    def __init__(self):
        self.asked = 0

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        self.asked += len(rows)
        return np.ones((len(rows), 10, 10))


def test_an_opponents_command_holds_for_the_command_period():
    noted = Noted()
    environment = drones_env(opponent=noted, drones_per_team=2, command_period=1.0, action_period=0.2)
    environment.reset(seed=0)
    asked = []
    for _ in range(11):
        environment.step(choose(environment, np.random.default_rng(0)))
        asked.append(noted.asked)
    assert asked == [1] * 5 + [2] * 5 + [3]


def test_mistakes_are_said_and_change_nothing():
    environment = drones_env(drones_per_team=1, side="red")
    with pytest.raises(GameOverError, match="call reset before step"):
        environment.step({})
    environment.reset(seed=0)
    good = choose(environment, np.random.default_rng(0))
    for actions, said in (
        ({"red_0_drone_0": [0, 0]}, "missing blue_0_drone_0"),
        (good | {"red_0_drone_7": [0, 0]}, "unknown red_0_drone_7"),
        ([[0, 0]], "got list in place of a mapping"),
        (good | {"blue_0_drone_0": [np.nan, 0]}, "blue_0_drone_0's action"),
        (good | {"red_0_drone_0": [1.5, 0]}, "red_0_drone_0's action"),
        (good | {"red_0_drone_0": 3}, "red_0_drone_0's action"),
    ):
        with pytest.raises(CommandError, match=said):
            environment.step(actions)
    assert environment.batch.simulator.time_s[0] == 0.0
    environment.step(good)


def test_options_that_make_no_sense_are_refused():
    for options, said in (
        ({"side": "green"}, "side must be 'random' or 'red' or 'blue' or 'both'"),
        ({"action_period": 0.3}, "a whole part of command_period"),
        ({"action_period": 0.05}, "action_period must be a number in"),
        ({"action_period": 0.15}, "whole number of control periods"),
        ({"side": "both", "opponent": "ring"}, "no opponent"),
        ({"reward": "mine"}, "reward must be 'team' or 'own'"),
        ({"neighbour": 3}, "did you mean 'neighbours'"),
        ({"render_mode": "3d"}, "there is no render mode"),
    ):
        with pytest.raises(ConfigError, match=said):
            drones_env(**options)
    with pytest.raises(PolicyError, match="there is no policy 'rin'"):
        drones_env(opponent="rin")
    drones_env(side="both", action_period=0.3).close()
