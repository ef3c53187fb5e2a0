"""Whole games, bit for bit: alone and in a batch, on one thread and two, and from a snapshot.

python -m benchmarks.reproducibility
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator

# Without captures no game ends early, so that all of them run to the limit.
VARIANTS = {
    "with captures": GameConfig(),
    "without captures": GameConfig(capture=CaptureConfig(enabled=False)),
}


def play(simulator: Simulator, seeds: Sequence[int], start: int, stop: int) -> None:
    """Advance games from second `start` to `stop` under gentle random commands of their own."""
    for second in range(start, stop):
        commands = np.stack([1.0 - 0.3 * np.random.default_rng([seed, second]).random((2, 10, 10)) for seed in seeds])
        for team in range(2):
            simulator.command(team, commands[:, team])
        simulator.advance(30)


def differences(one: Simulator, row: int, other: Simulator, other_row: int) -> int:
    """Count arrays of two games that are not equal in every bit."""
    return sum(
        one_array[row].tobytes() != other_array[other_row].tobytes()
        for one_array, other_array in zip(one.games, other.games, strict=True)
    )


def main() -> None:
    """Play and compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=64)
    parser.add_argument("--seconds", type=int, default=300)
    options = parser.parse_args()
    seeds = list(range(options.games))
    for name, config in VARIANTS.items():
        batch = Simulator(config, options.games, threads=2)
        batch.reset(seeds)
        play(batch, seeds, 0, options.seconds)
        one_thread = Simulator(config, options.games, threads=1)
        one_thread.reset(seeds)
        play(one_thread, seeds, 0, options.seconds // 2)
        saved = one_thread.snapshot()
        play(one_thread, seeds, options.seconds // 2, options.seconds)
        continued = Simulator(config, options.games)
        continued.restore(saved)
        play(continued, seeds, options.seconds // 2, options.seconds)
        counts = {"alone": 0, "one thread": 0, "from a snapshot": 0}
        for row in seeds:
            alone = Simulator(config)
            alone.reset([row])
            play(alone, [row], 0, options.seconds)
            counts["alone"] += differences(batch, row, alone, 0)
            counts["one thread"] += differences(batch, row, one_thread, row)
            counts["from a snapshot"] += differences(batch, row, continued, row)
        lengths = batch.time_s
        print(
            f"{options.games} games {name}, {lengths.min():.0f} to {lengths.max():.0f} s, two threads; arrays that "
            f"differ: " + ", ".join(f"{what} {count}" for what, count in counts.items())
        )


if __name__ == "__main__":
    main()
