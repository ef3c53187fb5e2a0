"""Each learning method trains, and leaves a policy that loads."""

import pytest

from benchmarks import algorithms
from benchmarks.algorithms import SCRIPTS, run
from swarm_pz.config import GameConfig
from swarm_pz.policies import load
from swarm_pz.systems.ergodic import Ergodic


@pytest.mark.parametrize("method", ["ppo-selfplay", "ppo-sets", "dqn"])
def test_a_method_learns_and_what_it_learned_is_a_player(method, tmp_path, monkeypatch):
    small = algorithms.RECIPE.replace(num_envs=4, rollout=8, batch_size=16, epochs=1)
    monkeypatch.setattr(algorithms, "RECIPE", small)
    played = {name: {"score": 0.65, "ms": 0.5} for name in ("uniform", *SCRIPTS)}
    monkeypatch.setattr(algorithms, "evaluate", lambda player, games: played)
    dealt, deal = [], algorithms.SwarmVecEnv.deal
    monkeypatch.setattr(algorithms.SwarmVecEnv, "deal", lambda env, *given: dealt.append(given[1]) or deal(env, *given))
    found = run(method, 0, 64, 50, tmp_path)
    assert found["weights"] > 1000 and found["final"] == played
    assert load(str(tmp_path / f"{method}-0"), GameConfig(), Ergodic()).answers == "density"
    if method == "ppo-selfplay":
        assert dealt[-1] == ["self-1", "self-2"], "one self for each update, the first before it has learned"
    monkeypatch.setattr(algorithms, "SwarmVecEnv", None)
    assert run(method, 0, 64, 50, tmp_path) == found, "a run that has ended is read"
