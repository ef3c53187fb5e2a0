"""What users of Gymnasium do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row


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


@row()
def check() -> None:
    """Its `check_env`."""
    import gymnasium
    from gymnasium.utils.env_checker import check_env

    import swarm_pz

    check_env(gymnasium.make("swarm_pz/Capture-v0", render_mode="rgb_array", **SMALL).unwrapped)


@row()
def observations() -> None:
    """`FlattenObservation`, `FrameStackObservation`, and `Normalize`-, `Rescale`- and `DtypeObservation`."""
    import gymnasium
    import numpy as np
    from gymnasium import wrappers

    import swarm_pz

    env = gymnasium.make("swarm_pz/Capture-v0", **SMALL)
    for wrapped in (
        wrappers.FlattenObservation(env),
        wrappers.FrameStackObservation(env, 4),
        wrappers.NormalizeObservation(env),
        wrappers.RescaleObservation(env, np.float32(0), np.float32(1)),
        wrappers.DtypeObservation(env, np.float32),
    ):
        seen, *_ = play(wrapped)
        assert seen in wrapped.observation_space


@row()
def actions() -> None:
    """`ClipAction`, `RescaleAction`, `StickyAction`, `RepeatAction`, `TimeLimit`, `Autoreset`, `PassiveEnvChecker`."""
    import gymnasium
    import numpy as np
    from gymnasium import wrappers

    import swarm_pz

    env = gymnasium.make("swarm_pz/Capture-v0", **SMALL)
    play(wrappers.ClipAction(env))
    play(wrappers.RescaleAction(env, np.float32(0), np.float32(1)))
    play(wrappers.StickyAction(env, 0.5))
    play(wrappers.RepeatAction(env, 2))
    play(wrappers.TimeLimit(env, 3))
    play(wrappers.Autoreset(env))
    play(wrappers.PassiveEnvChecker(env.unwrapped))


@row()
def statistics() -> None:
    """`RecordEpisodeStatistics`, `NormalizeReward`."""
    import gymnasium
    from gymnasium.wrappers import NormalizeReward, RecordEpisodeStatistics

    import swarm_pz

    env = RecordEpisodeStatistics(NormalizeReward(gymnasium.make("swarm_pz/Capture-v0", **SMALL)))
    *_, info = play(env, steps=SMALL["max_cycles"])
    assert info["episode"]["l"] == SMALL["max_cycles"]


@row()
def tensors() -> None:
    """`NumpyToTorch`."""
    import gymnasium
    from gymnasium.wrappers import NumpyToTorch

    import swarm_pz

    seen, *_ = play(NumpyToTorch(gymnasium.make("swarm_pz/Capture-v0", **SMALL)))
    assert seen.shape == (9, 50, 50)


@row()
def video() -> None:
    """`RecordVideo`, of frames once a step and ten times a second."""
    from pathlib import Path

    import gymnasium
    from gymnasium.wrappers import RecordVideo

    import swarm_pz

    for mode in ("rgb_array", "rgb_array_list"):
        env = gymnasium.make("swarm_pz/Capture-v0", render_mode=mode, **SMALL)
        play(RecordVideo(env, f"videos/{mode}", episode_trigger=lambda episode: episode == 0))
    assert len(list(Path("videos").glob("*/*.mp4"))) == 2


@row()
def window() -> None:
    """`HumanRendering`, `RenderCollection`, `AddRenderObservation`."""
    import gymnasium
    from gymnasium import wrappers

    import swarm_pz

    env = gymnasium.make("swarm_pz/Capture-v0", render_mode="rgb_array", **SMALL)
    play(wrappers.RenderCollection(env))
    play(wrappers.AddRenderObservation(env))
    play(wrappers.HumanRendering(env), steps=2)


@row(fails='it makes a `Discrete` of all combinations, and a command has a hundred numbers: use `action="discrete"`')
def discretised() -> None:
    """`DiscretizeAction`."""
    import gymnasium
    from gymnasium.wrappers import DiscretizeAction

    import swarm_pz

    play(DiscretizeAction(gymnasium.make("swarm_pz/Capture-v0", **SMALL), 3))


@row(fails="it is for pictures of three colours; the nine images of an observation are no colours")
def grey() -> None:
    """`GrayscaleObservation`."""
    import gymnasium
    from gymnasium.wrappers import GrayscaleObservation

    import swarm_pz

    play(GrayscaleObservation(gymnasium.make("swarm_pz/Capture-v0", **SMALL)))
