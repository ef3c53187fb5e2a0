"""How well the controller covers its target, and what other numbers of the rules would cost.

python -m benchmarks.convergence                # the rules: the metric over time
python -m benchmarks.convergence --candidates   # docs/tables/convergence_tries.csv, as far as rules go
python -m benchmarks.convergence --candidates "the rules" --games 400 --seed 1
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import JUDGED, TARGETS, lone_team, start
from swarm_pz.config import ControllerConfig, GameConfig, MemoryConfig
from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.evaluation.match import play_match
from swarm_pz.simulator.ergodicity import ErgodicMetric

SIZES = (6, 12, 24)
TIMES = (1, 10, 30, 60)
AIM = 0.0005
"""What the worst of the nine means should not exceed, at the balance of the rules."""
CANDIDATES: dict[str, GameConfig] = {
    "the rules": GameConfig(),
    **{f"tau {tau:g}": GameConfig(memory=MemoryConfig(controller=tau)) for tau in (6.5, 8.0)},
    **{f"q {q:g}": GameConfig(controller=ControllerConfig(ergodic_weight=q)) for q in (50.0, 800.0, 5000.0)},
    "R 0.4": GameConfig(controller=ControllerConfig(control_weight=0.4)),
    "H 7": GameConfig(controller=ControllerConfig(horizon=7)),
    "wall weight 10": GameConfig(controller=ControllerConfig(wall_weight=10.0)),
    **{f"wall margin {m:g}": GameConfig(controller=ControllerConfig(wall_margin=m)) for m in (0.0, 0.02)},
}
"""What was tried and is a number of the rules; the page says the rest in formulas."""
PLAYERS = ("ring", "noise", "restless", "uniform")
"""Who plays against `uniform`: the balance is noise <= uniform < ring, restless <= uniform + 0.02, and ring's wins."""


def ergodic_metric(
    size: int, command: NDArray[np.float64], config: GameConfig, seeds: int, times: tuple[int, ...] = TIMES
) -> NDArray[np.float64]:
    """Return the metric (seeds, times) of a lone team from the corners, over all ticks since the start."""
    simulator = start(lone_team(size, config), range(seeds), command)
    past = ErgodicMetric(simulator, team=0)
    metric = []
    for tick in range(1, 30 * max(times) + 1):
        simulator.advance(1)
        past.observe()
        if tick in {30 * seconds for seconds in times}:
            metric.append(past.value())
    return np.stack(metric, axis=1)


def print_rules(seeds: int) -> None:
    """Print means over seeds at several times."""
    print(f"mean ergodic metric over {seeds} seeds; at 30 s every one should be at most 0.001")
    print(f"{'target':>8} {'drones':>6} " + " ".join(f"{f'{time} s':>9}" for time in TIMES) + "   worst seed at 30 s")
    for name, command in TARGETS.items():
        for size in SIZES:
            metric = ergodic_metric(size, command, GameConfig(), seeds)
            row = " ".join(f"{value:9.5f}" for value in metric.mean(axis=0))
            print(f"{name:>8} {size:>6} {row}   {metric[:, TIMES.index(30)].max():9.5f}", flush=True)


def worst_of_nine(config: GameConfig, seeds: int) -> tuple[str, float, float, float]:
    """Return where the mean metric is worst, that mean and the ends of its 95 % interval over seeds."""
    metric = {
        f"{target}, {size}": ergodic_metric(size, command, config, seeds, (JUDGED,))[:, 0]
        for target, command in TARGETS.items()
        for size in SIZES
    }
    worst = max(metric, key=lambda name: float(metric[name].mean()))
    mean, low, high = (float(value[0]) for value in bootstrap(metric[worst][:, None]))
    return worst, mean, low, high


def wins(player: str, config: GameConfig, games: int, seed: int) -> str:
    """Return the win rate of a player against `uniform` with its 95 % interval, in percent, and the draws."""
    summary = play_match(player, "uniform", games=games, seed=seed, config=config, threads=2).summary()
    low, high = summary["win_rate_ci95"]
    drawn = summary["draws"] / summary["games"]
    return f"{100 * summary['win_rate']:3.0f} ({100 * low:.0f} to {100 * high:.0f}), {100 * drawn:.0f} drawn"


def print_candidates(names: list[str], seeds: int, games: int, seed: int) -> None:
    """Print the worst of nine metrics, and who wins how often against `uniform`, for each candidate."""
    print(f"metric after {JUDGED} s in 1e-4, {seeds} seeds, aim {1e4 * AIM:g}; % won of {games} games against uniform")
    for name in names:
        config = CANDIDATES[name]
        worst, mean, low, high = worst_of_nine(config, seeds)
        cells = [f"{1e4 * mean:6.2f} ({1e4 * low:.2f} to {1e4 * high:.2f}) {worst}"]
        if games:
            cells += [f"{player} {wins(player, config, games, seed)}" for player in PLAYERS]
        print(f"{name:>16}: " + " | ".join(cells), flush=True)


def main() -> None:
    """Print one of the two tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument(
        "--candidates", nargs="*", choices=CANDIDATES, metavar="NAME", help="these, or all: the metric, and games"
    )
    parser.add_argument("--games", type=int, default=100, help="of each player with each candidate; 0: none")
    parser.add_argument("--seed", type=int, default=0, help="of the games")
    given = parser.parse_args()
    if given.candidates is None:
        print_rules(given.seeds)
    else:
        print_candidates(given.candidates or list(CANDIDATES), given.seeds, given.games, given.seed)


if __name__ == "__main__":
    main()
