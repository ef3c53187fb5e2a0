from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_pz import GameConfig, policies
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policy import load
from swarm_pz.training.vec_env import SwarmVecEnv

SHIPPED = Path(policies.__file__).parent / "zoo" / "hunter"


@pytest.fixture
def folder(tmp_path):
    """A folder as training writes it."""
    LearnedPolicy.read(SHIPPED, GameConfig()).write(tmp_path / "runs" / "first")
    return tmp_path / "runs" / "first"


def test_a_folder_that_training_wrote_is_an_opponent_in_every_face(folder):
    for opponent in (folder, str(folder), "runs/first"):
        for make in (DuelEnv, DuelVectorEnv, SwarmVecEnv):
            environment = make(opponent=opponent, drones_per_team=5, max_cycles=5)
            assert environment.opponent_names == [str(opponent)]
            assert isinstance(environment.duel._dealt[0].player, LearnedPolicy)
    learners = SwarmVecEnv(num_envs=2, opponent=["runs/first", folder], max_cycles=5)
    learners.reset()
    learners.step(np.zeros((2, 10, 10)))


def test_names_come_before_folders(tmp_path):
    (tmp_path / "ring").mkdir()
    assert load("ring", GameConfig()).name == "ring"


def test_what_is_neither_name_nor_folder_is_said(tmp_path):
    config = GameConfig()
    with pytest.raises(PolicyError, match="there is no policy 'rign', and no such folder; did you mean 'ring'"):
        load("rign", config)
    with pytest.raises(
        PolicyError, match=r"there is no folder 'runs/frist', nor a policy of that name; there are blind_ring, "
    ):
        load("runs/frist", config)
    (tmp_path / "empty").mkdir()
    with pytest.raises(CheckpointError, match=r"empty holds no policy: expected policy\.json in it"):
        load(tmp_path / "empty", config)
    with pytest.raises(PolicyError, match="must have reset"):
        load(42, config)
