"""What users of Stable-Baselines3 do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
from stable_baselines3 import A2C, DQN, PPO, SAC, TD3
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize, VecVideoRecorder

import swarm_pz
from benchmarks.compatibility.rows import SMALL, row
from swarm_pz import ObservationConfig
from swarm_pz.training.vec_env import SwarmVecEnv

SHORT: dict[str, Any] = {"n_steps": 8, "batch_size": 8, "n_epochs": 1}
"""An on-policy algorithm that learns from every eighth step on."""
FEW: dict[str, Any] = {"buffer_size": 50, "learning_starts": 8, "batch_size": 8}
"""An off-policy algorithm that learns from its ninth step on."""
COARSE = {"observation": ObservationConfig(grid=10)}


def batch(**keywords: Any) -> SwarmVecEnv:
    """Return two games side by side."""
    return SwarmVecEnv(num_envs=2, **SMALL, **keywords)


def single(**keywords: Any) -> gymnasium.Env[Any, Any]:
    """Return one game of Gymnasium's."""
    return gymnasium.make("swarm_pz/Capture-v0", **SMALL, **keywords)


check = row("Its `check_env` of `gymnasium.make(...)`")(lambda: check_env(single().unwrapped))


@row("PPO, `CnnPolicy`, on `SwarmVecEnv`; saved, loaded, asked")
def ppo() -> None:
    envs = batch(opponent="ring", seed=0)
    PPO("CnnPolicy", envs, **SHORT, seed=0).learn(32).save("ppo")
    PPO.load("ppo", envs).predict(envs.reset())


ppo_of_gymnasium = row("PPO, `CnnPolicy`, on `gymnasium.make(...)`")(
    lambda: PPO("CnnPolicy", single(opponent="ring"), n_steps=16, batch_size=8, n_epochs=1, seed=0).learn(32)
)
ppo_of_entities = row('PPO, `MultiInputPolicy`, on lists of drones (`ObservationConfig(kind="entities")`)')(
    lambda: PPO("MultiInputPolicy", batch(observation=ObservationConfig(kind="entities")), **SHORT).learn(32)
)
ppo_against_ppo = row("PPO against an earlier PPO: a model is an opponent as it is")(
    lambda: PPO("CnnPolicy", batch(opponent=PPO("CnnPolicy", batch(), **SHORT)), **SHORT).learn(32)
)
a2c = row("A2C, `CnnPolicy`, on `SwarmVecEnv`")(lambda: A2C("CnnPolicy", batch(), n_steps=8).learn(32))
a2c_of_gymnasium = row("A2C, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10")(
    lambda: A2C("MlpPolicy", single(**COARSE), n_steps=8).learn(32)
)
sac = row("SAC, `CnnPolicy`, on `SwarmVecEnv`")(lambda: SAC("CnnPolicy", batch(), **FEW).learn(16))
sac_of_gymnasium = row("SAC, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10")(
    lambda: SAC("MlpPolicy", single(**COARSE), **FEW).learn(16)
)
td3 = row("TD3, `CnnPolicy`, on `SwarmVecEnv`")(lambda: TD3("CnnPolicy", batch(), **FEW).learn(16))
td3_of_gymnasium = row("TD3, `MlpPolicy`, on `gymnasium.make(...)`, images of 10 by 10")(
    lambda: TD3("MlpPolicy", single(**COARSE), **FEW).learn(16)
)
dqn = row("DQN, `CnnPolicy`, on `SwarmVecEnv`", action="discrete")(
    lambda **keywords: DQN("CnnPolicy", batch(**keywords), **FEW).learn(16)
)
dqn_of_gymnasium = row("DQN, `MlpPolicy`, on `gymnasium.make(...)`", action="discrete")(
    lambda **keywords: DQN("MlpPolicy", single(**keywords), **FEW).learn(16)
)


@row("`VecMonitor`, `VecFrameStack`, `VecNormalize`, `evaluate_policy`, on `SwarmVecEnv`")
def wrappers() -> None:
    envs = VecNormalize(VecFrameStack(VecMonitor(batch()), 2), norm_obs=False)
    evaluate_policy(A2C("CnnPolicy", envs, n_steps=8).learn(16), envs, n_eval_episodes=2)


copies = row("`make_vec_env`, copies of `gymnasium.make(...)`, and A2C on them")(
    lambda: A2C("CnnPolicy", make_vec_env("swarm_pz/Capture-v0", 2, env_kwargs=SMALL), n_steps=8).learn(16)
)


@row('`VecVideoRecorder`; needs moviepy (`pip install "gymnasium[other]"`)')
def video() -> None:
    envs = VecVideoRecorder(batch(), "videos", lambda step: step == 0, video_length=3)
    envs.reset()
    for _ in range(5):
        envs.step([envs.action_space.sample() for _ in range(2)])
    envs.close()
    assert len(list(Path("videos").glob("*.mp4"))) == 1
