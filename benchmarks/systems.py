"""Speed of control systems: drone-steps per second of processor time, with the same system for both teams.

python -m benchmarks.systems
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.config.registry import registered
from swarm_pz.simulator import CheckedCommands, Simulator


def drone_steps(name: str, games: int, seconds: float, rounds: int = 5) -> float:
    """Return the median drone-steps per second of one thread, over rounds that take `seconds` in all."""
    # Without captures, games do not end, and all systems fly the same number of drones.
    config = GameConfig(controllers=name, capture=CaptureConfig(enabled=False))
    simulator = Simulator(config, num_games=games)
    simulator.reset(range(games))
    densities = np.random.default_rng(0).random((games, *(config.command_cells,) * 2)) ** 4
    for team in range(2):
        try:
            rows = np.arange(games)
            commands = simulator.control.read(densities, simulator.games, rows, team, "density", "densities")
        except ValueError:  # it takes no densities: its first command stays
            continue
        simulator.command(team, CheckedCommands(commands), rows)
    simulator.advance(30)  # compiles
    rates = []
    for _ in range(rounds):
        periods, began = 0, time.process_time()  # of this process alone: others may be busy
        while time.process_time() - began < seconds / rounds:
            simulator.advance(30)
            periods += 10
        rates.append(periods * games * config.num_drones / (time.process_time() - began))
    return statistics.median(rates)


def main() -> None:
    """Print a table for the documentation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--games", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=5.0, help="for each system")
    parser.add_argument("--systems", nargs="*", default=sorted(registered()))
    arguments = parser.parse_args()
    print(f"| system | drone-steps a second, {arguments.games} games of 10 v 10, one thread |")
    print("|---|---|")
    for name in arguments.systems:
        print(f"| `{name}` | {drone_steps(name, arguments.games, arguments.seconds) / 1e6:.2f} M |", flush=True)


if __name__ == "__main__":
    main()
