"""How the wins of ring and noise against uniform coverage move with the numbers of the rules.

python -m benchmarks.sensitivity --games 40
"""

from __future__ import annotations

import argparse

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig, MemoryConfig
from swarm_pz.evaluation.match import play_match

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
}


def main() -> None:
    """Print wins, draws, losses, share and restricted mean length of each variant."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=40)
    games = parser.parse_args().games
    print(f"against uniform, {games} games each: won-drawn-lost, share, restricted mean s")
    for name, config in VARIANTS.items():
        cells = []
        for policy in ("ring", "noise", "uniform"):
            summary = play_match(policy, "uniform", games=games, config=config, threads=2).summary()
            record = f"{summary['wins']}-{summary['draws']}-{summary['losses']}"
            cells.append(
                f"{policy} {record:>8} {summary['mean_share']:.2f} {summary['restricted_mean_seconds']:4.0f} s"
            )
        print(f"{name:>15}: " + "   ".join(cells), flush=True)


if __name__ == "__main__":
    main()
