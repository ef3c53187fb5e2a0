"""How well the game can be played by who sees the simulator: the planner against everybody.

Three times: told the opponent's policy, guessing it from its commands, and taking it to keep its last one.

python -m benchmarks.planner --games 40 --out runs/planner
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies.planner import GUESS, Planner, PlannerConfig
from swarm_pz.policy import registered

KNOWLEDGE = ("told", GUESS, "none")


def play(pairing: tuple[str, str], games: int, drone_steps: int) -> dict[str, Any]:
    """Play a match against one opponent with one kind of knowledge."""
    opponent, knowledge = pairing
    config = GameConfig()
    model = {"told": opponent, GUESS: GUESS, "none": None}[knowledge]
    planner = Planner(config, model, PlannerConfig(drone_steps=drone_steps))
    summary = play_match(planner, policies.load(opponent, config), games=games, config=config).summary()
    return {"opponent": opponent, "knowledge": knowledge} | summary


def main() -> None:
    """Play, print a Markdown table and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=40)
    parser.add_argument("--drone-steps", type=int, default=PlannerConfig().drone_steps)
    parser.add_argument("--opponents", nargs="*", default=None, help="all scripts and learned tactics if none is given")
    parser.add_argument("--knowledge", nargs="*", default=KNOWLEDGE, choices=KNOWLEDGE, help="what the planner knows")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/planner"))
    options = parser.parse_args()
    names = options.opponents or sorted(
        n for n, point in registered().items() if point.module != "swarm_pz.policies.planner"
    )
    pairings = [(name, knowledge) for name in names for knowledge in options.knowledge]
    rows = []
    print("| opponent | planner knows | won | drawn | lost | median | mean, draws 300 s | ms a decision |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        for row in pool.map(partial(play, games=options.games, drone_steps=options.drone_steps), pairings):
            rows.append(row)
            median, mean = row["median_seconds"], row["restricted_mean_seconds"]
            print(
                f"| `{row['opponent']}` | {row['knowledge']} | {row['wins']} | {row['draws']} | {row['losses']} | "
                f"{median:.0f} s | {mean:.0f} s | {row['thinking_ms'][0]:.0f} |",
                flush=True,
            )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "figures.json").write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
