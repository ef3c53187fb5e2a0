"""Six ways to learn, one budget: who wins what after as many commands, with intervals over seeds, and at what cost.

    python -m benchmarks.algorithms                # trains, rates, and writes runs/algorithms
    python -m benchmarks.algorithms --page docs    # the same, and the page with its picture
    python -m benchmarks.algorithms --commands 2048 --games 50 --seeds 1 --out runs/try    # whether all of it works

A run that has ended is kept, whatever happens later; one that was interrupted begins anew, and is then the run that
was not: everything follows from its seed. The folder holds `runs.jsonl`, a line for each run, and `release`, the
policies by name with their digests (`sha256sum --check SHA256SUMS`).
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from benchmarks.algorithms.methods import METHODS, RECIPE
from benchmarks.algorithms.page import write_page
from benchmarks.algorithms.runs import UPDATE, Budget, digests, run
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check_count
from swarm_pz.errors import ResultsError, SwarmError
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.files import draft_of

LINES, SETTINGS, RELEASE, SUMS = "runs.jsonl", "settings.json", "release", "SHA256SUMS"

Line = dict[str, Any]
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


class Folder:
    """The runs of a folder that have ended, whose policies are as they were written."""

    def __init__(self, path: Path) -> None:
        self.path = path
        text = (path / LINES).read_text() if (path / LINES).exists() else ""
        self.lines = [line for line in map(json.loads, text.splitlines()) if self._is_whole(line)]

    def policy(self, method: str, seed: int) -> Path:
        """Return where a run's policy is."""
        return self.path / RELEASE / f"{method}-{seed}"

    def _is_whole(self, line: Line) -> bool:
        return digests(self.policy(line["method"], line["seed"])) == line["sha256"]

    def left(self, seeds: int, budget: Budget) -> list[Task]:
        """Return the runs that have not ended."""
        ended = {(line["method"], line["seed"]) for line in self.lines}
        wanted = [(method, seed) for method in METHODS for seed in range(seeds)]
        return [(*one, budget, self.policy(*one)) for one in wanted if one not in ended]

    def keep(self, line: Line) -> None:
        """Add a run that has ended: all lines are there, or those of before."""
        self.lines.append(line)
        with draft_of(self.path / LINES) as draft:
            draft.write_text("".join(f"{json.dumps(one)}\n" for one in self.lines))
        with draft_of(self.path / RELEASE / SUMS) as draft:
            draft.write_text("".join(
                f"{digest}  {one['method']}-{one['seed']}/{name}\n"
                for one in sorted(self.lines, key=lambda one: (one["method"], one["seed"]))
                for name, digest in one["sha256"].items()
            ))  # fmt: skip


def compare(folder: Path, budget: Budget, seeds: int, processes: int) -> list[Line]:
    """Do the runs of a folder that have not ended, and return the lines of all."""
    with folder_lock(folder):
        check_settings(folder, settings_of(budget))
        runs = Folder(folder)
        left = runs.left(seeds, budget)
        print(f"{len(runs.lines)} runs have ended in {folder}, {len(left)} are left", flush=True)

        def keep(task: Task, line: Line) -> None:
            runs.keep(line)
            score = line["final"]["uniform"]["score"]
            print(f"{task[0]}-{task[1]} has ended: points {score:.2f} against uniform; {len(runs.lines)} are kept")

        with open_pool(processes) as pool:
            share(pool, run, left, keep, name=lambda task: f"{task[0]}-{task[1]}", verb="trained")
        return runs.lines


def main() -> None:
    """Train what is left, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=Budget().commands, help="that each run learns from")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each method; more can be added later")
    parser.add_argument("--games", type=int, default=Budget().games, help="after the last command; fewer on the way")
    parser.add_argument("--processes", type=int, default=2, help="runs at a time")
    parser.add_argument("--out", type=Path, default=Path("runs/algorithms"), help="folder of lines and policies")
    parser.add_argument("--page", type=Path, help="folder of docs, in which algorithms.md and its picture are written")
    options = parser.parse_args()
    try:
        check_count(options.seeds, "--seeds", 1, 1000)
        points = max(1, min(Budget().points, options.commands // UPDATE))
        budget = Budget(commands=options.commands, points=points, games=options.games)
        lines = compare(options.out, budget, options.seeds, options.processes)
        if options.page:
            print(f"{write_page(lines, budget, options.page)} is written")
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
