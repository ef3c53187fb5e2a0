"""What is exported answers as what it was, whatever it was trained by."""

from __future__ import annotations

import numpy as np
import onnx
import pytest
import torch
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import exporting
from swarm_pz.policies.onnx_policy import MODEL, OnnxPolicy
from swarm_pz.policy import load
from swarm_pz.policy.model_policy import ModelPolicy

SEEN = ObservationConfig(grid=10, channels=("own_positions", "opposing_positions", "time_left"))
GAME = GameConfig(drones_per_team=2, time_limit=4.0, observation=SEEN)
ERGODIC = GAME.team_systems[0]


def boards(policy, count):
    random = np.random.default_rng(0)
    if policy.observation.kind == "drones":
        seen = random.random((count, 20, 5)).astype(np.float32)
        seen[..., 4] = np.sign(seen[..., 4] - 0.5)
        return seen
    shape = (count, len(policy.observation.channels), policy.observation.grid, policy.observation.grid)
    return random.integers(0, 256, shape).astype(np.uint8)


@pytest.mark.parametrize(("name", "system"), [("champion", "ergodic"), ("trained", "direct")])
def test_a_policy_of_ours_answers_the_same_and_tells_nothing_of_this_machine(tmp_path, name, system):
    game = GameConfig(controllers=system)
    ours = load(name, game)
    exporting.export_learned(ours, game, game.team_systems[0], tmp_path / "out")
    theirs, seen = load(tmp_path / "out", game), boards(ours, 20)
    assert isinstance(theirs, OnnxPolicy)
    assert theirs.card.system == ("" if ours.answers == "density" else system) and ours.digest in theirs.card.origin
    np.testing.assert_allclose(theirs.act(seen, np.arange(20)), ours.act(seen, np.arange(20)), atol=1e-5)
    model = onnx.load(tmp_path / "out" / MODEL)
    assert b"site-packages" not in model.SerializeToString()
    assert not any(node.doc_string or node.metadata_props for node in model.graph.node)


FLAT = {"action_cells": 3, "flatten_actions": True}
MODELS = {
    "A2C, channels last": (A2C, {"channels_last": True, "action": "command"} | FLAT),
    "PPO, numbers": (PPO, {"action": "discrete", "observation_dtype": "float32"}),
    "DQN": (DQN, {"action": "discrete"}),
    "SAC": (SAC, {"action": "command"} | FLAT),
    "TD3": (TD3, FLAT),
    "PPO, lists of drones": (PPO, {"observation": ObservationConfig(kind="entities")}),
}


@pytest.mark.parametrize("name", MODELS)
def test_a_model_of_sb3_answers_the_same_and_plays(tmp_path, name):
    make, options = MODELS[name]
    kind = "MultiInputPolicy" if "observation" in options else "MlpPolicy"
    env = DuelEnv(GAME, **({"observation": SEEN} | options))
    settings = {"n_steps": 2} if make in (A2C, PPO) else {"buffer_size": 10}
    settings |= {"batch_size": 2} if make is PPO else {}
    model = make(kind, env, policy_kwargs={"net_arch": [8]}, device="cpu", seed=0, **settings)
    model.save(tmp_path / "model.zip")
    exporting.export_model(exporting.load_model(tmp_path / "model.zip"), GAME, ERGODIC, tmp_path / "out", "mine")
    ours, theirs = ModelPolicy(model, GAME), load(tmp_path / "out", GAME)
    if kind == "MlpPolicy":
        seen = boards(ours, 10)
        np.testing.assert_allclose(theirs.act(seen, np.arange(10)), ours.act(seen, np.arange(10)), atol=1e-5)
    assert len(play_match(theirs, load("uniform", GAME), games=2, seed=0, config=GAME).games) == 2


def test_a_model_with_memory_remembers_each_game(tmp_path):
    env = DuelEnv(GAME, observation=SEEN, observation_dtype="float32", **FLAT)
    kinds = {"net_arch": [8], "lstm_hidden_size": 6, "n_lstm_layers": 2}
    model = RecurrentPPO("MlpLstmPolicy", env, policy_kwargs=kinds, n_steps=2, batch_size=2, device="cpu", seed=0)
    for part in model.policy.lstm_actor.parameters():
        torch.nn.init.normal_(part)
    exporting.export_model(model.policy, GAME, ERGODIC, tmp_path / "out", "mine")
    theirs = load(tmp_path / "out", GAME)
    assert theirs.card.state == {"hidden": "next_hidden", "cell": "next_cell"}
    theirs.reset([0, 1], np.array([3, 9]))
    memory, begins, format_ = None, np.ones(2, bool), theirs.card.format(GAME, ERGODIC)
    for step in range(4):
        seen = np.random.default_rng(step).integers(0, 256, (2, 3, 10, 10)).astype(np.uint8)
        expected, memory = model.predict(format_.show(seen), memory, begins, deterministic=True)
        begins = np.array([False, step == 1])
        np.testing.assert_allclose(theirs.act(seen, np.array([3, 9])), format_.read(expected, 2), atol=1e-5)
        if step == 1:
            theirs.reset([2], np.array([9]))


def test_what_is_no_model_of_sb3_or_of_another_game_is_refused(tmp_path):
    (tmp_path / "m.zip").write_bytes(b"torn")
    for path in (tmp_path / "m.zip", tmp_path / "none.zip"):
        with pytest.raises(CheckpointError, match="no model that Stable-Baselines3 has saved"):
            exporting.load_model(path)
    model = PPO("MlpPolicy", "CartPole-v1", device="cpu", n_steps=2, batch_size=2)
    with pytest.raises(PolicyError, match="must observe images"):
        exporting.export_model(model.policy, GAME, ERGODIC, tmp_path / "out", "mine")
