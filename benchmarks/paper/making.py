"""Makes figures: their pictures, their numbers, and the pages of all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.paper import claims, ours
from benchmarks.paper.figure import Figure
from benchmarks.paper.page import draw, to_dict, write, write_page
from swarm_pz.config import PRESETS, GameConfig
from swarm_pz.config.base import check_count
from swarm_pz.errors import CommandError, Stopped, nearest
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.simulator.spawn import check_seed

EVERY: dict[str, Figure] = claims.FIGURES | ours.FIGURES
"""All figures by name: the paper's claims, then what is ours."""


@dataclass(frozen=True)
class Made:
    """A figure that was made: its name, whether its claim holds, and the seconds that it took."""

    name: str
    supported: bool
    seconds: float


def make(name: str, seed: int, out: Path, command: str = "") -> Made:
    """Make one figure: NAME.png and NAME.json in a folder.

    Parameters
    ----------
    name : str
    seed : int
    out : Path
    command : str
        What was called; it stands in the file.

    Raises
    ------
    CommandError
        If there is no such figure.
    """
    figure = _find(name)
    began = time.monotonic()
    finding = figure.measure(seed)
    record = to_dict(figure, finding, seed, command)
    draw(figure, record["series"], out)
    write(record, out)  # last: the page shows what has one
    return Made(name, finding.supported, time.monotonic() - began)


def make_all(
    names: Sequence[str],
    out: Path,
    *,
    seed: int = 0,
    processes: int = 2,
    done: Callable[[Made], None] | None = None,
    command: str = "",
    should_stop: Callable[[], bool] = lambda: False,
) -> list[Made]:
    """Make figures, and two pages of all that the folder holds: figures.md (the paper's claims) and robustness.md.

    Parameters
    ----------
    names : sequence of str
        Figures to make; all of them if empty.
    out : Path
    seed : int
        All games follow from it; the same seed writes the same numbers.
    processes : int
        Processes that share the figures; with 1 they are made in this one.
    done : callable, optional
        Called with each figure as soon as it is made.
    command : str
        What was called; it stands in the files.
    should_stop : callable, optional
        Called between figures: whether to stop there.

    Raises
    ------
    Stopped
        If it was asked to; every figure that was begun is made, and on the page.
    CommandError
        If there is no figure of a name.
    """
    check_count(processes, "processes", 1, 1024)
    check_seed(seed)
    chosen = [_find(name) for name in dict.fromkeys(names or EVERY)]
    out.mkdir(parents=True, exist_ok=True)
    # Long ones first, so that no process works alone in the end.
    ordered = [figure.name for figure in sorted(chosen, key=lambda figure: -figure.seconds)]
    made: list[Made] = []

    def keep(result: Made) -> None:
        made.append(result)
        if done is not None:
            done(result)

    with open_pool(1 if len(ordered) == 1 else processes) as pool:
        if processes > 1 and len(ordered) > 1:  # two figures that find nothing compiled would both compile all of it
            share(pool, _compile, [(preset,) for preset in PRESETS], lambda *_: None)
        share(
            pool,
            make,
            [(name, seed, out, command) for name in ordered],
            lambda _, result: keep(result),
            should_stop=should_stop,
            name=lambda task: task[0],
            verb="made",
        )
    write_page(claims.PAGE, claims.FIGURES, out)
    write_page(ours.PAGE, ours.FIGURES, out)
    if len(made) < len(ordered):
        raise Stopped(f"{len(made)} of {len(ordered)} figures are in {out}")
    return made


def _compile(preset: str) -> None:
    """Compile what games of a preset need, unless that has been done."""
    play_games("noise", "uniform", [0], seed=0, config=GameConfig.preset(preset).replace(time_limit=1.0))


def _find(name: str) -> Figure:
    if name not in EVERY:
        raise CommandError(f"there is no figure {name!r}; {nearest(name, EVERY)}")
    return EVERY[name]
