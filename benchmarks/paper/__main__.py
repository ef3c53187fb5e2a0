"""Plays the games behind the paper's claims and ours under both presets, draws them, and says how much is reproduced.

python -m benchmarks.paper                                   # all figures
python -m benchmarks.paper --only capture_geometry dropout   # these alone
python -m benchmarks.paper --size 0.1                        # a trial with a tenth of the games
"""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path

import tyro

from benchmarks.paper.making import BOTH, EVERY, Made, make_all
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
    """Make figures, and the pages figures.md (the paper's claims) and robustness.md (ours).

    Args:
        out: Folder to write: NAME_PRESET.json, pictures (.png; .pdf and .svg of one and two columns), and both pages.
        only: Names of figures to make; all of them if none.
        presets: Rules to make them under.
        size: Share of the games that are played; below 1 it is a trial, and the pages say so.
        processes: Processes that share the figures.
        seed: Seed of all games.
    """
    check_folder(out)
    names, began = list(dict.fromkeys(only or EVERY)), time.monotonic()
    made: list[Made] = []
    try:
        with progress("figures") as show, stops_at_safe_points() as should_stop:
            wanted = [(name, preset) for name in names if name in EVERY for preset in EVERY[name].presets]

            def done(one: Made) -> None:
                made.append(one)
                print(f"{one.name:<24} {one.preset:<10} {one.verdict:<16} {one.seconds:5.1f} s")
                show(len(made), sum(preset in presets for _, preset in wanted))

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
        left = [name for name in names if any((name, p) not in there for p in EVERY[name].presets if p in presets)]
        options = f"--out {shlex.quote(str(out))} --seed {seed} --processes {processes} --size {size:g}"
        with goes_on_with(f"{' '.join(COMMAND)} {options} --presets {' '.join(presets)} --only {' '.join(left)}"):
            raise
    print(f"{len(made)} figures; {time.monotonic() - began:.0f} s: {out / 'figures.md'}")


def main() -> None:
    """Run the command; errors of this project end it with one line."""
    try:
        tyro.cli(figures, prog=" ".join(COMMAND), description=f"Figures: {', '.join(EVERY)}.")
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
