"""What users of sb3-contrib do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row


@row()
def recurrent_ppo() -> None:
    """RecurrentPPO, `CnnLstmPolicy`, on `SwarmVecEnv`."""
    from sb3_contrib import RecurrentPPO

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, **SMALL)
    RecurrentPPO("CnnLstmPolicy", envs, n_steps=8, batch_size=8, n_epochs=1).learn(32)


@row()
def trpo() -> None:
    """TRPO, `CnnPolicy`, on `gymnasium.make(...)`."""
    import gymnasium
    from sb3_contrib import TRPO

    import swarm_pz

    TRPO("CnnPolicy", gymnasium.make("swarm_pz/Capture-v0", **SMALL), n_steps=16, batch_size=8).learn(32)


@row()
def tqc() -> None:
    """TQC, `CnnPolicy`, on `SwarmVecEnv`."""
    from sb3_contrib import TQC

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, **SMALL)
    TQC("CnnPolicy", envs, buffer_size=50, learning_starts=8, batch_size=8).learn(16)


@row()
def ars() -> None:
    """ARS, `LinearPolicy`, on `SwarmVecEnv`."""
    from sb3_contrib import ARS

    from swarm_pz import ObservationConfig
    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, observation=ObservationConfig(grid=10), **SMALL)
    ARS("LinearPolicy", envs, n_delta=2, n_top=1, n_eval_episodes=1).learn(8)


@row(action="discrete")
def qr_dqn(**keywords: Any) -> None:
    """QR-DQN, `CnnPolicy`, on `SwarmVecEnv`."""
    from sb3_contrib import QRDQN

    from swarm_pz.training.vec_env import SwarmVecEnv

    envs = SwarmVecEnv(num_envs=2, **SMALL, **keywords)
    QRDQN("CnnPolicy", envs, buffer_size=50, learning_starts=8, batch_size=8).learn(16)
