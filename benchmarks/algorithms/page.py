"""The page about the comparison, and its picture, from the lines of the runs."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.algorithms.methods import METHODS
from benchmarks.algorithms.runs import COMMAND, SCRIPTS, SEED, Budget, Line
from benchmarks.csv_table import write_csv
from benchmarks.paper import style
from benchmarks.paper.curves import COLOURS, DASHES
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import middle
from swarm_pz.files import draft_of
from swarm_pz.standard.aggregate import drawn_runs, interquartile_mean, resampled

PAGE, PICTURE, TABLE = "algorithms.md", "images/algorithms.png", "tables/algorithms.csv"
OPPONENTS = ("uniform", *SCRIPTS)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """An interquartile mean over seeds and opponents, and the ends of its 95 % interval."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, scores: Array) -> Estimate:
        """Return that of scores (seeds, opponents)."""
        low, high = middle(interquartile_mean(resampled(functools.partial(drawn_runs, scores))))
        return cls(float(interquartile_mean(scores)), float(low), float(high))

    def __str__(self) -> str:
        return f"{self.value:.2f} ({self.low:.2f} to {self.high:.2f})"

    def overlaps(self, other: Estimate) -> bool:
        """Tell whether the intervals have a number in common."""
        return self.low <= other.high and other.low <= self.high


class Row:
    """A method's runs, and what they say."""

    def __init__(self, method: str, lines: Sequence[Line]) -> None:
        self.method = method
        self.lines = sorted(lines, key=lambda line: int(line["seed"]))
        scores = np.array([[line["final"][name]["score"] for name in OPPONENTS] for line in self.lines])
        self.all, self.uniform, self.scripts = (Estimate.of(part) for part in (scores, scores[:, :1], scores[:, 1:]))
        self.seconds = float(np.mean([line["seconds"] for line in self.lines]))
        self.busy = float(np.mean([line["processor_seconds"] for line in self.lines]))
        self.commands = int(self.lines[0]["curve"][-1]["commands"])
        self.ms = float(np.median([line["final"][name]["ms"] for line in self.lines for name in OPPONENTS]))
        self.weights = int(self.lines[0]["weights"])

    def cells(self) -> tuple[str, ...]:
        """Return the row of the table of all numbers."""
        rate = f"{self.commands / self.busy:.0f}"
        costs = (f"{self.seconds:.0f}", f"{self.busy:.0f}", rate, str(self.weights), f"{self.ms:.2f}")
        return self.method, str(self.all), str(self.uniform), str(self.scripts), *costs

    def curve(self, opponents: Sequence[str]) -> dict[str, list[float]]:
        """Return the estimates against some opponents at each point of the budget, as `style.band` takes them."""
        points: list[Array] = [
            np.array([[point["scores"][name] for name in opponents] for point in at])
            for at in zip(*(line["curve"] for line in self.lines), strict=True)
        ]
        found = [Estimate.of(scores) for scores in points]
        return {"mean": [e.value for e in found], "low": [e.low for e in found], "high": [e.high for e in found]}


def rows_of(lines: Sequence[Line]) -> list[Row]:
    """Return the methods that have runs, best first."""
    rows = [Row(name, own) for name in METHODS if (own := [line for line in lines if line["method"] == name])]
    return sorted(rows, key=lambda row: -row.all.value)


def verdict(rows: Sequence[Row]) -> str:
    """Say which method wins, and from which it cannot be told."""
    best, *others = rows
    beside = [f"`{row.method}`" for row in others if row.all.overlaps(best.all)]
    told = "no other interval overlaps its own"
    if beside:
        which = f"interval of {beside[0]} overlaps" if len(beside) == 1 else f"intervals of {', '.join(beside)} overlap"
        told = f"the {which} its own, so this does not decide which is better"
    join = "but" if beside else "and"
    return f"`{best.method}` wins most games, {best.all}, {join} {told}."


def write_page(lines: Sequence[Line], budget: Budget, docs: Path) -> Path:
    """Write page and picture into a folder of docs; return the page's path."""
    rows = rows_of(lines)
    draw(rows, docs / PICTURE)
    head = ("method", "all", "uniform", "scripts", "wall s", "processor s", "commands a second", "weights",
            "ms a command")  # fmt: skip
    write_csv(docs / TABLE, [head, *(row.cells() for row in rows)])
    with draft_of(docs / PAGE) as draft:
        draft.write_text(to_markdown(rows, budget))
    return docs / PAGE


def to_markdown(rows: Sequence[Row], budget: Budget) -> str:
    """Return the page."""
    lines = [line for row in rows for line in row.lines]
    seeds = min(len(row.lines) for row in rows)
    small = budget.commands < Budget().commands or seeds < 3
    versions = {f"{name} {version}" for line in lines for name, version in line["versions"].items()}
    machines = sorted({line["processor"] for line in lines})
    parts = [
        "# Algorithms compared",
        f"{len(METHODS)} learning methods with {budget.commands:,} commands and {seeds} seeds each, in the same games:",
        f"```bash\n{COMMAND} --page docs\n```",
        "**Few commands or seeds: this page only shows that everything works.**"
        if small
        else f"**Which wins:** {verdict(rows)}",
        f"![Share of games won against uniform and against scripts, by commands]({PICTURE})",
        f"*Learning curves: {budget.points} evaluations of each run, each of {budget.games_on_the_way} games against "
        "`uniform` and as many against the scripts. Lines are interquartile means, bands 95 % intervals.*",
        "| method | what it is | games won |\n|---|---|---|\n"
        + "\n".join(f"| `{row.method}` | {METHODS[row.method].about} | {row.all} |" for row in rows),
        f"After training, each run plays {budget.games} games against `uniform` and {budget.games // len(SCRIPTS)} "
        f"against each of {', '.join(f'`{name}`' for name in SCRIPTS)} (seed {SEED}). A draw is not won. Numbers are "
        "interquartile means over seeds and these opponents, with intervals as in [the benchmark](benchmark.md). With "
        f"few seeds they may be too narrow. [All numbers and costs]({TABLE}); times are of one core "
        f"({', '.join(machines)}).",
        "Except for self-play, opponents are those of [the recipe](training.md#the-recipe), and so are observations "
        "(`ppo-sets`: lists of drones), actions (`dqn`: named commands) and settings. All games begin anew after an "
        "evaluation. Nothing was tuned for this page. The recipe was chosen for the network of `ppo`, so other methods "
        "may improve with tuning.",
        "Each run leaves a [policy](policies.md) in `runs/algorithms`. Those of a method, here `ppo`, enter [the "
        "board](board/entries) with",
        f"```bash\nscripts/board add ppo {' '.join(f'runs/algorithms/ppo-{seed}' for seed in range(seeds))} "
        '--by "YOUR NAME"\n```',
        f"Made with {', '.join(sorted(versions))}.",
    ]
    return "\n\n".join(parts) + "\n"


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the learning curves; a method has its line whatever its rank."""
    looks = dict(zip(METHODS, zip(COLOURS, DASHES, strict=True), strict=True))
    with require_extra("matplotlib", "cli").rc_context(style.RC):
        figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(9, 4), layout="constrained")
        sides = (("against uniform coverage", OPPONENTS[:1]), ("against five scripts", SCRIPTS))
        for axes, (title, opponents) in zip(figure.subplots(1, 2, sharey=True), sides, strict=True):
            for row in rows:
                commands = [point["commands"] / 1000 for point in row.lines[0]["curve"]]
                style.band(axes, commands, row.curve(opponents), *looks[row.method], label=row.method)
            axes.set(title=title, xlabel="commands learned from (thousands)", ylim=(0, 1), xlim=(0, None))
        figure.axes[0].set_ylabel("share of games won")
        style.legend_below(figure, figure.axes[0], columns=6)
        with draft_of(path) as draft:
            figure.savefig(draft, format="png")
