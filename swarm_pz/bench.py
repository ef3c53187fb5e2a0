"""Speed of the simulator and the environments on this machine.

A drone-step is one drone for one control period of 0.1 s: a solve, three ticks of physics, the rules of capture. An
env-step is one command of each team, held for a second of one game. Ended games begin anew within the measured time.
"""

from __future__ import annotations

import itertools
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import AGENTS, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.config.base import check
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.parallel_env import parallel_env
from swarm_pz.evaluation.provenance import versions
from swarm_pz.simulator import CheckedCommands, Simulator

MIN_SECONDS = 0.3
"""Length of one measurement."""
REPEATS = 3
"""Measurements of each size, of which the median counts."""
_COMMANDS = 8

Step = Callable[[], object]
"""One env-step of every game."""
MakeStep = Callable[[GameConfig, int, int], Step]
"""Makes an API's step from a configuration, a number of games and a number of threads."""


class Speed(NamedTuple):
    """Speed of one API at one size; `drones` counts both teams, and rates are per second."""

    api: str
    games: int
    drones: int
    threads: int
    drone_steps: float
    env_steps: float


def make_simulator_step(config: GameConfig, games: int, threads: int) -> Step:
    """Return a step of the bare simulator, with commands, without observations or rewards."""
    simulator = Simulator(config, games, threads)
    simulator.reset(range(games))
    commands = _commands(config, games)

    def step() -> None:
        ended = np.flatnonzero(simulator.decided)
        if len(ended):
            simulator.reset(ended, ended)
        simulator.advance(config.step_ticks, CheckedCommands(next(commands)))

    return step


def make_batch_env_step(config: GameConfig, games: int, threads: int) -> Step:
    """Return a step of `BatchEnv` with the observations of both sides."""
    env = BatchEnv(config, games, threads=threads)
    env.reset(range(games))
    commands = _commands(config, games)

    def step() -> None:
        env.step(next(commands))
        ended = np.flatnonzero(~env.running)
        if len(ended):
            env.reset(ended, ended)
        for team, observation in enumerate(config.observations):
            env.observe(observation, team)

    return step


def make_parallel_env_step(config: GameConfig, games: int, threads: int) -> Step:  # noqa: ARG001
    """Return a step of PettingZoo's parallel environment, which is one game in one thread."""
    env = parallel_env(config=config)
    env.reset(seed=0)
    commands = _commands(config, 1)

    def step() -> None:
        env.step(dict(zip(AGENTS, next(commands)[0].astype(np.float32), strict=True)))
        if not env.agents:
            env.reset()

    return step


def _commands(config: GameConfig, games: int) -> Iterator[NDArray[np.float64]]:
    """Repeat a few random commands (games, 2, A, A), drawn beforehand."""
    cells = config.command_cells
    return itertools.cycle(list(np.random.default_rng(0).random((_COMMANDS, games, 2, cells, cells))))


def measure(
    apis: Mapping[str, MakeStep],
    games: Sequence[int],
    drones: Sequence[int],
    threads: Sequence[int],
    log: Callable[[str], object],
) -> list[Speed]:
    """Measure every API at every size.

    Sizes with more threads than games or cores are left out. `parallel_env` plays one game; `jax` chooses its threads.

    Raises
    ------
    ConfigError
        If no size is left.
    """
    cores = os.cpu_count() or 1
    sizes = [
        (api, count, size, workers)
        for size, count, (api, workers) in itertools.product(drones, games, itertools.product(apis, threads))
        if workers <= (1 if api.startswith("jax") else min(cores, count)) and (api != "parallel_env" or count == 1)
    ]
    check(bool(sizes), "threads", threads, f"at most as many as games, {games}, and cores, {cores}")
    speeds = []
    for number, (api, count, size, workers) in enumerate(sizes, start=1):
        log(f"[{number}/{len(sizes)}] {api}: {count} games of {size} drones")
        config = GameConfig(drones_per_team=size // 2)
        step = apis[api](config, count, workers)
        step()  # compiles
        rate = count * statistics.median(steps_per_second(step) for _ in range(REPEATS))
        periods = config.step_ticks // TICKS_PER_CONTROL_PERIOD
        speeds.append(Speed(api, count, size, workers, rate * size * periods, rate))
    return speeds


def steps_per_second(step: Step) -> float:
    """Return how many steps per second can be taken."""
    calls, began = 0, time.perf_counter()
    while True:
        step()
        calls += 1
        spent = time.perf_counter() - began
        if spent >= MIN_SECONDS:
            return calls / spent


def machine() -> dict[str, str | int]:
    """Return the processor, the number of cores, and the versions of Python and packages."""
    model = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.is_file():
        names = [line.split(":", 1)[1].strip() for line in described.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    return {"processor": model, "cores": os.cpu_count() or 1, **versions()}
