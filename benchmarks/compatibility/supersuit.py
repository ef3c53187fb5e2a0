"""What users of SuperSuit do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row


def play(env: Any) -> Any:
    """Play a game to its end with actions drawn at random; return what red sees then."""
    env.reset(seed=0)
    while env.agents:
        seen, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    return seen["red_0"]


@row()
def observations() -> None:
    """`dtype_v0`, `normalize_obs_v0`, `flatten_v0`, `delay_observations_v0`, `max_observation_v0`."""
    import supersuit

    from swarm_pz import parallel_env

    for wrapped in (
        supersuit.normalize_obs_v0(supersuit.dtype_v0(parallel_env(**SMALL), "float32")),
        supersuit.flatten_v0(parallel_env(**SMALL)),
        supersuit.delay_observations_v0(parallel_env(**SMALL), 2),
        supersuit.max_observation_v0(parallel_env(**SMALL), 2),
    ):
        assert play(wrapped) in wrapped.observation_space("red_0")


@row()
def actions() -> None:
    """`clip_actions_v0`, `clip_reward_v0`, `sticky_actions_v0`, `frame_skip_v0`."""
    import supersuit

    from swarm_pz import parallel_env

    play(supersuit.clip_actions_v0(parallel_env(**SMALL)))
    play(supersuit.clip_reward_v0(parallel_env(**SMALL)))
    play(supersuit.sticky_actions_v0(parallel_env(**SMALL), 0.5))
    play(supersuit.frame_skip_v0(parallel_env(**SMALL), 2))


@row(channels_last=True)
def frames(**keywords: Any) -> None:
    """`frame_stack_v1`, `agent_indicator_v0`: frames and marks of the side are further images."""
    import supersuit

    from swarm_pz import parallel_env

    for wrapped, images in (
        (supersuit.frame_stack_v1(parallel_env(**SMALL, **keywords), 4), 4 * 9),
        (supersuit.agent_indicator_v0(parallel_env(**SMALL, **keywords)), 9 + 2),
    ):
        shape = play(wrapped).shape
        assert shape == (50, 50, images), f"not {images} images of 50 by 50, but {shape}"


@row(
    fails="it scales pictures of 1, 3 or 4 colours, and an observation is nine images: "
    "choose the grid instead, `ObservationConfig(grid=25)`"
)
def resized() -> None:
    """`resize_v1`."""
    import supersuit

    from swarm_pz import parallel_env

    play(supersuit.resize_v1(parallel_env(channels_last=True, **SMALL), 84, 84))


@row(fails="it is for pictures of three colours; the nine images of an observation are no colours")
def grey() -> None:
    """`color_reduction_v0`."""
    import supersuit

    from swarm_pz import parallel_env

    play(supersuit.color_reduction_v0(parallel_env(channels_last=True, **SMALL)))


@row(channels_last=True)
def chain(**keywords: Any) -> None:
    """The chain to Stable-Baselines3: `frame_stack_v1`, `pettingzoo_env_to_vec_env_v1`, `concat_vec_envs_v1`; PPO."""
    import supersuit
    from stable_baselines3 import PPO

    from swarm_pz import parallel_env

    env = supersuit.frame_stack_v1(parallel_env(**SMALL, **keywords), 4)
    envs = supersuit.concat_vec_envs_v1(supersuit.pettingzoo_env_to_vec_env_v1(env), 2, base_class="stable_baselines3")
    PPO("CnnPolicy", envs, n_steps=8, batch_size=8, n_epochs=1).learn(32)
    shape = envs.observation_space.shape
    assert shape == (50, 50, 4 * 9), f"it learns, from frames joined at their edges: {shape}"


@row()
def gymnasium_chain() -> None:
    """The chain to Gymnasium's vectors: `concat_vec_envs_v1(..., base_class="gymnasium")`."""
    import numpy as np
    import supersuit

    from swarm_pz import parallel_env

    env = supersuit.pettingzoo_env_to_vec_env_v1(parallel_env(**SMALL))
    envs = supersuit.concat_vec_envs_v1(env, 2, base_class="gymnasium")
    envs.reset(seed=0)
    for _ in range(12):
        envs.step(np.stack([envs.action_space.sample() for _ in range(envs.num_envs)]))


@row(fails="SuperSuit's `ConcatVecEnv` has no `seed`, which Stable-Baselines3 calls")
def seeded() -> None:
    """The same chain, `PPO(..., seed=0)`."""
    import supersuit
    from stable_baselines3 import PPO

    from swarm_pz import parallel_env

    env = supersuit.pettingzoo_env_to_vec_env_v1(parallel_env(**SMALL))
    PPO("CnnPolicy", supersuit.concat_vec_envs_v1(env, 2, base_class="stable_baselines3"), seed=0)


@row()
def differing() -> None:
    """The same chain: its games differ from each other."""
    import supersuit

    from swarm_pz import parallel_env

    env = supersuit.pettingzoo_env_to_vec_env_v1(parallel_env(**SMALL))
    seen = supersuit.concat_vec_envs_v1(env, 2, base_class="stable_baselines3").reset()
    assert (seen[0] != seen[2]).any(), "both games begin alike"
