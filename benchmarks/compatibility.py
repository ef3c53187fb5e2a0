"""Tests the environments with other libraries, each in a fresh virtual environment and in its newest version.

scripts/compatibility                # tests all, and writes docs/tables/compatibility.csv
scripts/compatibility torchrl rllib  # tests some; writes nothing
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import textwrap
import venv
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium

import swarm_pz

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "docs" / "tables" / "compatibility.csv"
ID = "swarm_pz/Capture-v0"
ANSWER = "swarm-pz compatibility: "  # starts the result line of a row's process; libraries print other lines
SMALL: dict[str, Any] = {"drones_per_team": 3, "max_cycles": 5}
SHORT: dict[str, Any] = {"n_steps": 8, "batch_size": 8, "n_epochs": 1}
FEW: dict[str, Any] = {"buffer_size": 50, "learning_starts": 8, "batch_size": 8}
REQUIRED = {  # besides swarm-pz and its extra `train`
    "stable_baselines3": ("gymnasium[torch]", "sb3-contrib"),
    "gymnasium": ("gymnasium[torch]", "moviepy"),
    "pettingzoo": (),
    "supersuit": ("supersuit",),
    "torchrl": ("supersuit", "torchrl"),
    "benchmarl": ("benchmarl", "supersuit"),
    "rllib": ("ray[rllib]", "supersuit"),
}


class Row(NamedTuple):
    """One way in which users use a library."""

    library: str
    what: str
    run: Callable[[], Any]


ROWS: list[Row] = []


def row(library: str, what: str) -> Callable[[Callable[[], Any]], None]:
    """Return a decorator that adds a function to `ROWS`."""
    return lambda run: ROWS.append(Row(library, what, run))


def single(**keywords: Any) -> Any:
    return gymnasium.make(ID, **SMALL, **keywords)


def many(**keywords: Any) -> Any:
    return gymnasium.make_vec(ID, num_envs=2, **SMALL, **keywords)


def batch(**keywords: Any) -> Any:
    from swarm_pz.training.vec_env import SwarmVecEnv

    return SwarmVecEnv(num_envs=2, **SMALL, **keywords)


def flat() -> Any:
    """Return a game whose images SuperSuit flattens to float vectors, and whose actions are short vectors."""
    import supersuit

    env = supersuit.flatten_v0(swarm_pz.parallel_env(action="modes", **SMALL))
    return supersuit.normalize_obs_v0(supersuit.dtype_v0(env, "float32"))


def play(env: Any, steps: int = 12) -> None:
    """Play random actions, and continue after games end."""
    env.reset(seed=0)
    for _ in range(steps):
        results = env.step(env.action_space.sample())
        if not hasattr(env, "num_envs") and (results[2] or results[3]):
            env.reset()
    env.close()


@row(
    "stable_baselines3",
    "check_env; PPO, A2C, SAC, TD3 on SwarmVecEnv and gymnasium.make; VecMonitor, VecFrameStack, VecNormalize",
)
def learners() -> None:
    import stable_baselines3 as sb3
    from stable_baselines3.common.env_checker import check_env
    from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize

    check_env(single().unwrapped)
    for envs in (batch(opponent="ring"), single(opponent="ring")):
        sb3.PPO("CnnPolicy", envs, **SHORT).learn(32).save("ppo")
        sb3.PPO.load("ppo", envs)
        sb3.A2C("CnnPolicy", envs, n_steps=8).learn(32)
        sb3.SAC("CnnPolicy", envs, **FEW).learn(16)
        sb3.TD3("CnnPolicy", envs, **FEW).learn(16)
    sb3.A2C("CnnPolicy", VecNormalize(VecFrameStack(VecMonitor(batch()), 2), norm_obs=False), n_steps=8).learn(16)


@row("stable_baselines3", 'DQN and QR-DQN with action="discrete"; RecurrentPPO, TRPO, TQC of sb3-contrib')
def contributed() -> None:
    import sb3_contrib as contrib
    from stable_baselines3 import DQN

    for algorithm in (DQN, contrib.QRDQN):
        algorithm("CnnPolicy", batch(action="discrete"), **FEW).learn(16)
    contrib.RecurrentPPO("CnnLstmPolicy", batch(), **SHORT).learn(32)
    contrib.TRPO("CnnPolicy", single(), n_steps=16, batch_size=8).learn(32)
    contrib.TQC("CnnPolicy", batch(), **FEW).learn(16)


@row("gymnasium", "check_env; wrappers of observations, actions, rewards, videos, tensors; make_vec in all its modes")
def gymnasium_wrappers() -> None:
    from gymnasium import wrappers
    from gymnasium.utils.env_checker import check_env

    check_env(single(render_mode="rgb_array").unwrapped)
    plain = "FlattenObservation NormalizeObservation ClipAction RecordEpisodeStatistics NormalizeReward NumpyToTorch"
    for name in plain.split():
        play(getattr(wrappers, name)(single()))
        play(getattr(wrappers.vector, name)(many()))
    play(wrappers.FrameStackObservation(single(), 4))
    play(wrappers.RescaleObservation(single(), 0.0, 1.0))
    play(wrappers.DtypeObservation(single(), "float32"))
    play(wrappers.RecordVideo(single(render_mode="rgb_array"), "videos"))
    for keywords in ({"autoreset_mode": "SameStep"}, {"vectorization_mode": "sync"}, {"vectorization_mode": "async"}):
        play(many(**keywords))


@row("pettingzoo", "its tests of parallel and AEC environments; env() unwrapped; parallel_to_aec and back")
def pettingzoo_tests() -> None:
    from pettingzoo import test
    from pettingzoo.utils import aec_to_parallel, parallel_to_aec

    env, parallel_env = swarm_pz.env, swarm_pz.parallel_env
    test.parallel_seed_test(parallel_env)
    test.max_cycles_test(swarm_pz)
    test.state_test(env(**SMALL), parallel_env(**SMALL))
    test.api_test(env(**SMALL), num_cycles=50)
    test.seed_test(env, num_cycles=10)
    test.render_test(lambda render_mode: env(render_mode=render_mode, command_period=0.1, **SMALL))
    for game in (parallel_env(**SMALL), aec_to_parallel(env(**SMALL))):
        test.parallel_api_test(game, num_cycles=50)
        test.parallel_api_test(aec_to_parallel(parallel_to_aec(game)), num_cycles=50)


@row("supersuit", "flatten_v0, dtype_v0, normalize_obs_v0, clip_actions_v0, sticky_actions_v0, frame_skip_v0")
def supersuit_wrappers() -> None:
    import supersuit as ss

    game = swarm_pz.parallel_env(**SMALL)
    for env in (flat(), ss.clip_actions_v0(game), ss.sticky_actions_v0(game, 0.5), ss.frame_skip_v0(game, 2)):
        observations, _ = env.reset(seed=0)
        while env.agents:
            observations, *_ = env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        assert observations["red_0"] in env.observation_space("red_0")


@row("torchrl", 'PettingZooWrapper of both APIs, GymEnv, GymWrapper of make_vec(autoreset_mode="SameStep")')
def rollouts() -> None:
    from torchrl import envs

    game = swarm_pz.parallel_env(**SMALL)
    sides = {"red": ["red_0"], "blue": ["blue_0"]}
    for made in (envs.PettingZooWrapper(game, group_map=sides, return_state=True), envs.GymEnv(ID, **SMALL)):
        envs.check_env_specs(made)
        assert len(made.rollout(50)) == SMALL["max_cycles"]
    envs.PettingZooWrapper(swarm_pz.env(**SMALL), use_mask=True).rollout(50)
    rollout = envs.GymWrapper(many(autoreset_mode="SameStep")).rollout(12, break_when_any_done=False)
    assert rollout.shape == (2, 12)


row("torchrl", "PPO of examples/torchrl_selfplay.py")(lambda: example("torchrl_selfplay"))
row("benchmarl", "IPPO of examples/benchmarl_selfplay.py")(lambda: example("benchmarl_selfplay"))
row("rllib", "PPO of examples/rllib_selfplay.py")(lambda: example("rllib_selfplay"))


def example(name: str) -> None:
    """Run an example in its short form; if it fails, raise `RuntimeError` with the last line of its stderr."""
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), "--steps", "2048", "--games", "2"]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)  # noqa: S603
    if done.returncode:
        last = done.stderr.strip().rpartition("\n")[2]
        raise RuntimeError(f"exit status {done.returncode}: {last}")


def run_here(one: Row) -> None:
    """Run a row, and print its error and versions."""
    error = None
    try:
        one.run()
    except Exception as raised:  # a library may raise anything
        error = f"{type(raised).__name__}: {textwrap.shorten(str(raised), 160)}"
    names = {"rllib": "ray"}.get(one.library, one.library), "pettingzoo", "gymnasium"
    versions = ", ".join(f"{name} {version(name)}" for name in dict.fromkeys(names))
    print("\n" + ANSWER + json.dumps([error, versions]), flush=True)


def ask(place: int, python: Path) -> tuple[str | None, str]:
    """Run a row in its own process; return its error, or None if it works, and versions."""
    settings = {"PYTHONPATH": str(ROOT), "SDL_VIDEODRIVER": "dummy", "CUDA_VISIBLE_DEVICES": ""}
    command = [str(python), "-m", "benchmarks.compatibility", "--row", str(place)]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(command, cwd=folder, env=os.environ | settings, capture_output=True, text=True)  # noqa: S603
    answers = [line for line in done.stdout.splitlines() if line.startswith(ANSWER)]
    if not answers:
        sys.exit(f"{ROWS[place].what} ended without an answer:\n{done.stderr}")
    error, versions = json.loads(answers[-1].removeprefix(ANSWER))
    return error, versions


def main() -> None:
    """Make virtual environments, run rows in them, and write the table if all rows were run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("libraries", nargs="*", choices=[[], *REQUIRED], help="all if not given")
    parser.add_argument("--row", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row is not None:
        run_here(ROWS[options.row])
        return
    table, failed = [("library", "what", "result", "versions")], []
    for library in options.libraries or REQUIRED:
        python = ROOT / f".venv-{library}" / "bin" / "python"
        venv.create(python.parents[1], with_pip=True, clear=True)
        wanted = ["--editable", f"{ROOT}[train]", *REQUIRED[library]]
        subprocess.run([python, "-m", "pip", "install", "-q", *wanted], check=True)  # noqa: S603
        for place, one in enumerate(ROWS):
            if one.library == library:
                error, versions = ask(place, python)
                print(f"{library}: {one.what}: {error or 'works'}", flush=True)
                table.append((library, one.what, f"fails: {error}" if error else "works", versions))
                failed += [one.what] * (error is not None)
    if not options.libraries:
        with TABLE.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(table)
    if failed:
        sys.exit(f"failed: {failed}")


if __name__ == "__main__":
    main()
