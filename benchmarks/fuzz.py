"""Plays two steps of random legal configurations: none may crash, raise, warn or show non-finite values.

python -m benchmarks.fuzz 100000
"""

from __future__ import annotations

import contextlib
import dataclasses
import subprocess
import sys
import typing
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, PRESETS, GameConfig, ObservationConfig
from swarm_pz.config.base import Config, hints_of
from swarm_pz.config.registry import registered, system_of
from swarm_pz.envs.parallel_env import CaptureEnv
from swarm_pz.errors import CommandError, ConfigError

GRAINS = {"time_limit": 0.1, "command_period": 0.1, "trail": 1 / 30}
"""Fields that must be whole multiples of a number, and that number."""
OTHERS = ("drones_per_team", "controllers", "observation", "modes", "horizon")
"""Fields that `draw` sets itself; new modes and horizons need a compilation."""
ROOT = Path(__file__).parents[1]
_PART = 250
"""Configurations per process."""


def draw_value(kind: type[Config], name: str, rng: np.random.Generator) -> object:
    """Draw a field's value; a number is an end of its range, or log-uniform between the ends."""
    hint = hints_of(kind)[name]  # type: ignore[arg-type]
    is_number = typing.get_origin(hint) is typing.Annotated
    choices = [True, False] if hint is bool else [hint] if is_number else typing.get_args(hint)
    choice = choices[rng.integers(len(choices))]
    if typing.get_origin(choice) is not typing.Annotated:
        return None if choice is type(None) else choice
    base, (low, high) = typing.get_args(choice)
    number = float(rng.choice([low, high, *10 ** rng.uniform(np.log10(max(low, 1e-12)), np.log10(high), 5)]))
    number = np.clip(-number if low < 0.0 and rng.random() < 0.5 else number, low, high)
    return round(number) if base is int else round(number / GRAINS[name]) * GRAINS[name] if name in GRAINS else number


def draw_fields(config: Config, rng: np.random.Generator) -> Config:
    """Return a configuration with some fields, also of its sections, redrawn; values that conflict are dropped."""
    share = rng.random()
    for name in (entry.name for entry in dataclasses.fields(config)):
        old = getattr(config, name)
        if name not in OTHERS and not isinstance(old, tuple) and rng.random() < share:
            with contextlib.suppress(ConfigError):
                new = draw_fields(old, rng) if isinstance(old, Config) else draw_value(type(config), name, rng)
                config = config.replace(**{name: new})
    return config


def draw(rng: np.random.Generator, rare: float = 0.1) -> GameConfig:
    """Draw a configuration; with probability `rare` it has unusual modes and an unusual horizon."""
    config = draw_fields(GameConfig.preset(rng.choice(list(PRESETS))), rng)
    modes, horizon = ((2, 100), (16, 2))[rng.integers(2)] if rng.random() < rare else (10, 10)
    systems = [draw_fields(system_of(name), rng) for name in rng.choice(sorted(registered()), 2).tolist()]
    return config.replace(
        controller=config.controller.replace(modes=modes, horizon=horizon),
        controllers=tuple(systems) if rng.random() < 0.5 else systems[0],
        drones_per_team=tuple(rng.integers(1, 1 + rng.choice([2, 12, 200], p=[0.6, 0.38, 0.02]), 2).tolist()),
        command_period=min(config.command_period, 1.0),
        observation=draw_fields(ObservationConfig(channels=CHANNELS + MOTION_CHANNELS), rng),
    )


def play(number: int, rare: float = 0.1) -> None:
    """Play two steps of the configuration that a number seeds, from a random start and with random commands."""
    rng = np.random.default_rng(number)
    env = CaptureEnv(draw(rng, rare))
    shape = (env.config.num_drones, 2)
    places, velocities = np.round(rng.random(shape), rng.integers(3)), rng.integers(2) * rng.uniform(-10, 10, shape)
    shown, _ = env.reset(number, {"positions": places, "velocities": velocities})
    for _ in range(2):
        actions = {}
        for agent in env.agents:
            box, share = env.action_space(agent), np.round(rng.random(env.action_space(agent).shape), rng.integers(3))
            actions[agent] = (1 - share) * box.low + share * box.high
        with contextlib.suppress(CommandError):  # a formation has fewer points than drones
            shown = env.step(actions)[0] if env.agents else shown
        parts = [part for seen in shown.values() for part in (seen.values() if isinstance(seen, dict) else [seen])]
        if not all(np.isfinite(part).all() for part in parts):
            raise ValueError("an observation is not finite")


def watch(first: int, count: int = _PART, rare: float = 0.1) -> int:
    """Play some numbers in a process, continue in a new one after each failure, and return the number of failures."""
    last, failures = first + count, 0
    while first < last:
        code = f"for i in range({first}, {last}): print(i, flush=True); play(i, {rare})"
        command = [sys.executable, "-W", "error", "-c", f"from benchmarks.fuzz import play\n{code}"]
        child = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)  # noqa: S603
        if child.returncode == 0:
            break
        number = int(child.stdout.split()[-1])
        print(f"{number}: {draw(np.random.default_rng(number), rare)}\n{child.returncode} {child.stderr[-1500:]}")
        first, failures = number + 1, failures + 1
    return failures


if __name__ == "__main__":
    with ThreadPoolExecutor(2) as processes:
        failed = sum(processes.map(watch, range(0, int(sys.argv[1]), _PART)))
    sys.exit(f"{failed} configurations failed" if failed else 0)
