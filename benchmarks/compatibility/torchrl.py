"""What users of TorchRL do."""

from __future__ import annotations

from benchmarks.compatibility.rows import SMALL, row


@row()
def two_players() -> None:
    """`PettingZooWrapper`, a group a side: a rollout to the end, `check_env_specs`."""
    from torchrl.envs import PettingZooWrapper, check_env_specs

    from swarm_pz import parallel_env

    env = PettingZooWrapper(parallel_env(**SMALL), group_map={"red": ["red_0"], "blue": ["blue_0"]})
    check_env_specs(env)
    rollout = env.rollout(50)
    assert len(rollout) == SMALL["max_cycles"]
    assert rollout["next", "done"][-1].all()


@row()
def whole_board() -> None:
    """`PettingZooWrapper(..., return_state=True)`: a rollout to the end."""
    from torchrl.envs import PettingZooWrapper

    from swarm_pz import parallel_env

    assert PettingZooWrapper(parallel_env(**SMALL), return_state=True).rollout(50)["state"].shape == (5, 10, 50, 50)


@row()
def turns() -> None:
    """`PettingZooWrapper` of the AEC face, `use_mask=True`: a rollout to the end."""
    from torchrl.envs import PettingZooWrapper

    from swarm_pz import env

    PettingZooWrapper(env(**SMALL), use_mask=True).rollout(50)


@row()
def one_learner() -> None:
    """`GymEnv("swarm_pz/Capture-v0")`: a rollout to the end, one over several games, `check_env_specs`."""
    from torchrl.envs import GymEnv, check_env_specs

    import swarm_pz

    env = GymEnv("swarm_pz/Capture-v0", **SMALL)
    check_env_specs(env)
    assert len(env.rollout(50)) == SMALL["max_cycles"]
    assert len(env.rollout(12, break_when_any_done=False)) == 12


@row()
def copies() -> None:
    """`GymEnv("swarm_pz:swarm_pz/Capture-v0", num_envs=2)`, a process a game: a rollout over several games."""
    from torchrl.envs import GymEnv

    env = GymEnv("swarm_pz:swarm_pz/Capture-v0", num_envs=2, **SMALL)
    assert env.rollout(12, break_when_any_done=False).shape == (2, 12)
    env.close()


@row(autoreset_mode="SameStep")
def batch(**keywords: str) -> None:
    """`GymWrapper(gymnasium.make_vec(...))`, our own batch: a rollout over several games."""
    import gymnasium
    from torchrl.envs import GymWrapper

    import swarm_pz

    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL, **keywords)
    assert GymWrapper(envs).rollout(12, break_when_any_done=False).shape == (2, 12)


@row(action="discrete", observation_dtype="float32")
def named_commands(**keywords: str) -> None:
    """`GymEnv` with a categorical action: a rollout to the end, `QValueActor`."""
    from torch import nn
    from torchrl.envs import GymEnv
    from torchrl.modules import QValueActor

    import swarm_pz

    env = GymEnv("swarm_pz/Capture-v0", categorical_action_encoding=True, **SMALL, **keywords)
    values = nn.Sequential(nn.Flatten(-3), nn.LazyLinear(env.action_spec.n))
    env.rollout(50, QValueActor(values, in_keys=["observation"], spec=env.action_spec))
