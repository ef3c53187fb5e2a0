"""What users of Gymnasium's vectors do."""

from __future__ import annotations

from benchmarks.compatibility.gymnasium import play
from benchmarks.compatibility.rows import SMALL, row


@row()
def modes() -> None:
    """Our own batch, with `autoreset_mode` next step and same step."""
    import gymnasium
    from gymnasium.vector import AutoresetMode

    import swarm_pz

    for mode in (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP):
        envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, autoreset_mode=mode, **SMALL)
        assert envs.metadata["autoreset_mode"] == mode
        play(envs)


@row()
def mask() -> None:
    """Our own batch, `autoreset_mode` disabled, and `options={"reset_mask": ...}`."""
    import gymnasium
    import numpy as np
    from gymnasium.vector import AutoresetMode

    import swarm_pz

    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, autoreset_mode=AutoresetMode.DISABLED, **SMALL)
    envs.reset(seed=0)
    for _ in range(12):
        _, _, terminated, truncated, _ = envs.step(envs.action_space.sample())
        ended = np.asarray(terminated | truncated)
        if ended.any():
            envs.reset(options={"reset_mask": ended})


@row()
def copies() -> None:
    """Copies of the single game, `vectorization_mode` sync and async."""
    import gymnasium

    import swarm_pz

    for mode in ("sync", "async"):
        play(gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, vectorization_mode=mode, **SMALL))


@row()
def statistics() -> None:
    """`RecordEpisodeStatistics`, `NormalizeReward`, `NormalizeObservation`, `FlattenObservation`, `ClipAction`."""
    import gymnasium
    from gymnasium.wrappers import vector

    import swarm_pz

    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL)
    envs = vector.RecordEpisodeStatistics(vector.NormalizeReward(envs))
    envs = vector.ClipAction(vector.FlattenObservation(vector.NormalizeObservation(envs)))
    *_, infos = play(envs, steps=SMALL["max_cycles"])
    lengths = infos["episode"]["l"][infos["_episode"]]
    assert len(lengths) > 0 and (lengths == SMALL["max_cycles"]).all(), infos


@row()
def tensors() -> None:
    """`NumpyToTorch`."""
    import gymnasium
    from gymnasium.wrappers.vector import NumpyToTorch

    import swarm_pz

    seen, *_ = play(NumpyToTorch(gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL)))
    assert seen.shape == (2, 9, 50, 50)


@row()
def lists() -> None:
    """`DictInfoToList`."""
    import gymnasium
    from gymnasium.wrappers.vector import DictInfoToList

    import swarm_pz

    *_, infos = play(DictInfoToList(gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, **SMALL)))
    assert infos[1]["size"] >= 0


@row()
def video() -> None:
    """`RecordVideo`."""
    from pathlib import Path

    import gymnasium
    from gymnasium.wrappers.vector import RecordVideo

    import swarm_pz

    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, render_mode="rgb_array", **SMALL)
    play(RecordVideo(envs, "videos", episode_trigger=lambda episode: episode == 0))
    assert len(list(Path("videos").glob("*.mp4"))) == 1


@row()
def window() -> None:
    """`HumanRendering`; needs opencv."""
    import gymnasium
    from gymnasium.wrappers.vector import HumanRendering

    import swarm_pz

    envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, render_mode="rgb_array", **SMALL)
    play(HumanRendering(envs), steps=2)
