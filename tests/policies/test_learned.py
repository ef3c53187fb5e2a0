from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError
from swarm_pz.files import draft_of
from swarm_pz.policies import learned, zoo
from swarm_pz.policies.learned import CARD, WEIGHTS, LearnedPolicy
from swarm_pz.policies.network import Actor
from swarm_pz.spaces.actions import command_from_action

CHAMPION = Path(zoo.__file__).parent / "champion"
AS_SHIPPED = {
    "champion": [[0.000, 0.003, 0.004, 0.000], [0.003, 1.000, 1.000, 0.003], [0.008, 1.000, 1.000, 0.004]],
    "hunter": [[0.000, 0.010, 0.016, 0.000], [0.018, 1.000, 1.000, 0.019], [0.020, 0.948, 0.948, 0.044]],
    "selfplay": [[0.001, 0.005, 0.007, 0.001], [0.003, 0.176, 0.394, 0.004], [0.005, 0.117, 0.194, 0.005]],
    "veteran": [[0.001, 0.007, 0.004, 0.001], [0.004, 0.792, 1.000, 0.004], [0.013, 0.465, 0.601, 0.009]],
}
"""Every third cell of what each tactic answers to one board."""


def boards(policy, count=1):
    shape = (count, len(policy.observation.channels), policy.observation.grid, policy.observation.grid)
    return (np.arange(np.prod(shape)) * 37 % 256).reshape(shape).astype(np.uint8)


@pytest.mark.parametrize("name", AS_SHIPPED)
def test_what_is_shipped_plays_as_it_did_when_it_was_trained(name):
    policy = policies.load(name)
    answer = policy.act(boards(policy), np.zeros(1, int))[0]
    np.testing.assert_allclose(answer[:9:3, ::3], AS_SHIPPED[name], atol=2e-3)


def test_noise_is_of_the_size_that_is_asked_for_and_from_each_games_own_stream():
    policy, seeds = LearnedPolicy.read(CHAMPION, GameConfig(command_cells=6)), {5: 11, 2: 12}
    seen, rows = boards(policy, 2), np.array([5, 2])
    actor = Actor(seen.shape[1:], policy.card["action_cells"], policy.card["width"])
    actor.load_state_dict(policy.weights())
    means = actor(torch.from_numpy(seen).float() / 255).detach().double().numpy()
    streams = [np.random.default_rng(seed) for seed in seeds.values()]
    for noise in (0.0, 0.5):
        policy.noise = noise
        for row, seed in seeds.items():
            policy.reset([seed], np.array([row]))
        for _ in range(2):
            drawn = np.stack([stream.normal(size=means.shape[1:]) for stream in streams]) if noise else 0.0
            expected = command_from_action(np.clip(means + noise * drawn, -1, 1), 6, is_log=True)
            np.testing.assert_allclose(policy.act(seen, rows), expected, atol=1e-4)


def test_a_policy_is_called_by_its_folder_and_keeps_its_name_and_weights_when_results_are_added():
    policy = LearnedPolicy.read(CHAMPION, GameConfig())
    told = policy.with_results({"won": 3})
    assert policy.name == told.name == "champion"
    assert told.card == policy.card | {"results": {"won": 3}}
    assert told.digest != policy.digest
    np.testing.assert_array_equal(
        told.act(boards(told), np.zeros(1, int)), policy.act(boards(policy), np.zeros(1, int))
    )


def test_nobody_changes_a_policy_by_what_it_gave_away():
    policy = LearnedPolicy.read(CHAMPION, GameConfig())
    before = {name: values.clone() for name, values in policy.weights().items()}
    for values in policy.weights().values():
        values.zero_()
    for name, values in policy.weights().items():
        torch.testing.assert_close(values, before[name], rtol=0, atol=0)


def test_a_card_never_stands_without_its_weights(tmp_path, monkeypatch):
    def full(path):
        if path.name == learned.WEIGHTS:
            raise OSError(28, "no space left on device")
        return draft_of(path)

    monkeypatch.setattr(learned, "draft_of", full)
    with pytest.raises(OSError, match="no space"):
        LearnedPolicy.read(CHAMPION, GameConfig()).write(tmp_path / "new")
    assert not list((tmp_path / "new").iterdir())


@pytest.mark.parametrize(("name", "most"), [(CARD, "1,048,576"), (WEIGHTS, "67,108,864")])
def test_a_file_that_is_too_large_is_refused_by_its_size_and_not_read(name, most, tmp_path):
    shutil.copytree(CHAMPION, tmp_path / "large")
    os.truncate(tmp_path / "large" / name, 8 * 2**30)  # it takes no room: nothing is written
    with pytest.raises(
        CheckpointError, match=rf"{name} is too large: expected {most} bytes or fewer, got 8,589,934,592"
    ):
        LearnedPolicy.read(tmp_path / "large", GameConfig())
