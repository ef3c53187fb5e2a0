"""Effects of the rules' numbers on a game's start, and on games of ring, noise and uniform against uniform coverage.

python -m benchmarks.sensitivity --games 40
python -m benchmarks.sensitivity --games 100 --variants "the rules" "teams apart"
"""

from __future__ import annotations

import argparse

import numpy as np

from swarm_pz.config import TICKS_PER_SECOND, CaptureConfig, ControllerConfig, GameConfig, MemoryConfig, SpawnConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.simulator import Simulator

VARIANTS: dict[str, GameConfig] = {
    "the rules": GameConfig(),
    "tau 1 s": GameConfig(memory=MemoryConfig(controller=1.0)),
    "tau 2 s": GameConfig(memory=MemoryConfig(controller=2.0)),
    "tau 8 s": GameConfig(memory=MemoryConfig(controller=8.0)),
    "tau 30 s": GameConfig(memory=MemoryConfig(controller=30.0)),
    "q 50": GameConfig(controller=ControllerConfig(ergodic_weight=50.0)),
    "q 800": GameConfig(controller=ControllerConfig(ergodic_weight=800.0)),
    "R 0.025": GameConfig(controller=ControllerConfig(control_weight=0.025)),
    "R 0.4": GameConfig(controller=ControllerConfig(control_weight=0.4)),
    "trail 2 s": GameConfig(memory=MemoryConfig(trail=2.0)),
    "trail 10 s": GameConfig(memory=MemoryConfig(trail=10.0)),
    "trail 30 s": GameConfig(memory=MemoryConfig(trail=30.0)),
    "threshold 0.5": GameConfig(capture=CaptureConfig(threshold=0.5)),
    "threshold 0.6": GameConfig(capture=CaptureConfig(threshold=0.6)),
    "threshold 0.85": GameConfig(capture=CaptureConfig(threshold=0.85)),
    "teams apart": GameConfig(spawn=SpawnConfig(layout="squares")),
}
NEAR, STARTS = 0.1, 1000
"""Distance in map widths within which an opponent is near; number of games whose first second is played."""


def opening(config: GameConfig) -> tuple[float, float]:
    """Return the share of drones that start near an opponent, and the mean captures in 1 s without commands."""
    simulator = Simulator(config, num_games=STARTS)
    simulator.reset(range(STARTS))
    places, teams = simulator.positions.astype(float), simulator.teams
    apart = np.linalg.norm(places[:, :, None] - places[:, None], axis=3)
    opponents = teams[:, :, None] != teams[:, None]
    near = ((apart <= NEAR) & opponents).any(axis=2)
    simulator.advance(TICKS_PER_SECOND)
    return float(near.mean()), float(simulator.games.captures.sum() / STARTS)


def main() -> None:
    """Print the start, and wins, draws, losses, share and restricted mean length of each variant."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=40)
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS), metavar="NAME")
    options = parser.parse_args()
    games = options.games
    print(
        f"start: drones within {NEAR} of an opponent, captures in the first second with nothing sent ({STARTS} games)"
    )
    print(f"against uniform, {games} games each: won-drawn-lost, share, restricted mean s")
    for name in options.variants:
        config = VARIANTS[name]
        near, captures = opening(config)
        cells = [f"start {near:4.0%} {captures:4.1f}"]
        for policy in ("ring", "noise", "uniform"):
            summary = play_match(policy, "uniform", games=games, config=config, threads=2).summary()
            record = f"{summary['wins']}-{summary['draws']}-{summary['losses']}"
            cells.append(
                f"{policy} {record:>8} {summary['mean_share']:.2f} {summary['restricted_mean_seconds']:4.0f} s"
            )
        print(f"{name:>15}: " + "   ".join(cells), flush=True)


if __name__ == "__main__":
    main()
