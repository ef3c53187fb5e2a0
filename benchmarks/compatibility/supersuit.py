"""What users of SuperSuit do."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from benchmarks.compatibility.rows import SMALL, row
from swarm_pz import parallel_env

with contextlib.suppress(ImportError):  # whoever reads the rows may lack it
    import supersuit


def make(**keywords: Any) -> Any:
    """Return a game."""
    return parallel_env(**SMALL, **keywords)


def play(env: Any) -> Any:
    """Play a game to its end with actions drawn at random; return what red sees then."""
    env.reset(seed=0)
    while env.agents:
        seen, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    return seen["red_0"]


def batch(env: Any, library: str = "stable_baselines3") -> Any:
    """Return two games side by side, for a library."""
    return supersuit.concat_vec_envs_v1(supersuit.pettingzoo_env_to_vec_env_v1(env), 2, base_class=library)


@row("`dtype_v0`, `normalize_obs_v0`, `flatten_v0`, `delay_observations_v0`, `max_observation_v0`")
def observations() -> None:
    for wrapped in (
        supersuit.normalize_obs_v0(supersuit.dtype_v0(make(), "float32")),
        supersuit.flatten_v0(make()),
        supersuit.delay_observations_v0(make(), 2),
        supersuit.max_observation_v0(make(), 2),
    ):
        assert play(wrapped) in wrapped.observation_space("red_0")


@row("`clip_actions_v0`, `clip_reward_v0`, `sticky_actions_v0`, `frame_skip_v0`")
def actions() -> None:
    play(supersuit.clip_actions_v0(make()))
    play(supersuit.clip_reward_v0(make()))
    play(supersuit.sticky_actions_v0(make(), 0.5))
    play(supersuit.frame_skip_v0(make(), 2))


@row("`frame_stack_v1`, `agent_indicator_v0`: frames and marks of the side are further images", channels_last=True)
def frames(**keywords: Any) -> None:
    for wrapped, images in (
        (supersuit.frame_stack_v1(make(**keywords), 4), 4 * 9),
        (supersuit.agent_indicator_v0(make(**keywords)), 9 + 2),
    ):
        shape = play(wrapped).shape
        assert shape == (50, 50, images), f"not {images} images of 50 by 50, but {shape}"


resized = row(
    "`resize_v1`",
    "it scales pictures of 1, 3 or 4 colours, and an observation is nine images: "
    "choose the grid instead, `ObservationConfig(grid=25)`",
)(lambda: play(supersuit.resize_v1(make(channels_last=True), 84, 84)))
grey = row(
    "`color_reduction_v0`", "it is for pictures of three colours; the nine images of an observation are no colours"
)(lambda: play(supersuit.color_reduction_v0(make(channels_last=True))))


@row(
    "The chain to Stable-Baselines3: `frame_stack_v1`, `pettingzoo_env_to_vec_env_v1`, `concat_vec_envs_v1`; PPO",
    channels_last=True,
)
def chain(**keywords: Any) -> None:
    from stable_baselines3 import PPO

    envs = batch(supersuit.frame_stack_v1(make(**keywords), 4))
    PPO("CnnPolicy", envs, n_steps=8, batch_size=8, n_epochs=1).learn(32)
    shape = envs.observation_space.shape
    assert shape == (50, 50, 4 * 9), f"it learns, from frames joined at their edges: {shape}"


@row('The chain to Gymnasium\'s vectors: `concat_vec_envs_v1(..., base_class="gymnasium")`')
def gymnasium_chain() -> None:
    envs = batch(make(), "gymnasium")
    envs.reset(seed=0)
    for _ in range(12):
        envs.step(np.stack([envs.action_space.sample() for _ in range(envs.num_envs)]))


@row("The same chain, `PPO(..., seed=0)`", "SuperSuit's `ConcatVecEnv` has no `seed`, which Stable-Baselines3 calls")
def seeded() -> None:
    from stable_baselines3 import PPO

    PPO("CnnPolicy", batch(make()), seed=0)


@row("The same chain: its games differ from each other")
def differing() -> None:
    seen = batch(make()).reset()
    assert (seen[0] != seen[2]).any(), "both games begin alike"
