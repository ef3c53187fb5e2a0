"""Makes figures: their pictures, their numbers, and the page of all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.paper.claims import FIGURES
from benchmarks.paper.figure import Setting
from benchmarks.paper.page import draw, to_dict, write, write_page
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check_choice, check_count, check_number
from swarm_pz.errors import CommandError, Stopped, nearest
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.simulator.spawn import check_seed

BOTH = ("paper", "released")
"""The presets whose rules are those of the paper and those of its authors' code."""


class Made(NamedTuple):
    """A figure that was made under one preset: its verdict, and the seconds that it took."""

    name: str
    preset: str
    verdict: str
    seconds: float


def make(name: str, setting: Setting, out: Path, command: str = "") -> Made:
    """Make one figure under one preset: its pictures and NAME_PRESET.json in a folder."""
    figure, began = FIGURES[name], time.monotonic()
    record = to_dict(figure, figure.measure(setting), setting, command)
    draw(figure, record["series"], setting.preset, out)
    write(record, out)  # last: the page shows what has one
    return Made(name, setting.preset, record["verdict"], time.monotonic() - began)


def make_all(
    names: Sequence[str],
    out: Path,
    *,
    presets: Sequence[str] = BOTH,
    size: float = 1.0,
    seed: int = 0,
    processes: int = 2,
    done: Callable[[Made], None] = lambda _: None,
    command: str = "",
    should_stop: Callable[[], bool] = lambda: False,
) -> list[Made]:
    """Make figures, all if none are named, and figures.md of all that the folder holds.

    The same seed writes the same numbers. `done` is called with each figure once it is made, `should_stop` between
    figures: whether to stop there. `command` is what was called; it stands in the files.

    Raises
    ------
    Stopped
        If it was asked to; every figure that was begun is made, and on the page.
    CommandError
        If there is no figure of a name.
    ConfigError
        If a preset or a size is none.
    """
    check_count(processes, "processes", 1, 1024)
    check_number(size, "size", 0.01, 1.0)
    check_seed(seed)
    for preset in presets:
        check_choice(preset, "preset", BOTH)
    chosen = list(dict.fromkeys(names or FIGURES))
    for name in chosen:
        if name not in FIGURES:
            raise CommandError(f"there is no figure {name!r}; {nearest(name, FIGURES)}")
    chosen.sort(key=lambda name: -FIGURES[name].seconds)  # long ones first, so that no process works alone in the end
    tasks = [(name, Setting(preset, seed, size), out, command) for name in chosen for preset in presets]
    out.mkdir(parents=True, exist_ok=True)
    made: list[Made] = []

    def keep(_: object, result: Made) -> None:
        made.append(result)
        done(result)

    with open_pool(1 if len(tasks) == 1 else processes) as pool:
        if processes > 1 and len(tasks) > 1:  # two figures that find nothing compiled would both compile all of it
            share(pool, _compile, [(preset,) for preset in BOTH], lambda *_: None)
        share(pool, make, tasks, keep, should_stop=should_stop, name=lambda task: task[0], verb="made")
    write_page(out)
    if len(made) < len(tasks):
        raise Stopped(f"{len(made)} of {len(tasks)} figures are in {out}")
    return made


def _compile(preset: str) -> None:
    """Compile what games of a preset need, unless that has been done."""
    play_games("noise", "uniform", [0], seed=0, config=GameConfig.preset(preset).replace(time_limit=1.0))
