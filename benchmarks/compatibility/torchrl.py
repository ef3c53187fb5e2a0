"""What users of TorchRL do."""

from __future__ import annotations

import contextlib

import gymnasium

import swarm_pz
from benchmarks.compatibility.rows import SMALL, row

with contextlib.suppress(ImportError):  # whoever reads the rows may lack it
    from torchrl.envs import GymEnv, GymWrapper, PettingZooWrapper, check_env_specs


@row("`PettingZooWrapper`, a group a side: a rollout to the end, `check_env_specs`")
def two_players() -> None:
    env = PettingZooWrapper(swarm_pz.parallel_env(**SMALL), group_map={"red": ["red_0"], "blue": ["blue_0"]})
    check_env_specs(env)
    rollout = env.rollout(50)
    assert len(rollout) == SMALL["max_cycles"]
    assert rollout["next", "done"][-1].all()


@row("`PettingZooWrapper(..., return_state=True)`: a rollout to the end")
def whole_board() -> None:
    rollout = PettingZooWrapper(swarm_pz.parallel_env(**SMALL), return_state=True).rollout(50)
    assert rollout["state"].shape == (5, 10, 50, 50)


turns = row("`PettingZooWrapper` of the AEC face, `use_mask=True`: a rollout to the end")(
    lambda: PettingZooWrapper(swarm_pz.env(**SMALL), use_mask=True).rollout(50)
)


@row('`GymEnv("swarm_pz/Capture-v0")`: a rollout to the end, one over several games, `check_env_specs`')
def one_learner() -> None:
    env = GymEnv("swarm_pz/Capture-v0", **SMALL)
    check_env_specs(env)
    assert len(env.rollout(50)) == SMALL["max_cycles"]
    assert len(env.rollout(12, break_when_any_done=False)) == 12


@row('`GymEnv("swarm_pz:swarm_pz/Capture-v0", num_envs=2)`, a process a game: a rollout over several games')
def copies() -> None:
    env = GymEnv("swarm_pz:swarm_pz/Capture-v0", num_envs=2, **SMALL)
    assert env.rollout(12, break_when_any_done=False).shape == (2, 12)
    env.close()


@row("`GymWrapper(gymnasium.make_vec(...))`, our own batch: a rollout over several games", autoreset_mode="SameStep")
def batch(**keywords: str) -> None:
    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL, **keywords)
    assert GymWrapper(envs).rollout(12, break_when_any_done=False).shape == (2, 12)


@row(
    "`GymEnv` with a categorical action: a rollout to the end, `QValueActor`",
    action="discrete",
    observation_dtype="float32",
)
def named_commands(**keywords: str) -> None:
    from torch import nn
    from torchrl.modules import QValueActor

    env = GymEnv("swarm_pz/Capture-v0", categorical_action_encoding=True, **SMALL, **keywords)
    values = nn.Sequential(nn.Flatten(-3), nn.LazyLinear(env.action_spec.n))
    env.rollout(50, QValueActor(values, in_keys=["observation"], spec=env.action_spec))
