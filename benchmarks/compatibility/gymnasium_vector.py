"""What users of Gymnasium's vectors do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import vector

import swarm_pz
from benchmarks.compatibility.gymnasium import play
from benchmarks.compatibility.rows import SMALL, row


def make(**keywords: Any) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
    """Return two games."""
    return gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL, **keywords)


@row("Our own batch, with `autoreset_mode` next step and same step")
def modes() -> None:
    for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        envs = make(autoreset_mode=mode)
        assert envs.metadata["autoreset_mode"] == mode
        play(envs)


@row('Our own batch, `autoreset_mode` disabled, and `options={"reset_mask": ...}`')
def mask() -> None:
    envs = make(autoreset_mode=AutoresetMode.DISABLED)
    envs.reset(seed=0)
    for _ in range(12):
        _, _, terminated, truncated, _ = envs.step(envs.action_space.sample())
        ended = np.asarray(terminated | truncated)
        if ended.any():
            envs.reset(options={"reset_mask": ended})


@row("Copies of the single game, `vectorization_mode` sync and async")
def copies() -> None:
    for mode in ("sync", "async"):
        play(make(vectorization_mode=mode))


@row("`RecordEpisodeStatistics`, `NormalizeReward`, `NormalizeObservation`, `FlattenObservation`, `ClipAction`")
def statistics() -> None:
    envs = vector.RecordEpisodeStatistics(vector.NormalizeReward(make()))
    envs = vector.ClipAction(vector.FlattenObservation(vector.NormalizeObservation(envs)))
    *_, infos = play(envs, steps=SMALL["max_cycles"])
    lengths = infos["episode"]["l"][infos["_episode"]]
    assert len(lengths) > 0 and (lengths == SMALL["max_cycles"]).all(), infos


@row("`NumpyToTorch`")
def tensors() -> None:
    seen, *_ = play(vector.NumpyToTorch(make()))
    assert seen.shape == (2, 9, 50, 50)


@row("`DictInfoToList`")
def lists() -> None:
    *_, infos = play(vector.DictInfoToList(make()))
    assert infos[1]["size"] >= 0


@row("`RecordVideo`")
def video() -> None:
    play(vector.RecordVideo(make(render_mode="rgb_array"), "videos", episode_trigger=lambda episode: episode == 0))
    assert len(list(Path("videos").glob("*.mp4"))) == 1


window = row("`HumanRendering`; needs opencv")(
    lambda: play(vector.HumanRendering(make(render_mode="rgb_array")), steps=2)
)
