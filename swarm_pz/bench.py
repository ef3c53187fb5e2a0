"""How fast the simulator and the environments are on this machine.

A drone-step is one drone for one control period of 0.1 s, with its optimal-control solve, three
ticks of physics and the rules of capture. An env-step is one command of each team, held for one
command period of one game. Ended games start afresh within the measured time.
"""

from __future__ import annotations

import itertools
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import AGENTS, TICKS_PER_CONTROL_PERIOD, GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.parallel_env import parallel_env
from swarm_pz.errors import ConfigError, require_extra
from swarm_pz.evaluation.provenance import versions
from swarm_pz.kernels.profiling import find_coefficients, solve
from swarm_pz.simulator import CheckedCommands, Simulator

MAX_DRONES = 102_400
"""Sizes with more drones in all games together are left out."""
JAX = "jax"
MOST_DRONES_IN_JAX = 200
"""Of both teams, as `swarm_pz.jax.params` has it, which this module does not import."""
MIN_SECONDS = 0.3
"""Of one measurement."""
_COMMANDS = 8

Step = Callable[[], object]
"""One env-step of every game."""
MakeStep = Callable[[GameConfig, int, int], Step]
"""Makes an API's step from a configuration, a number of games and a number of threads."""


@dataclass(frozen=True, kw_only=True)
class Speed:
    """How fast one API is at one size: medians of the repeats, and the range of drone-steps.

    Attributes
    ----------
    api : str
    games, drones, threads : int
        `drones` counts both teams of one game.
    drone_steps, slowest, fastest : float
        Drone-steps a second.
    env_steps : float
        Env-steps a second.
    """

    api: str
    games: int
    drones: int
    threads: int
    drone_steps: float
    slowest: float
    fastest: float
    env_steps: float


def make_simulator_step(config: GameConfig, games: int, threads: int) -> Step:
    """Commands and the bare simulator, without observations or rewards."""
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
    """`BatchEnv` with the observations of both sides."""
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
    """PettingZoo's parallel environment, which is one game in one thread."""
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
    apis: dict[str, MakeStep],
    *,
    games: Sequence[int],
    drones: Sequence[int],
    threads: Sequence[int],
    grid: int,
    repeats: int,
    log: Callable[[str], None],
) -> list[Speed]:
    """Measure every API at every size; at each size all APIs and numbers of threads take turns.

    Parameters
    ----------
    apis : dict of str to callable
        `parallel_env` is measured with one game and one thread only.
    games, drones, threads : sequence of int
        Sizes; `drones` are those of both teams, even. Left out are sizes above `MAX_DRONES`, more threads than games
        or cores, and what an API cannot do: `is_measured` tells.
    grid : int
        Cells a side of the observations.
    repeats : int
    log : callable
        Called with a line about what is measured next.

    Raises
    ------
    ConfigError
        If no size is left.
    """
    cores = os.cpu_count() or 1
    speeds = []
    pairs = [(count, size) for size in drones for count in games]
    keys = [[one for one in itertools.product(apis, threads) if is_measured(*one, *pair, cores)] for pair in pairs]
    if not any(keys):
        raise ConfigError(
            f"nothing to measure: at least one size must have at most {MAX_DRONES:,} drones in all games together "
            f"and as many games and cores ({cores}) as threads, got {games} games, {drones} drones, {threads} threads"
        )
    sizes = [(*pair, measured) for pair, measured in zip(pairs, keys, strict=True) if measured]
    for number, (count, size, measured) in enumerate(sizes, start=1):
        log(f"[{number}/{len(sizes)}] {count} games of {size} drones")
        config = GameConfig(drones_per_team=size // 2, observation=ObservationConfig(grid=grid))
        steps = {(api, workers): apis[api](config, count, workers) for api, workers in measured}
        for step in steps.values():
            step()
        rounds = [{key: count * steps_per_second(step) for key, step in steps.items()} for _ in range(repeats)]
        drone_steps = size * (config.step_ticks // TICKS_PER_CONTROL_PERIOD)
        for key in steps:
            rates = [one[key] for one in rounds]
            median = statistics.median(rates)
            speeds.append(
                Speed(
                    api=key[0],
                    games=count,
                    drones=size,
                    threads=key[1],
                    drone_steps=median * drone_steps,
                    slowest=min(rates) * drone_steps,
                    fastest=max(rates) * drone_steps,
                    env_steps=median,
                )
            )
    return speeds


def is_measured(api: str, threads: int, games: int, drones: int, cores: int) -> bool:
    """Tell whether an API is measured at a size: JAX takes all threads by itself, and small swarms only."""
    if api == JAX:
        return threads == 1 and drones <= MOST_DRONES_IN_JAX
    if games * drones > MAX_DRONES or threads > min(cores, games):
        return False
    return api != "parallel_env" or games == threads == 1


def steps_per_second(step: Step) -> float:
    """Return how often a second a step can be taken."""
    calls, began = 0, time.perf_counter()
    while True:
        step()
        calls += 1
        spent = time.perf_counter() - began
        if spent >= MIN_SECONDS:
            return calls / spent


def phases(config: GameConfig, games: int = 64) -> dict[str, float]:
    """Return the nanoseconds that each part of a drone-step takes in one thread.

    Observations count once a command period and side; they are shared out to its drone-steps.
    """
    env = BatchEnv(config, games)
    env.reset(range(games))
    commands = _commands(config, games)
    for _ in range(10):
        env.step(next(commands))
        ended = np.flatnonzero(~env.running)
        env.reset(ended, ended)
    simulator = env.simulator
    start = simulator.snapshot()
    periods = config.step_ticks // TICKS_PER_CONTROL_PERIOD

    def advance() -> None:
        simulator.restore(start)
        simulator.advance(config.step_ticks)

    def observe() -> None:
        for team, observation in enumerate(config.observations):
            env.observe(observation, team)

    def nanoseconds(step: Step) -> float:
        step()
        spent = 1e9 / statistics.median(steps_per_second(step) for _ in range(5))
        simulator.restore(start)
        return spent / (games * config.num_drones)

    coefficients = nanoseconds(lambda: find_coefficients(simulator.games, simulator.controller))
    solves = nanoseconds(lambda: solve(simulator.games, simulator.controller))
    copies = nanoseconds(lambda: simulator.restore(start))
    whole = (nanoseconds(advance) - copies) / periods
    seen = nanoseconds(observe)
    return {
        "memory, rollout and coefficients": coefficients,
        "costate": solves - coefficients,
        "ticks and capture": whole - solves,
        "observations of both sides": seen / periods,
    }


def bytes_per_game(config: GameConfig) -> int:
    """Return the memory that a game's state takes."""
    return sum(array.nbytes for array in Simulator(config).games)


def machine() -> dict[str, str | int]:
    """Tell what the figures were measured on, and with what."""
    model = platform.processor() or platform.machine()
    described = Path("/proc/cpuinfo")
    if described.is_file():
        names = [line.split(":", 1)[1].strip() for line in described.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    return {"processor": model, "cores": os.cpu_count() or 1, **versions()}


def to_dict(speeds: Sequence[Speed], phases_ns: dict[str, float], config: GameConfig) -> dict[str, Any]:
    """Gather what was measured, for a file."""
    return {
        "machine": machine(),
        "bytes_per_game": bytes_per_game(config),
        "phases_ns_per_drone_step": phases_ns,
        "speeds": [asdict(speed) for speed in speeds],
    }


def plot(speeds: Sequence[Speed], path: Path) -> None:
    """Draw drone-steps a second over the number of games, a panel for each API."""
    figure_module = require_extra("matplotlib.figure", "cli")
    apis = [api for api in dict.fromkeys(speed.api for speed in speeds) if api != "parallel_env"]
    figure = figure_module.Figure(figsize=(3.2 * len(apis), 3.4), layout="constrained")
    axes = figure.subplots(1, len(apis), sharey=True, squeeze=False)[0]
    colours = ("#1d62d6", "#d6451d", "#2a9d5c", "#8046c4", "#c49a1d")
    for axis, api in zip(axes, apis, strict=True):
        for colour, size in zip(colours, dict.fromkeys(speed.drones for speed in speeds), strict=False):
            for style, workers in zip(("--", "-", ":"), dict.fromkeys(speed.threads for speed in speeds), strict=False):
                line = [s for s in speeds if (s.api, s.drones, s.threads) == (api, size, workers)]
                label = f"{size} drones, {workers} thread{'s' if workers > 1 else ''}"
                drone_steps = [s.drone_steps / 1e6 for s in line]
                axis.plot([s.games for s in line], drone_steps, style, marker="o", ms=3, color=colour, label=label)
        axis.set_title(api, fontsize=10)
        counts = list(dict.fromkeys(speed.games for speed in speeds))
        axis.set_xscale("log")
        axis.set_xticks(counts, [str(count) for count in counts])
        axis.minorticks_off()
        axis.set_xlabel("games side by side")
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("million drone-steps a second")
    axes[0].set_ylim(bottom=0)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)
