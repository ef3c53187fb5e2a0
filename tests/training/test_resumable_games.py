from __future__ import annotations

import numpy as np

from swarm_pz import policies
from swarm_pz.config import CaptureConfig
from swarm_pz.training.resumable_games import ResumableGames
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv
from tests.training.runs import TINY

CALM = TINY.game.replace(drones_per_team=1, capture=CaptureConfig(enabled=False))  # none ends before its last step


def load(opponent, game):
    return policies.load(opponent.name, game)


def make(*cycles, opponents=("noise",)):
    """Return batches of a game each for every opponent, which end after so many steps."""
    parts = [SwarmVecEnv(CALM, len(opponents), opponent=list(opponents), max_cycles=count) for count in cycles]
    return ResumableGames(StackedVecEnv(parts), opponents)


def begun(*cycles, **given):
    env = make(*cycles, **given)
    env.seed(3)
    env.reset()
    return env


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
    first, following = ("noise", "ring"), ("uniform", "blind_ring")
    env, again = begun(2, 5, opponents=first), make(2, 5, opponents=first)
    env.deal([policies.load(name, CALM) for name in following], following)
    for number in range(12):
        step(env)
        assert len(env.state()[1]["actions"]) == env.ages.max() <= 5, "no more than the oldest game has had"
        if number == 2:
            story, arrays = env.state()
            assert env.ages.tolist() == [1, 1, 3, 3]
            _, same = again.restore(story, arrays, load)
            assert same
    assert met(again) == [["uniform"] * 2, ["blind_ring"] * 2, ["noise", "uniform"], ["ring", "blind_ring"]]


def test_games_that_came_out_sooner_here_start_afresh():
    env, again = begun(5, opponents=("noise", "noise")), make(3, opponents=("noise", "noise"))
    for _ in range(4):
        step(env)
    observations, same = again.restore(*env.state(), load)
    assert not same
    assert again.ages.tolist() == [0, 0]
    assert observations[:, -1].min() == 255  # all of their time is left
    assert [step(again)[2].tolist() for _ in range(3)] == [[False] * 2, [False] * 2, [True] * 2]
