"""Plays the games behind the paper's claims under both presets, draws them, and judges them.

python -m benchmarks.paper                                     # all figures
python -m benchmarks.paper --only capture_geometry comebacks   # two of them
python -m benchmarks.paper --size 0.1                          # a trial with a tenth of the games
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.paper.claims import FIGURES
from benchmarks.paper.figure import PRESETS, Setting
from benchmarks.paper.page import make, write_page
from swarm_pz.evaluation.workers import open_pool, share


def main(arguments: Sequence[str] | None = None) -> None:
    """Make figures, and the page and tables of all figures in the folder; the same seed gives the same numbers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("runs/figures"))
    parser.add_argument("--only", nargs="*", choices=tuple(FIGURES), default=[])
    parser.add_argument("--presets", nargs="*", choices=PRESETS, default=PRESETS)
    parser.add_argument("--size", type=float, default=1.0, help="share of the games; below 1 the page says so")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    options.out.mkdir(parents=True, exist_ok=True)
    command = shlex.join(["python", "-m", "benchmarks.paper", *(sys.argv[1:] if arguments is None else arguments)])
    settings = [Setting(preset, options.seed, options.size) for preset in options.presets]
    tasks = [(name, setting, options.out, command) for name in options.only or FIGURES for setting in settings]
    with open_pool(options.processes) as pool:
        share(pool, make, tasks, lambda _, line: print(line, flush=True), name=lambda task: task[0], verb="made")
    write_page(options.out)


if __name__ == "__main__":
    main()
