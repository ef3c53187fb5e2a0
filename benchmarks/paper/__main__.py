"""Plays the games behind the paper's claims under both presets, draws them, and judges how much is reproduced.

python -m benchmarks.paper                                   # all figures
python -m benchmarks.paper --only capture_geometry comebacks  # these alone
python -m benchmarks.paper --size 0.1                        # a trial with a tenth of the games
"""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path

import tyro

from benchmarks.paper.claims import FIGURES
from benchmarks.paper.making import BOTH, Made, make_all
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.report import progress
from swarm_pz.errors import SwarmError
from swarm_pz.files import check_folder

COMMAND = ("python", "-m", "benchmarks.paper")


def figures(
    out: Path = Path("runs/figures"),
    only: tuple[str, ...] = (),
    presets: tuple[str, ...] = BOTH,
    size: float = 1.0,
    processes: int = 2,
    seed: int = 0,
) -> None:
    """Make figures, and the page figures.md of all that the folder holds.

    Args:
        out: Folder to write: NAME_PRESET.json, pictures (.png; .pdf and .svg of one and two columns), page and tables.
        only: Names of figures to make; all of them if none.
        presets: Rules to make them under.
        size: Share of the games that are played; below 1 it is a trial, and the pages say so.
        processes: Processes that share the figures.
        seed: Seed of all games.
    """
    check_folder(out)
    names, began = list(dict.fromkeys(only or FIGURES)), time.monotonic()
    made: list[Made] = []
    try:
        with progress("figures") as show, stops_at_safe_points() as should_stop:

            def done(one: Made) -> None:
                made.append(one)
                print(f"{one.name:<24} {one.preset:<10} {one.verdict:<16} {one.seconds:5.1f} s")
                show(len(made), len(names) * len(presets))

            command = shlex.join([*COMMAND, *sys.argv[1:]])
            make_all(
                names,
                out,
                presets=presets,
                size=size,
                seed=seed,
                processes=processes,
                done=done,
                should_stop=should_stop,
                command=command,
            )
    except KeyboardInterrupt:
        there = {(one.name, one.preset) for one in made}
        left = [name for name in names if any((name, preset) not in there for preset in presets)]
        options = f"--out {shlex.quote(str(out))} --seed {seed} --processes {processes} --size {size:g}"
        with goes_on_with(f"{' '.join(COMMAND)} {options} --presets {' '.join(presets)} --only {' '.join(left)}"):
            raise
    print(f"{len(made)} figures; {time.monotonic() - began:.0f} s: {out / 'figures.md'}")


def main() -> None:
    """Run the command; errors of this project end it with one line."""
    try:
        tyro.cli(figures, prog=" ".join(COMMAND), description=f"Figures: {', '.join(FIGURES)}.")
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
