"""Six ways to learn, one budget: who wins what after as many commands, with intervals over seeds, and at what cost.

    python -m benchmarks.algorithms --page docs    # trains, evaluates, writes runs/algorithms and the page
    python -m benchmarks.algorithms --commands 20480 --games 50 --seeds 1 --out runs/try    # whether all of it works

Stop it as you like: the same command goes on after the last evaluation of each run, and gives what an uninterrupted
one does. The folder of a run, METHOD-SEED, is a policy; `work` holds its figures.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from pathlib import Path
from typing import Any

from benchmarks.algorithms.methods import METHODS, RECIPE
from benchmarks.algorithms.page import write_page
from benchmarks.algorithms.runs import COMMAND, UPDATE, Budget, Line, run
from swarm_pz.cli.interruption import goes_on_with
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check_count
from swarm_pz.errors import ResultsError, SwarmError
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.files import draft_of

SETTINGS = "settings.json"

Task = tuple[str, int, Budget, Path]


def settings_of(budget: Budget) -> dict[str, Any]:
    """Return what all runs of a folder share."""
    return {"budget": budget.to_dict(), "recipe": RECIPE.hash, "rules": GameConfig().rules_hash}


def check_settings(folder: Path, settings: dict[str, Any]) -> None:
    """Take a folder for runs of some settings."""
    path = folder / SETTINGS
    if not path.exists():
        with draft_of(path) as draft:
            draft.write_text(json.dumps(settings, indent=2) + "\n")
    elif (found := json.loads(path.read_text())) != settings:
        wrong = [f"{key} {settings[key]}, got {found.get(key)}" for key in settings if found.get(key) != settings[key]]
        raise ResultsError(
            f"{folder} holds runs that do not compare with these: expected {'; '.join(wrong)}; give their --commands "
            "and --games, or another --out"
        )


def compare(folder: Path, budget: Budget, seeds: int, processes: int) -> list[Line]:
    """Do what is left of the runs of a folder, and return the lines of all."""
    lines: list[Line] = []

    def keep(task: Task, line: Line) -> None:
        lines.append(line)
        won = line["final"]["uniform"]["score"]
        print(f"{task[0]}-{task[1]} has ended: won {won:.0%} against uniform", flush=True)

    with folder_lock(folder):
        check_settings(folder, settings_of(budget))
        tasks = [(method, seed, budget, folder) for method in METHODS for seed in range(seeds)]
        with open_pool(processes) as pool:
            share(pool, run, tasks, keep, name=lambda task: f"{task[0]}-{task[1]}", verb="trained")
    return lines


def main() -> None:
    """Train what is left, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=Budget().commands, help="that each run learns from")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each method; more can be added later")
    parser.add_argument("--games", type=int, default=Budget().games, help="after the last command; fewer on the way")
    parser.add_argument("--processes", type=int, default=2, help="runs at a time")
    parser.add_argument("--out", type=Path, default=Path("runs/algorithms"), help="folder of policies")
    parser.add_argument("--page", type=Path, help="folder of docs, in which algorithms.md and its picture are written")
    options = parser.parse_args()
    try:
        check_count(options.seeds, "--seeds", 1, 1000)
        points = max(1, min(Budget().points, options.commands // UPDATE))
        budget = Budget(commands=options.commands, points=points, games=options.games)
        with goes_on_with(f"{COMMAND} {shlex.join(sys.argv[1:])}"):
            lines = compare(options.out, budget, options.seeds, options.processes)
        if options.page:
            print(f"{write_page(lines, budget, options.page)} is written")
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
