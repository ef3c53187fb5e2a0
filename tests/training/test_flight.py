from __future__ import annotations

import numpy as np

from swarm_pz import policies
from swarm_pz.config import CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.training.flight import InFlight
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

GAME = GameConfig(observation=ObservationConfig(grid=10), drones_per_team=1, time_limit=5.0)
FIRST, NEXT = ["noise", "ring"], ["uniform", "blind_ring"]


def make():
    return InFlight(SwarmVecEnv(GAME, 2, opponent=FIRST, seed=3), FIRST)


def step(env):
    return env.step(np.full((env.num_envs, *env.action_space.shape), 0.5, np.float32))


def met(env):
    """Play until each game has ended twice; return whom the learners met, game by game."""
    names = [[] for _ in range(env.num_envs)]
    while min(map(len, names)) < 2:
        for row, info in enumerate(step(env)[3]):
            if "outcome" in info:
                names[row].append(env.opponent_names[info["opponent"]])
    return [of_row[:2] for of_row in names]


def test_games_taken_up_end_against_those_they_began_with_and_the_next_meet_those_dealt_last():
    env = make()
    env.seed(3)
    env.reset()
    env.deal([policies.load(name, GAME) for name in NEXT], NEXT)
    step(env)
    assert env.ages.tolist() == [1, 1]
    again = make()
    _, same = again.take_up(*env.state(), lambda opponent, game: policies.load(opponent.name, game))
    assert same
    assert met(again) == met(env) == [["noise", "uniform"], ["ring", "blind_ring"]]
    for one in (env, again):
        one.close()


def test_where_one_game_begins_the_others_are_stored_with_whom_they_play():
    calm = GAME.replace(capture=CaptureConfig(enabled=False))  # none ends before its last step

    def make_uneven():
        parts = [SwarmVecEnv(calm, 1, opponent="noise", max_cycles=cycles) for cycles in (2, 5)]
        return InFlight(StackedVecEnv(parts), ["noise"])

    env, again = make_uneven(), make_uneven()
    env.seed(3)
    env.reset()
    env.deal([policies.load("uniform", calm)], ["uniform"])
    for _ in range(3):
        step(env)
    assert env.ages.tolist() == [1, 3]
    _, same = again.take_up(*env.state(), lambda opponent, game: policies.load(opponent.name, game))
    assert same
    assert met(again) == met(env) == [["uniform", "uniform"], ["noise", "uniform"]]
    for one in (env, again):
        one.close()


def test_no_more_actions_are_kept_than_the_oldest_unfinished_game_has_had():
    env = make()
    env.seed(3)
    env.reset()
    for _ in range(12):
        step(env)
        _, arrays = env.state()
        assert len(arrays["actions"]) == env.ages.max() <= 5
    env.close()


def test_games_that_came_out_sooner_here_start_afresh():
    calm = GAME.replace(capture=CaptureConfig(enabled=False))

    def make_calm(cycles):
        return InFlight(SwarmVecEnv(calm, 2, opponent="noise", max_cycles=cycles), ["noise"])

    env, again = make_calm(5), make_calm(3)
    env.seed(3)
    env.reset()
    for _ in range(4):
        step(env)
    observations, same = again.take_up(*env.state(), lambda opponent, game: policies.load(opponent.name, game))
    assert not same
    assert again.ages.tolist() == [0, 0]
    assert observations[:, -1].min() == 255  # all of their time is left
    assert [step(again)[2].tolist() for _ in range(3)] == [[False] * 2, [False] * 2, [True] * 2]
    for one in (env, again):
        one.close()
