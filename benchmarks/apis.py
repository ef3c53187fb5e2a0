"""What each environment API costs on top of the simulator: its env-steps beside the simulator's, by processor time.

1 is the bare simulator: 64 games of 10 against 10 in one thread, given random commands and advanced by one second a
step, with neither observations nor rewards. An API makes its own steps at a share of that rate; all that it returns is
part of its cost, and so are the answers of the opponent `uniform`. A step is one second of one game; of `drones_env`,
0.2 seconds. APIs of one game stand beside 64 games, too: that a game alone is dearer is part of what they cost.

python -m benchmarks.apis                            # this checkout
python -m benchmarks.apis --beside ../as-it-was      # and another, in turns
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv
from pettingzoo import ParallelEnv

import swarm_pz
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.simulator import CheckedCommands, Simulator
from swarm_pz.training.vec_env import SwarmVecEnv

GAMES, ENTITIES = 64, ObservationConfig(kind="entities")
ID = "swarm_pz/Capture-v0"
SECONDS = 0.2
"""Of processor time, that each API has in a round."""
Step = Callable[[], object]


def drawn(sample: Callable[[], Any]) -> Callable[[], Any]:
    """Return what gives a few actions, drawn beforehand, again and again."""
    return itertools.cycle([sample() for _ in range(8)]).__next__


def simulator(games: int) -> Step:
    """Return a step of the bare simulator, with neither observations nor rewards."""
    bare = Simulator(config := GameConfig(), games, 1)
    bare.reset(range(games))
    generator = np.random.default_rng(0)
    commands = drawn(lambda: generator.random((games, 2, config.command_cells, config.command_cells)))

    def step() -> None:
        ended = np.flatnonzero(bare.decided)
        if len(ended):
            bare.reset(ended, ended)
        bare.advance(config.step_ticks, CheckedCommands(commands()))

    return step


def parallel(environment: ParallelEnv[str, Any, Any]) -> Step:
    """Return a step of a PettingZoo environment."""
    environment.reset(seed=0)
    spaces = {agent: environment.action_space(agent) for agent in environment.possible_agents}
    actions = drawn(lambda: {agent: space.sample() for agent, space in spaces.items()})

    def step() -> None:
        environment.step(actions())
        if not environment.agents:
            environment.reset()

    return step


def single(environment: gymnasium.Env[Any, Any]) -> Step:
    """Return a step of a Gymnasium environment."""
    environment.reset(seed=0)
    actions = drawn(environment.action_space.sample)

    def step() -> None:
        _, _, terminated, truncated, _ = environment.step(actions())
        if terminated or truncated:
            environment.reset()

    return step


def vector(environment: VectorEnv[Any, Any, Any]) -> Step:
    """Return a step of a Gymnasium vector environment, which resets itself."""
    environment.reset(seed=0)
    actions = drawn(environment.action_space.sample)
    return lambda: environment.step(actions())


def sb3(environment: SwarmVecEnv) -> Step:
    """Return a step of Stable-Baselines3's."""
    environment.reset()
    sample = environment.action_space.sample
    actions = drawn(lambda: np.stack([sample() for _ in range(environment.num_envs)]))
    return lambda: environment.step(actions())


APIS: dict[str, tuple[int, Callable[[], Step]]] = {
    "simulator": (GAMES, lambda: simulator(GAMES)),
    "simulator, one game": (1, lambda: simulator(1)),
    f"make_vec({GAMES})": (GAMES, lambda: vector(gymnasium.make_vec(ID, num_envs=GAMES))),
    f"SwarmVecEnv({GAMES})": (GAMES, lambda: sb3(SwarmVecEnv(num_envs=GAMES, seed=0))),
    "parallel_env": (1, lambda: parallel(swarm_pz.parallel_env())),
    "gymnasium.make": (1, lambda: single(gymnasium.make(ID))),
    'parallel_env, kind="entities"': (1, lambda: parallel(swarm_pz.parallel_env(observation=ENTITIES))),
    "drones_env": (1, lambda: parallel(swarm_pz.drones_env())),
}


def measure() -> dict[str, float]:
    """Return how often a second each API makes a step of one game, by processor time; all of them take turns."""
    steps = {name: (games, make()) for name, (games, make) in APIS.items()}
    rates: dict[str, list[float]] = {name: [] for name in steps}
    for _ in range(3):
        for name, (games, step) in steps.items():
            step()
            made, began = 0, time.process_time()
            while (spent := time.process_time() - began) < SECONDS:
                step()
                made += games
            rates[name].append(made / spent)
    return {name: statistics.median(values) for name, values in rates.items()}


def main() -> None:
    """Print a table for the documentation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="processes for each checkout")
    parser.add_argument("--beside", type=Path, help="the folder of another checkout")
    parser.add_argument("--once", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.once:
        print(json.dumps(measure()))
        return
    checkouts = ([arguments.beside.resolve()] if arguments.beside else []) + [Path(__file__).parents[1]]
    found: dict[Path, list[dict[str, float]]] = {folder: [] for folder in checkouts}
    for _ in range(arguments.rounds):
        for folder in checkouts:
            command = [sys.executable, __file__, "--once"]
            environment = os.environ | {"PYTHONPATH": str(folder)}
            told = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE).stdout  # noqa: S603
            found[folder].append(json.loads(told.splitlines()[-1]))
    print("| API |" + "".join(f" {folder.name}, steps a second | of the simulator's |" for folder in checkouts))
    print("|---|" + "---|---|" * len(checkouts))
    unit = statistics.median(one["simulator"] for one in found[checkouts[0]])
    for name in APIS:
        rates = [statistics.median(one[name] for one in found[folder]) for folder in checkouts]
        print(f"| {name} |" + "".join(f" {rate:,.0f} | {rate / unit:.2f} |" for rate in rates), flush=True)


if __name__ == "__main__":
    main()
