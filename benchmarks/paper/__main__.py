"""Plays the games behind the paper's claims and ours, draws them, and says which claims hold.

python -m benchmarks.paper                                   # all figures
python -m benchmarks.paper --only capture_geometry dropout   # these alone
"""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path

import tyro

from benchmarks.paper.making import EVERY, Made, make_all
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.report import progress
from swarm_pz.errors import SwarmError
from swarm_pz.files import check_folder

COMMAND = ("python", "-m", "benchmarks.paper")


def figures(out: Path = Path("runs/figures"), only: tuple[str, ...] = (), processes: int = 2, seed: int = 0) -> None:
    """Make figures, and the pages figures.md (the paper's claims) and robustness.md (ours).

    Args:
        out: Folder to write: NAME.png and NAME.json for each figure, and both pages.
        only: Names of figures to make; all of them if none.
        processes: Processes that share the figures.
        seed: Seed of all games.
    """
    check_folder(out)
    names, began = list(dict.fromkeys(only or EVERY)), time.monotonic()
    made: list[Made] = []
    try:
        with progress("figures") as show, stops_at_safe_points() as should_stop:

            def done(one: Made) -> None:
                made.append(one)
                print(f"{one.name:<24} {'holds' if one.supported else 'does not hold':<14} {one.seconds:5.1f} s")
                show(len(made), len(names))

            command = shlex.join([*COMMAND, *sys.argv[1:]])
            make_all(names, out, seed=seed, processes=processes, done=done, should_stop=should_stop, command=command)
    except KeyboardInterrupt:
        left = [name for name in names if name not in {one.name for one in made}]
        options = f"--out {shlex.quote(str(out))} --seed {seed} --processes {processes}"
        with goes_on_with(f"{' '.join(COMMAND)} {options} --only {' '.join(left)}"):
            raise
    holding = sum(one.supported for one in made)
    print(f"{holding} of {len(made)} claims hold; {time.monotonic() - began:.0f} s: {out / 'figures.md'}")


def main() -> None:
    """Run the command; errors of this project end it with one line."""
    try:
        tyro.cli(figures, prog=" ".join(COMMAND), description=f"Figures: {', '.join(EVERY)}.")
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
