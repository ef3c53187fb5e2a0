"""What users of Gymnasium do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env

import swarm_pz
from benchmarks.compatibility.rows import SMALL, row

UNIT = np.float32(0), np.float32(1)


def make(mode: str | None = None) -> gymnasium.Env[Any, Any]:
    """Return a game."""
    return gymnasium.make("swarm_pz/Capture-v0", render_mode=mode, **SMALL)


def play(env: Any, steps: int = 12) -> Any:
    """Play with the same random actions each time, over the end of a game; return the last step's results."""
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(steps):
        results = env.step(env.action_space.sample())
        _, _, terminated, truncated, _ = results
        if not hasattr(env, "num_envs") and (terminated or truncated):
            env.reset()
    env.close()
    return results


check = row("Its `check_env`")(lambda: check_env(make("rgb_array").unwrapped))


@row("`FlattenObservation`, `FrameStackObservation`, and `Normalize`-, `Rescale`- and `DtypeObservation`")
def observations() -> None:
    env = make()
    for wrapped in (
        wrappers.FlattenObservation(env),
        wrappers.FrameStackObservation(env, 4),
        wrappers.NormalizeObservation(env),
        wrappers.RescaleObservation(env, *UNIT),
        wrappers.DtypeObservation(env, np.float32),
    ):
        seen, *_ = play(wrapped)
        assert seen in wrapped.observation_space


@row("`ClipAction`, `RescaleAction`, `StickyAction`, `RepeatAction`, `TimeLimit`, `Autoreset`, `PassiveEnvChecker`")
def actions() -> None:
    env = make()
    for wrapped in (
        wrappers.ClipAction(env),
        wrappers.RescaleAction(env, *UNIT),
        wrappers.StickyAction(env, 0.5),
        wrappers.RepeatAction(env, 2),
        wrappers.TimeLimit(env, 3),
        wrappers.Autoreset(env),
        wrappers.PassiveEnvChecker(env.unwrapped),
    ):
        play(wrapped)


@row("`RecordEpisodeStatistics`, `NormalizeReward`")
def statistics() -> None:
    *_, info = play(wrappers.RecordEpisodeStatistics(wrappers.NormalizeReward(make())), steps=SMALL["max_cycles"])
    assert info["episode"]["l"] == SMALL["max_cycles"]


@row("`NumpyToTorch`")
def tensors() -> None:
    seen, *_ = play(wrappers.NumpyToTorch(make()))
    assert seen.shape == (9, 50, 50)


@row("`RecordVideo`, of frames once a step and ten times a second")
def video() -> None:
    for mode in ("rgb_array", "rgb_array_list"):
        play(wrappers.RecordVideo(make(mode), f"videos/{mode}", episode_trigger=lambda episode: episode == 0))
    assert len(list(Path("videos").glob("*/*.mp4"))) == 2


@row("`HumanRendering`, `RenderCollection`, `AddRenderObservation`")
def window() -> None:
    env = make("rgb_array")
    play(wrappers.RenderCollection(env))
    play(wrappers.AddRenderObservation(env))
    play(wrappers.HumanRendering(env), steps=2)


discretised = row(
    "`DiscretizeAction`",
    'it makes a `Discrete` of all combinations, and a command has a hundred numbers: use `action="discrete"`',
)(lambda: play(wrappers.DiscretizeAction(make(), 3)))
grey = row(
    "`GrayscaleObservation`", "it is for pictures of three colours; the nine images of an observation are no colours"
)(lambda: play(wrappers.GrayscaleObservation(make())))
