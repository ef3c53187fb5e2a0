"""What users of Stable-Baselines3 do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row

FEW: dict[str, Any] = {"buffer_size": 50, "learning_starts": 8, "batch_size": 8}
"""An off-policy algorithm that learns from its ninth step on."""


@row()
def check() -> None:
    """Its `check_env` of `gymnasium.make(...)`."""
    import gymnasium
    from stable_baselines3.common.env_checker import check_env

    import swarm_pz

    check_env(gymnasium.make("swarm_pz/Capture-v0", **SMALL).unwrapped)


@row()
def ppo() -> None:
    """PPO, `CnnPolicy`, on `SwarmVecEnv`; saved, loaded, asked."""
    from stable_baselines3 import PPO

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, opponent="ring", seed=0, **SMALL)
    PPO("CnnPolicy", envs, n_steps=8, batch_size=8, n_epochs=1, seed=0).learn(32).save("ppo")
    PPO.load("ppo", envs).predict(envs.reset())


@row()
def ppo_of_gymnasium() -> None:
    """PPO, `CnnPolicy`, on `gymnasium.make(...)`."""
    import gymnasium
    from stable_baselines3 import PPO

    import swarm_pz

    env = gymnasium.make("swarm_pz/Capture-v0", opponent="ring", **SMALL)
    PPO("CnnPolicy", env, n_steps=16, batch_size=8, n_epochs=1, seed=0).learn(32)


@row()
def ppo_of_entities() -> None:
    """PPO, `MultiInputPolicy`, on lists of drones (`ObservationConfig(kind="entities")`)."""
    from stable_baselines3 import PPO

    from swarm_pz import ObservationConfig
    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, observation=ObservationConfig(kind="entities"), **SMALL)
    PPO("MultiInputPolicy", envs, n_steps=8, batch_size=8, n_epochs=1).learn(32)


@row()
def ppo_against_ppo() -> None:
    """PPO against an earlier PPO: a model is an opponent as it is."""
    from stable_baselines3 import PPO

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, **SMALL)
    earlier = PPO("CnnPolicy", envs, n_steps=8, batch_size=8, n_epochs=1)
    envs = SwarmVecEnv(num_envs=2, opponent=earlier, **SMALL)
    PPO("CnnPolicy", envs, n_steps=8, batch_size=8, n_epochs=1).learn(32)


@row()
def a2c() -> None:
    """A2C, `CnnPolicy`, on `SwarmVecEnv`."""
    from stable_baselines3 import A2C

    from swarm_pz.training.vec_env import SwarmVecEnv

    A2C("CnnPolicy", SwarmVecEnv(num_envs=2, **SMALL), n_steps=8).learn(32)


@row()
def a2c_of_gymnasium() -> None:
    """A2C, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10."""
    import gymnasium
    from stable_baselines3 import A2C

    from swarm_pz import ObservationConfig

    env = gymnasium.make("swarm_pz/Capture-v0", observation=ObservationConfig(grid=10), **SMALL)
    A2C("MlpPolicy", env, n_steps=8).learn(32)


@row()
def sac() -> None:
    """SAC, `CnnPolicy`, on `SwarmVecEnv`."""
    from stable_baselines3 import SAC

    from swarm_pz.training.vec_env import SwarmVecEnv

    SAC("CnnPolicy", SwarmVecEnv(num_envs=2, **SMALL), **FEW).learn(16)


@row()
def sac_of_gymnasium() -> None:
    """SAC, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10."""
    import gymnasium
    from stable_baselines3 import SAC

    from swarm_pz import ObservationConfig

    env = gymnasium.make("swarm_pz/Capture-v0", observation=ObservationConfig(grid=10), **SMALL)
    SAC("MlpPolicy", env, **FEW).learn(16)


@row()
def td3() -> None:
    """TD3, `CnnPolicy`, on `SwarmVecEnv`."""
    from stable_baselines3 import TD3

    from swarm_pz.training.vec_env import SwarmVecEnv

    TD3("CnnPolicy", SwarmVecEnv(num_envs=2, **SMALL), **FEW).learn(16)


@row()
def td3_of_gymnasium() -> None:
    """TD3, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10."""
    import gymnasium
    from stable_baselines3 import TD3

    from swarm_pz import ObservationConfig

    env = gymnasium.make("swarm_pz/Capture-v0", observation=ObservationConfig(grid=10), **SMALL)
    TD3("MlpPolicy", env, **FEW).learn(16)


@row(action="discrete")
def dqn(**keywords: Any) -> None:
    """DQN, `CnnPolicy`, on `SwarmVecEnv`."""
    from stable_baselines3 import DQN

    from swarm_pz.training.vec_env import SwarmVecEnv

    DQN("CnnPolicy", SwarmVecEnv(num_envs=2, **SMALL, **keywords), **FEW).learn(16)


@row(action="discrete")
def dqn_of_gymnasium(**keywords: Any) -> None:
    """DQN, `MlpPolicy`, on `gymnasium.make(...)`."""
    import gymnasium
    from stable_baselines3 import DQN

    import swarm_pz

    DQN("MlpPolicy", gymnasium.make("swarm_pz/Capture-v0", **SMALL, **keywords), **FEW).learn(16)


@row()
def wrappers() -> None:
    """`VecMonitor`, `VecFrameStack`, `VecNormalize`, `evaluate_policy`, on `SwarmVecEnv`."""
    from stable_baselines3 import A2C
    from stable_baselines3.common.evaluation import evaluate_policy
    from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = VecNormalize(VecFrameStack(VecMonitor(SwarmVecEnv(num_envs=2, **SMALL)), 2), norm_obs=False)
    evaluate_policy(A2C("CnnPolicy", envs, n_steps=8).learn(16), envs, n_eval_episodes=2)


@row()
def copies() -> None:
    """`make_vec_env`, copies of `gymnasium.make(...)`, and A2C on them."""
    from stable_baselines3 import A2C
    from stable_baselines3.common.env_util import make_vec_env

    import swarm_pz

    A2C("CnnPolicy", make_vec_env("swarm_pz/Capture-v0", 2, env_kwargs=SMALL), n_steps=8).learn(16)


@row()
def video() -> None:
    """`VecVideoRecorder`; needs moviepy (`pip install "gymnasium[other]"`)."""
    from pathlib import Path

    from stable_baselines3.common.vec_env import VecVideoRecorder

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = VecVideoRecorder(SwarmVecEnv(num_envs=2, **SMALL), "videos", lambda step: step == 0, video_length=3)
    envs.reset()
    for _ in range(5):
        envs.step([envs.action_space.sample() for _ in range(2)])
    envs.close()
    assert len(list(Path("videos").glob("*.mp4"))) == 1
