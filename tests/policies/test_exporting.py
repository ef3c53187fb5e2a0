"""Exported models return the same commands as the originals."""

from __future__ import annotations

import numpy as np
import onnx
import pytest
import torch
from gymnasium.vector.utils import batch_space
from sb3_contrib import RecurrentPPO
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import exporting
from swarm_pz.policies.onnx_policy import MODEL, OnnxPolicy
from swarm_pz.policy import load
from swarm_pz.spaces.observation import observation_space

SEEN = ObservationConfig(grid=10, channels=("own_positions", "opposing_positions", "time_left"))
GAME = GameConfig(drones_per_team=2, time_limit=4.0, observation=SEEN)
ERGODIC = GAME.team_systems[0]


def boards(policy, count, game=GAME):
    if policy.observation.kind == "drones":
        drones = np.random.default_rng(0).random((count, 20, 5)).astype(np.float32)
        drones[..., 4] = np.sign(drones[..., 4] - 0.5)
        return drones
    space = batch_space(observation_space(game, policy.observation), count)
    space.seed(0)
    return space.sample()


@pytest.mark.parametrize(("name", "system"), [("champion", "ergodic"), ("trained", "direct")])
def test_a_policy_of_ours_answers_the_same_and_tells_nothing_of_this_machine(tmp_path, name, system):
    game = GameConfig(controllers=system)
    ours = load(name, game)
    exporting.export_learned(ours, game, game.team_systems[0], tmp_path / "out")
    theirs, batch = load(tmp_path / "out", game), boards(ours, 20, game)
    assert isinstance(theirs, OnnxPolicy)
    assert theirs.card.system == ("" if ours.answers == "density" else system) and ours.digest in theirs.card.origin
    np.testing.assert_allclose(theirs.act(batch, np.arange(20)), ours.act(batch, np.arange(20)), atol=1e-5)
    model = onnx.load(tmp_path / "out" / MODEL)
    assert b"site-packages" not in model.SerializeToString()
    assert not any(node.doc_string or node.metadata_props for node in model.graph.node)


COARSE = {"action_cells": 3}
SHORT = {"n_steps": 2, "batch_size": 2}


def made(make, path, more=SHORT, settings=None, **options):
    """Return a model, and its policy as `load_model` reads it from the saved file."""
    env = DuelEnv(GAME, observation=SEEN, **options)
    model = make("MlpPolicy", env, policy_kwargs={"net_arch": [8]} | (settings or {}), device="cpu", seed=0, **more)
    model.save(path / "model.zip")
    return model, exporting.load_model(path / "model.zip")


SQUASHED = {"squash_output": True, "ortho_init": False}  # else outputs are too small for tanh to change them
KINDS = {
    "DQN": (DQN, {"action": "discrete", "more": {"buffer_size": 10}}),
    "A2C": (A2C, {"action": "command", "more": {"n_steps": 2}}),
    "PPO, squashed": (PPO, {"more": SHORT | {"use_sde": True}, "settings": SQUASHED}),
    "SAC": (SAC, {"action": "command", "more": {"buffer_size": 10}}),
    "TD3": (TD3, {"more": {"buffer_size": 10}}),
}


@pytest.mark.parametrize("name", KINDS)
def test_the_network_that_is_exported_decides_and_limits_as_its_kind_of_model_does(tmp_path, monkeypatch, name):
    """Other tests write a file, which takes seconds; this one calls the network that would be written."""

    def keep(network, *_, **__):
        kept.append(network)
        raise InterruptedError

    make, options = KINDS[name]
    kept, (model, policy) = [], made(make, tmp_path, **({} if make is DQN else COARSE), **options)
    monkeypatch.setattr(torch.onnx, "export", keep)
    with pytest.raises(InterruptedError):
        exporting.export_model(policy, GAME, ERGODIC, tmp_path / "out", "mine")
    space = batch_space(model.observation_space, 10)
    space.seed(0)
    batch = space.sample()
    expected, _ = model.predict(batch, deterministic=True)
    with torch.no_grad():
        answered = kept[0](torch.from_numpy(batch)).numpy()
    if make is DQN:  # it returns the value of each command, and the best one is sent
        np.testing.assert_array_equal(answered.argmax(axis=1), expected)
    else:
        np.testing.assert_allclose(answered, expected, atol=1e-5)


def test_a_model_of_sb3_that_sees_lists_and_remembers_each_game_answers_the_same_and_plays(tmp_path):
    kinds, lists = {"lstm_hidden_size": 6, "n_lstm_layers": 2}, ObservationConfig(kind="entities")
    model = RecurrentPPO(
        "MultiInputLstmPolicy", DuelEnv(GAME, observation=lists, action="command", **COARSE), device="cpu", seed=0,
        policy_kwargs={"net_arch": [8]} | kinds, **SHORT,
    )  # fmt: skip
    for part in model.policy.lstm_actor.parameters():
        torch.nn.init.normal_(part)
    model.save(tmp_path / "model.zip")
    exporting.export_model(exporting.load_model(tmp_path / "model.zip"), GAME, ERGODIC, tmp_path / "out", "mine")
    theirs = load(tmp_path / "out", GAME)
    assert theirs.card.state == {"hidden": "next_hidden", "cell": "next_cell"}
    theirs.reset([0, 1], np.array([3, 9]))
    memory, begins, format_ = None, np.ones(2, bool), theirs.card.format(GAME, ERGODIC)
    assert format_.observation_space == model.observation_space
    shown = boards(theirs, 8)
    for step in range(4):
        now = {name: values[2 * step : 2 * step + 2] for name, values in shown.items()}
        expected, memory = model.predict(now, memory, begins, deterministic=True)
        begins = np.array([False, step == 1])
        np.testing.assert_allclose(theirs.act(now, np.array([3, 9])), format_.read(expected, 2), atol=1e-5)
        if step == 1:
            theirs.reset([2], np.array([9]))
    assert len(play_match(theirs, load("uniform", GAME), games=2, seed=0, config=GAME).games) == 2


def test_what_is_no_model_of_sb3_or_of_another_game_is_refused(tmp_path):
    (tmp_path / "m.zip").write_bytes(b"torn")
    for path in (tmp_path / "m.zip", tmp_path / "none.zip"):
        with pytest.raises(CheckpointError, match="no model that Stable-Baselines3 has saved"):
            exporting.load_model(path)
    model = PPO("MlpPolicy", "CartPole-v1", device="cpu", n_steps=2, batch_size=2)
    with pytest.raises(PolicyError, match="must observe images"):
        exporting.export_model(model.policy, GAME, ERGODIC, tmp_path / "out", "mine")
