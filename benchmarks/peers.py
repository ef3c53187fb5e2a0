"""Speed of swarm-pz and other multi-agent simulators: same machine, same cores, each at its best number of games.

A drone-step of swarm-pz includes an optimal-control solve with a look-ahead, three ticks of physics and the rules of
capture. An agent-step of the others is one agent in one step of their simulation. Every simulator runs in its own
process, is compiled first, and takes random actions that were drawn beforehand.

    scripts/peers        # in an environment of its own, since the others need other versions
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.csv_table import write_csv

SECONDS = 1.5
"""Shortest time of one measurement."""
REPEATS = 3
SIZES = (1, 16, 64, 256, 1024, 4096)
"""Numbers of games at once; the fastest one counts."""
MARK = "swarm-pz peers: "
"""Begins the result line of a simulator's process, which may print other lines."""

Step = Callable[[], object]


def swarm_pz(games: int, threads: int) -> tuple[Step, int]:
    """Return a function that plays one second of E games, and the drone-steps in it."""
    from swarm_pz.simulator import CheckedCommands, Simulator

    simulator = Simulator(num_games=games, threads=threads)
    simulator.reset(range(games))
    commands = np.random.default_rng(0).random((16, games, 2, 10, 10))
    taken = 0

    def step() -> None:
        nonlocal taken
        ended = np.flatnonzero(simulator.decided)
        if len(ended):
            simulator.reset(ended + taken, ended)
        simulator.advance(30, CheckedCommands(commands[taken % 16]))
        taken += 1

    return step, games * simulator.config.num_drones * 10


def swarm_pz_in_jax(games: int, threads: int) -> tuple[Step, int]:
    """Return a function that plays one second of E games in JAX, with observations, and the drone-steps in it."""
    from swarm_pz.config import GameConfig, ObservationConfig
    from swarm_pz.jax.speed import make_jax_step

    config = GameConfig(observation=ObservationConfig(grid=10))
    return make_jax_step(config, games, threads), games * config.num_drones * 10


def vmas(scenario: str, games: int, threads: int, **arguments: Any) -> tuple[Step, int]:
    """Return a function that takes 10 steps of a VMAS scenario, and the agent-steps in them."""
    import torch
    from vmas import make_env

    torch.set_num_threads(threads)
    env = make_env(scenario=scenario, num_envs=games, device="cpu", continuous_actions=True, seed=0, **arguments)
    actions = [[env.get_random_action(agent) for agent in env.agents] for _ in range(10)]

    def step() -> None:
        for action in actions:
            env.step(action)

    return step, games * len(env.agents) * len(actions)


def magent_battle(_games: int, _threads: int) -> tuple[Step, int]:
    """Return a function that takes 20 steps of one MAgent2 battle, 81 against 81, and the agent-steps in them."""
    from magent2.environments import battle_v4

    env = battle_v4.parallel_env()
    generator = np.random.default_rng(0)
    actions = [dict(zip(env.possible_agents, row, strict=True)) for row in generator.integers(21, size=(20, 162))]

    def step() -> None:
        env.reset(seed=0)
        for action in actions:
            env.step({agent: action[agent] for agent in env.agents})

    return step, len(env.possible_agents) * len(actions)


def jaxmarl(name: str, games: int, _threads: int) -> tuple[Step, int]:
    """Return a function that takes 32 steps of a JaxMARL environment, on all cores, and the agent-steps in them."""
    import jax
    from jaxmarl import make

    env: Any = make(name)
    steps = 32
    keys = jax.random.split(jax.random.PRNGKey(0), games)
    _, state = jax.vmap(env.reset)(keys)

    def draw(key: Any) -> Any:
        return {
            agent: jax.vmap(jax.vmap(env.action_space(agent).sample))(jax.random.split(part, (steps, games)))
            for agent, part in zip(env.agents, jax.random.split(key, len(env.agents)), strict=True)
        }

    actions = draw(jax.random.PRNGKey(1))

    @jax.jit
    def roll(keys: Any, state: Any) -> Any:
        def advance(carry: Any, action: Any) -> Any:
            keys, state = carry
            split = jax.vmap(jax.random.split)(keys)
            observations, state, rewards, _, _ = jax.vmap(env.step)(split[:, 0], state, action)
            # XLA does not compute unused outputs, so the sum of each is used.
            used = sum(leaf.sum() for leaf in jax.tree.leaves((observations, rewards)))
            return (split[:, 1], state), used

        return jax.lax.scan(advance, (keys, state), actions)

    def step() -> None:
        jax.block_until_ready(roll(keys, state))

    return step, games * len(env.agents) * steps


FOOTBALL = {"n_blue_agents": 10, "n_red_agents": 10, "ai_red_agents": False, "ai_blue_agents": False}
CONTENDERS: dict[str, tuple[Callable[..., tuple[Step, int]], str, str, tuple[int, ...]]] = {
    "swarm-pz": (swarm_pz, "10 against 10", "drone-steps", SIZES),
    "swarm-pz in JAX": (swarm_pz_in_jax, "10 against 10", "drone-steps", SIZES),
    "VMAS football": (partial(vmas, "football", **FOOTBALL), "10 against 10", "agent-steps", (64, 512, 2048)),
    "VMAS simple_tag": (partial(vmas, "simple_tag"), "3 against 1", "agent-steps", (512, 4096, 16384)),
    "MAgent2 battle": (magent_battle, "81 against 81", "agent-steps", (1,)),
    "JaxMARL MPE_simple_tag": (
        partial(jaxmarl, "MPE_simple_tag_v3"), "3 against 1", "agent-steps", (*SIZES, 16384)
    ),
    "JaxMARL SMAX": (partial(jaxmarl, "SMAX"), "5 against 5", "agent-steps", SIZES),
}  # fmt: skip
"""By name: a maker that takes numbers of games and threads, the teams, the unit, and numbers of games to try."""


def rate(step: Step, count: int) -> float:
    """Return the agent-steps per second."""
    began, calls = time.perf_counter(), 0
    while time.perf_counter() - began < SECONDS:
        step()
        calls += 1
    return count * calls / (time.perf_counter() - began)


def contend(name: str, threads: int) -> dict[str, Any]:
    """Return a simulator's best number of games, and its rates with it."""
    make, _, _, sizes = CONTENDERS[name]
    trials = []
    for games in sizes:
        step, count = make(games, threads)
        step()  # compiles
        trials.append((rate(step, count), games, step, count))
    _, best, step, count = max(trials, key=lambda entry: entry[0])
    return {"games": best, "rates": [rate(step, count) for _ in range(REPEATS)]}


def main() -> None:
    """Measure one simulator after the other, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--table", type=Path, default=Path("docs/tables/peers.csv"))
    parser.add_argument("--contend", choices=CONTENDERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.contend:
        print(MARK + json.dumps(contend(options.contend, options.threads)))
        return
    rows = [("simulator", "teams", "games at once", "million a second", "range", "counted")]
    for name, (_, teams, counted, _) in CONTENDERS.items():
        done = subprocess.run(  # noqa: S603  (this file)
            [sys.executable, "-m", "benchmarks.peers", "--contend", name, "--threads", str(options.threads)],
            stdout=subprocess.PIPE, text=True, check=False, env=os.environ | {"OMP_NUM_THREADS": str(options.threads)},
        )  # fmt: skip
        lines = [line.removeprefix(MARK) for line in done.stdout.splitlines() if line.startswith(MARK)]
        if not lines:
            print(f"{name} is left out: its process ended with {done.returncode}, see above")
            continue
        result = json.loads(lines[0])
        rates = [one / 1e6 for one in result["rates"]]
        middle, ends = f"{statistics.median(rates):.2f}", f"{min(rates):.2f} to {max(rates):.2f}"
        rows.append((name, teams, f"{result['games']:,}", middle, ends, counted))
        print(*rows[-1], sep="  ", flush=True)
    write_csv(options.table, rows)


if __name__ == "__main__":
    main()
