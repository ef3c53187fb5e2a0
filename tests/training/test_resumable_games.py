from __future__ import annotations

import numpy as np

from swarm_pz import policies
from swarm_pz.config import CaptureConfig
from swarm_pz.training.resumable_games import ResumableGames
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv
from tests.training.runs import TINY

GAME = TINY.game.replace(drones_per_team=1)
CALM = GAME.replace(capture=CaptureConfig(enabled=False))  # none ends before its last step
FIRST, NEXT = ["noise", "ring"], ["uniform", "blind_ring"]


def load(opponent, game):
    return policies.load(opponent.name, game)


def begun(make):
    env = make()
    env.seed(3)
    env.reset()
    return env


def make():
    return ResumableGames(SwarmVecEnv(GAME, 2, opponent=FIRST, seed=3), FIRST)


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


def test_restored_games_end_against_those_they_began_with_and_the_next_meet_those_dealt_last():
    env, again = begun(make), make()
    env.deal([policies.load(name, GAME) for name in NEXT], NEXT)
    step(env)
    assert env.ages.tolist() == [1, 1]
    _, same = again.restore(*env.state(), load)
    assert same
    assert met(again) == met(env) == [["noise", "uniform"], ["ring", "blind_ring"]]


def test_where_one_game_begins_the_others_are_stored_with_whom_they_play():
    def make_uneven():
        parts = [SwarmVecEnv(CALM, 1, opponent="noise", max_cycles=cycles) for cycles in (2, 5)]
        return ResumableGames(StackedVecEnv(parts), ["noise"])

    env, again = begun(make_uneven), make_uneven()
    env.deal([policies.load("uniform", CALM)], ["uniform"])
    for _ in range(3):
        step(env)
    assert env.ages.tolist() == [1, 3]
    _, same = again.restore(*env.state(), load)
    assert same
    assert met(again) == met(env) == [["uniform", "uniform"], ["noise", "uniform"]]


def test_no_more_actions_are_kept_than_the_oldest_unfinished_game_has_had():
    env = begun(make)
    for _ in range(12):
        step(env)
        _, arrays = env.state()
        assert len(arrays["actions"]) == env.ages.max() <= 5


def test_games_that_came_out_sooner_here_start_afresh():
    def make_calm(cycles):
        return ResumableGames(SwarmVecEnv(CALM, 2, opponent="noise", max_cycles=cycles), ["noise"])

    env, again = begun(lambda: make_calm(5)), make_calm(3)
    for _ in range(4):
        step(env)
    observations, same = again.restore(*env.state(), load)
    assert not same
    assert again.ages.tolist() == [0, 0]
    assert observations[:, -1].min() == 255  # all of their time is left
    assert [step(again)[2].tolist() for _ in range(3)] == [[False] * 2, [False] * 2, [True] * 2]
