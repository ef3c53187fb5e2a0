"""The command that makes the paper's evidence again: ``figures``."""

from __future__ import annotations

import shlex
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.report import arguments, command, print_rules, progress
from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.files import check_folder

if TYPE_CHECKING:
    from benchmarks.paper import Made


def figures(
    out: Path = Path("runs/figures"),
    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = (),
    processes: int = 2,
    seed: int = 0,
) -> None:
    """Play the games behind the paper's claims and ours, draw them, and say which claims hold.

    Args:
        out: Folder to write: NAME.png and NAME.json for each figure, and the pages index.md
            (the paper's claims) and ours.md (ours).
        only: Names of figures to make, all of them if none: capture_geometry, scale_invariance,
            permutation_invariance, ensemble_tactic, team_sizes, flocking_comparison, drawing_attention,
            adversary, bunching_up, wavefront, comebacks, fluctuation, communication, short_memory,
            relays, dropout.
        processes: Processes that share the figures.
        seed: Seed of all games.
    """
    for module in ("matplotlib.figure", "scipy.stats"):
        require_extra(module, "ladder")
    from benchmarks.paper import EVERY, make_all
    from benchmarks.paper.claims import PAGE

    check_folder(out)
    total, began = len(set(only)) or len(EVERY), time.monotonic()
    made: list[Made] = []
    try:
        with progress("figures") as show, stops_at_safe_points() as asked:

            def done(one: Made) -> None:
                made.append(one)
                verdict = "holds" if one.supported else "does not hold"
                print(f"{one.name:<24} {verdict:<14} {one.seconds:5.1f} s", flush=True)
                show(len(made), total)

            show(0, total)
            make_all(only, out, seed=seed, processes=processes, done=done, asked=asked, command=command())
    except KeyboardInterrupt:
        left = [name for name in dict.fromkeys(only or EVERY) if name not in {one.name for one in made}]
        with goes_on_with(_making(left)):
            raise
    print_rules(GameConfig(), "of the default game; those of each figure stand in its NAME.json")
    holding = sum(one.supported for one in made)
    print(f"{holding} of {len(made)} claims hold; {time.monotonic() - began:.0f} s: {out / PAGE.file}")


def _making(names: Sequence[str]) -> str:
    """Return the command being run, for figures of these names alone."""
    given, words = arguments.get(), []
    of_only = False
    for word in given:
        if word.startswith("-"):
            of_only = word == "--only" or word.startswith("--only=")
        if not of_only:
            words.append(word)
    return shlex.join(["swarm-pz", *words, "--only", *names])
