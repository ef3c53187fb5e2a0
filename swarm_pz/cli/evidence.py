"""The command that makes the paper's evidence again: ``figures``."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from swarm_pz.cli.report import command, print_rules, progress
from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra

if TYPE_CHECKING:
    from swarm_pz.figures import Made


def figures(
    out: Path = Path("runs/figures"),
    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = (),
    processes: int = 2,
    seed: int = 0,
) -> None:
    """Play the games behind the paper's claims, draw them, and say which claims hold.

    Args:
        out: Folder to write: NAME.png and NAME.json for each figure, and a page index.md.
        only: Names of figures to make; all of them if none.
        processes: Processes that share the figures.
        seed: Seed of all games.
    """
    for module in ("matplotlib.figure", "scipy.stats"):
        require_extra(module, "ladder")
    from swarm_pz.figures import FIGURES, make_all
    from swarm_pz.figures.page import PAGE

    total, began = len(set(only)) or len(FIGURES), time.monotonic()
    made: list[Made] = []
    with progress("figures") as show:

        def done(one: Made) -> None:
            made.append(one)
            verdict = "holds" if one.supported else "does not hold"
            print(f"{one.name:<24} {verdict:<14} {one.seconds:5.1f} s", flush=True)
            show(len(made), total)

        show(0, total)
        make_all(only, out, seed=seed, processes=processes, done=done, command=command())
    print_rules(GameConfig(), "of the default game; those of each figure stand in its NAME.json")
    holding = sum(one.supported for one in made)
    print(f"{holding} of {len(made)} claims hold; {time.monotonic() - began:.0f} s: {out / PAGE}")
