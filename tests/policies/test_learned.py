"""Folders of learned policies are read as they were written, or refused."""

from __future__ import annotations

import json
import os
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError
from swarm_pz.policies import zoo
from swarm_pz.policies.learned import CARD, WEIGHTS, LearnedPolicy
from swarm_pz.spaces.actions import command_from_action

ZOO = Path(zoo.__file__).parent
CHAMPION, DIRECT = ZOO / "champion", ZOO / "systems" / "hovering" / "direct"


def read(folder=CHAMPION, **rules):
    return LearnedPolicy.read(folder, GameConfig(**rules))


def boards(policy, count=1):
    shape = (count, len(policy.observation.channels), policy.observation.grid, policy.observation.grid)
    return (np.arange(np.prod(shape)) * 37 % 256).reshape(shape).astype(np.uint8)


def test_noise_is_of_the_size_that_is_asked_for_and_from_each_games_own_stream():
    policy, seeds = read(command_cells=6), {5: 11, 2: 12}
    images, rows = boards(policy, 2), np.array([5, 2])
    means = policy.network()(torch.from_numpy(images).float() / 255).detach().double().numpy()
    streams = [np.random.default_rng(seed) for seed in seeds.values()]
    for noise in (0.0, 0.5):
        policy.noise = noise
        for row, seed in seeds.items():
            policy.reset([seed], np.array([row]))
        for _ in range(2):
            drawn = np.stack([stream.normal(size=means.shape[1:]) for stream in streams]) if noise else 0.0
            expected = command_from_action(np.clip(means + noise * drawn, -1, 1), 6, is_log=True)
            np.testing.assert_allclose(policy.act(images, rows), expected, atol=1e-4)


def test_writing_and_reading_change_nothing_and_results_change_the_card_alone(tmp_path):
    policy = read()
    policy.weights()["head.bias"].zero_()  # `weights` returns copies, so this must not change the policy
    policy.write(tmp_path / "copy")
    again = read(tmp_path / "copy")
    assert (again.digest, again.name) == (policy.digest, "copy")
    updated = policy.with_results({"won": 3})
    assert updated.card == policy.card | {"results": {"won": 3}} and updated.digest != policy.digest
    for other in (again, updated):
        answers = [one.act(boards(one), np.zeros(1, int)) for one in (policy, other)]
        np.testing.assert_array_equal(*answers)


def test_a_card_never_stands_without_its_weights(tmp_path):
    (tmp_path / "new" / WEIGHTS).mkdir(parents=True)
    with pytest.raises(OSError, match="expected the name of a file"):
        read().write(tmp_path / "new")
    assert not (tmp_path / "new" / CARD).exists()


def change(**fields):
    """Change fields of a card by hand; the value ... removes a field."""

    def spoil(folder):
        card = json.loads((folder / CARD).read_text()) | fields
        (folder / CARD).write_text(json.dumps({name: value for name, value in card.items() if value is not ...}))

    return spoil


def rewrite(**fields):
    """Change fields of a card, and write the folder again with the digest that fits."""

    def spoil(folder):
        policy = read(folder)
        LearnedPolicy(policy.card | fields, policy.weights(), GameConfig(), "copy").write(folder)

    return spoil


def put(name, make):
    return lambda folder: (folder / name).write_bytes(make((folder / name).read_bytes()))


class Bomb:
    """A pickle that creates a file when it is loaded."""

    def __reduce__(self):
        return Path.touch, (Path("boom"),)


SPOILED = {
    "no weights": (lambda folder: (folder / WEIGHTS).unlink(), "policy.onnx or policy.safetensors"),
    "torn weights": (put(WEIGHTS, lambda content: content[:-100]), "corrupt or foreign"),
    "a pickle": (put(WEIGHTS, lambda _: pickle.dumps(Bomb())), "corrupt or foreign"),
    "a changed weight": (
        put(WEIGHTS, lambda content: content[:-3] + bytes([content[-3] ^ 1]) + content[-2:]),
        "was changed",
    ),
    "huge weights": (lambda folder: os.truncate(folder / WEIGHTS, 2**33), "expected 67,108,864 bytes or fewer"),
    "a huge card": (lambda folder: os.truncate(folder / CARD, 2**33), "expected 1,048,576 bytes or fewer"),
    "other results": (change(results={}), "was changed"),
    "unknown channels": (change(channels=["mine"]), "do not fit its card: .*mine"),
    "other rules": (rewrite(config_hash="0" * 16), "config_hash"),
}


@pytest.mark.parametrize("fault", SPOILED)
def test_a_spoiled_folder_is_refused_by_what_is_wrong_with_it(tmp_path, fault):
    spoil, message = SPOILED[fault]
    folder = Path(shutil.copytree(CHAMPION, tmp_path / "copy"))
    spoil(folder)
    with pytest.raises(CheckpointError, match=message):
        policies.load(folder)
    assert not Path("boom").exists()


def test_fields_of_a_card_and_weights_that_are_none_are_refused():
    policy = read()
    for field, value in {
        "format": 99, "width": "wide", "grid": 2.5, "action_cells": 0, "channels": [1], "ancestors": [{"steps": 1}],
    }.items():  # fmt: skip
        with pytest.raises(CheckpointError, match=f"must .*{field}|do not fit its card"):
            LearnedPolicy(policy.card | {field: value}, policy.weights(), GameConfig(), "spoiled")
    for spoilt in ({"shape": []}, {"shape": [20, "2"]}, {"head": "image"}, {"head": "tail"}, {"width": None}):
        with pytest.raises(CheckpointError, match="do not fit its card"):
            LearnedPolicy(read(DIRECT).card | spoilt, {}, GameConfig(), "spoiled")
    weights = {name: np.full(values.shape, np.nan, np.float32) for name, values in policy.weights().items()}
    with pytest.raises(CheckpointError, match="finite"):
        LearnedPolicy(policy.card, weights, GameConfig(), "spoiled")
