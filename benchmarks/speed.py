"""Drone-steps a second of the bare simulator, beside VMAS's football of the same size.

A drone-step is one drone for one control period of 0.1 s, which holds an optimal-control solve and
three ticks of physics and rules; an agent-step of VMAS is one agent for one step of its physics.
VMAS is optional: ``pip install -r benchmarks/requirements.txt``.

    python -m benchmarks.speed
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

import numpy as np

from swarm_pz.simulator import Simulator

SECONDS = 10


def ours(num_games: int, threads: int) -> Callable[[], float]:
    """Return a function that plays 10 s of game with random commands and returns drone-steps/s."""
    simulator = Simulator(num_games=num_games, threads=threads)
    commands = np.random.default_rng(0).random((SECONDS, 2, num_games, 10, 10))

    def run() -> float:
        simulator.reset(range(num_games))
        began = time.perf_counter()
        for red, blue in commands:
            simulator.command(0, red)
            simulator.command(1, blue)
            simulator.advance(30)
        spent = time.perf_counter() - began
        return float(simulator.games.ticks.sum() / 3 * simulator.config.num_drones / spent)

    run()
    return run


def vmas_football(num_games: int, threads: int) -> Callable[[], float]:
    """Return a function that steps 10-against-10 football with random actions; agent-steps/s."""
    import torch
    import vmas

    torch.set_num_threads(threads)
    env = vmas.make_env(
        scenario="football",
        num_envs=num_games,
        device="cpu",
        continuous_actions=True,
        seed=0,
        n_blue_agents=10,
        n_red_agents=10,
        ai_red_agents=False,
        ai_blue_agents=False,
    )
    steps = 10
    actions = [[env.get_random_action(agent) for agent in env.agents] for _ in range(steps)]

    def run() -> float:
        env.reset()
        began = time.perf_counter()
        for action in actions:
            env.step(action)
        return num_games * 20 * steps / (time.perf_counter() - began)

    run()
    return run


def main() -> None:
    """Interleave the runs and print medians and ranges."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    runs = {
        "swarm-pz, 64 games, 1 thread (drone-steps/s)": ours(64, 1),
        "swarm-pz, 64 games, 2 threads (drone-steps/s)": ours(64, 2),
    }
    try:
        for games in (64, 512):
            runs[f"VMAS football 10v10, {games} games, 1 thread (agent-steps/s)"] = vmas_football(games, 1)
    except ImportError:
        print("VMAS is not installed; it is left out")
    rates: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, run in runs.items():
            rates[name].append(run())
    for name, values in rates.items():
        median = statistics.median(values)
        print(f"{name:<62} median {median / 1e6:6.3f} M   range {min(values) / 1e6:.3f} to {max(values) / 1e6:.3f} M")


if __name__ == "__main__":
    main()
