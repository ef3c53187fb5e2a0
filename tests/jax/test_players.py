"""Players under `jit` return the same commands as those of `swarm_pz.policies`."""

import json

import jax
import numpy as np
import pytest

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CheckpointError
from swarm_pz.jax.players import SCRIPTS, load
from swarm_pz.policies import load as load_policy
from swarm_pz.policies.learned import LearnedPolicy

GAME = GameConfig(time_limit=20.0)
ALL = CHANNELS + MOTION_CHANNELS


def seen_of(player, seconds=6):
    """Return both sides' observations of a game at some steps."""
    env, images = BatchEnv(GAME), []
    observation = ObservationConfig(grid=player.grid, channels=ALL if player.motion else CHANNELS)
    env.reset([5])
    generator = np.random.default_rng(0)
    for _ in range(seconds):
        env.step(generator.random((1, 2, 10, 10)) ** 4)
        images += [env.observe(observation, side)[0] for side in (0, 1)]
    return np.stack(images)


@pytest.mark.parametrize("name", ["uniform", "halo", "ring", "champion", "warden"])
def test_answers_are_the_same(name):
    player, policy = load(name), load_policy(name, GAME)
    images, rows = seen_of(player), np.zeros(1, np.int64)
    assert player.grid == policy.observation.grid
    its = [ALL.index(channel) for channel in policy.observation.channels]
    policy.reset([0], rows)
    for image in (*images, np.zeros_like(images[0])):
        mine = np.asarray(player.act(jax.random.key(0), image))
        assert np.abs(mine - policy.act(image[None, its], rows)[0]).max() <= 1e-5


def test_noise_is_drawn_anew_by_its_key():
    act = SCRIPTS["noise"].act
    one, other = (np.asarray(act(jax.random.key(seed), None)) for seed in (0, 1))
    assert one.min() >= 0 and one.max() <= 1 and (one != other).all() and 0.4 < one.mean() < 0.6


def test_who_does_not_play_here_is_told(tmp_path):
    with pytest.raises(CheckpointError, match=r"uniform, noise, halo, ring.*no_such_player"):
        load("no_such_player")
    policy = load_policy("champion", GAME)
    assert isinstance(policy, LearnedPolicy)
    policy.write(tmp_path)
    assert load(tmp_path).grid == 10
    card = tmp_path / "policy.json"
    card.write_text(json.dumps(json.loads(card.read_text()) | {"channels": MOTION_CHANNELS}))
    with pytest.raises(CheckpointError, match=r"default channels.*card says \['own_now'"):
        load(tmp_path)
    (tmp_path / "policy.safetensors").write_bytes(b"no weights")
    with pytest.raises(CheckpointError, match=r"folder.*got"):
        load(tmp_path)
