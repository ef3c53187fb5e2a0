"""The page of the ladder of systems: tables in Markdown, and two pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.paper.style import DASHES, DPI, RC
from benchmarks.systems_ladder.contest import TRAINED, system_name
from benchmarks.systems_ladder.traits import LOSS, LOST, REACHED, SIZES, TALK
from swarm_pz.errors import require_extra
from swarm_pz.files import draft_of

_COLOURS = [f"tab:{name}" for name in ("blue", "orange", "green", "red", "purple", "brown", "pink", "olive", "cyan")]
_CHANGES = {
    "size": f"{SIZES[-1]} drones, not {SIZES[0]}",
    "permutation": "drones in another order",
    "captured": f"{100 * LOST:g} % captured",
    "leader": "leader captured",
    "talk": f"heard within {TALK:g}",
    "loss": f"{100 * LOSS:g} % of messages lost",
}
"""What is changed, as the table's columns say it."""
_FEWEST = 10
"""Games of every two, below which a page says nothing about systems."""
_MORE, _EVEN, _LESS = "more often", "no clear difference", "**less often**"


def to_markdown(results: dict[str, Any], pictures: str) -> str:
    """Return the page; `pictures` is the folder of its pictures, seen from it."""
    config = results["config"]
    limit = config["game"]["time_limit"]
    parts = [
        ["# Control systems compared"],
        [
            "Which [control system](control_systems.md) wins more often and sooner against the same adversary? The",
            f"adversary is `{results['adversary']}`: even coverage, flown by the ergodic controller. Each system is",
            "commanded by the best script for its kind of commands, and by a policy trained for it, if there is one.",
        ],
        ["```bash", results["command"] or "python -m benchmarks.systems_ladder", "```"],
        *([["**Few and short games: this page only shows that everything works.**"]] * (config["games"] < _FEWEST)),
        *([line] for line in _answer(results)),
        [
            "**Hovering decides these games.** [A parked drone is hard to capture](parking.md), and it",
            "captures drones that fly through its ring. Coverage, formations and potential fields come to rest if",
            "their command does not change, so nearly any command wins for them. This follows from the paper's rule",
            "of capture, not from skill. Compare these systems by the time to a win and by the games against each",
            "other.",
        ],
        ["## Against the adversary"],
        [
            f"{config['games']} games each: half from each side, all from the same starts, seed {config['seed']}. A",
            f"game that is drawn or lost counts {limit:g} s in the mean time to a win. [All numbers with their 95 %",
            "intervals](tables/systems.csv), [the pilot games that chose the scripts](tables/systems_scripts.csv).",
        ],
        _standings(results),
        [f"![Share of games not yet won over time]({pictures}/time_to_win.png)"],
        ["*Share of the games against the adversary that are not won yet (Kaplan-Meier).*"],
        [f"![Each one's share of the points against each other]({pictures}/field.png)"],
        ["## Traits"],
        [
            "[The table of traits](tables/systems_traits.csv) has the ergodic metric of a team alone against even",
            f"coverage after {config['seconds']} s, times 1000, by the number of drones; some systems are not made to",
            "cover. Then it has the factor by which the metric grows with a change, over",
            f"{config['starts']} starts. The last columns are of a target of two modes: how many teams reach a metric",
            f"of {REACHED:g}, and with how many commands.",
        ],
    ]
    return "\n\n".join("\n".join(part) for part in parts) + "\n"


def tables(results: dict[str, Any]) -> dict[str, list[tuple[Any, ...]]]:
    """Return the rows of the page's tables, by the name of each."""
    standings: list[tuple[Any, ...]] = [
        ("system", "commands", "by", "won", "drawn", "lost", "forfeited", "won, 95 %", "mean length, s",
         "mean time to a win, s", "new commands a minute"),
    ]  # fmt: skip
    for row in results["standings"]:
        low, high = row["win_rate_ci95"]
        counts = (row["wins"], row["draws"], row["losses"], row["forfeits"], f"{100 * low:.0f} to {100 * high:.0f} %")
        times = (_interval(row["length"], 0), _interval(row["time_to_win"], 0), _interval(row["commands_a_minute"], 1))
        standings.append((row["system"], row["takes"], row["player"], *counts, *times))
    modes = ("two modes reached", "commands needed, median", "metric in the end, times 1000")
    traits: list[tuple[Any, ...]] = [("system", *(f"{size} drones" for size in SIZES), *_CHANGES.values(), *modes)]
    for row in results["traits"]:
        covered = (f"{1000 * row['coverage'][str(size)]['mean']:.2f}" for size in SIZES)
        traits.append(
            (row["system"], *covered, *(_interval(row[name], 2) for name in _CHANGES), *_modes(row["bimodal"]))
        )
    pilot = [(*row["entrant"].split("/", 1), row["wins"], row["draws"], row["losses"]) for row in results["pilot"]]
    scripts = [("system", "script", "won", "drawn", "lost"), *sorted(pilot)]
    return {"systems": standings, "systems_traits": traits, "systems_scripts": scripts}


def _answer(results: dict[str, Any]) -> list[str]:
    """Return the paragraphs that say where a trained policy beats the best script."""
    lines, compared = [], results["trained_and_script"]
    for verdict, words in (
        (_MORE, "wins more often than the best script"),
        (_EVEN, "shows no clear difference from the best script in games won"),
        (_LESS, "wins **less** often than the best script"),
    ):
        if names := [f"`{system_name(row['one'])}`" for row in compared if _verdict(row) == verdict]:
            lines.append(f"The policy trained for {', '.join(names)} {words}.")
    without = {row["system"] for row in results["standings"]} - {system_name(row["one"]) for row in compared}
    if without:
        lines.append(f"No policy has been trained for {', '.join(f'`{system}`' for system in sorted(without))}.")
    return lines


def _verdict(row: dict[str, Any]) -> str:
    low, high = row["more_often"]["ci95"]
    return _MORE if low > 0 else _LESS if high < 0 else _EVEN


def _by(row: dict[str, Any]) -> str:
    return "a trained policy" if row["player"] == TRAINED else f"`{row['player']}`"


def _standings(results: dict[str, Any]) -> list[str]:
    lines = ["| system | by | won | drawn | lost | mean time to a win, s |", "|---|---|---|---|---|---|"]
    for row in results["standings"]:
        forfeits = f" ({row['forfeits']} forfeited)" if row["forfeits"] else ""
        lines.append(
            f"| `{row['system']}` | {_by(row)} | {row['wins']} | {row['draws']} | {row['losses']}{forfeits} "
            f"| {_interval(row['time_to_win'], 0)} |"
        )
    return lines


def _interval(value: dict[str, Any] | None, digits: int) -> str:
    if value is None:
        return "-"
    low, high = value["ci95"]
    return f"{value['mean']:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _modes(found: dict[str, Any] | None) -> tuple[str, str, str]:
    if found is None:
        return "-", "-", "-"
    needed = "-" if found["commands"] is None else f"{found['commands']:g}"
    ends = {"mean": 1000 * found["metric"]["mean"], "ci95": [1000 * end for end in found["metric"]["ci95"]]}
    return f"{found['reached']} of {found['starts']}", needed, _interval(ends, 2)


def draw_times(results: dict[str, Any], path: Path) -> None:
    """Draw which share of the games against the adversary is not won yet, over time."""
    limit, systems = results["config"]["game"]["time_limit"], sorted({row["system"] for row in results["standings"]})
    with require_extra("matplotlib", "cli").rc_context(RC):
        figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(8, 4.5), layout="constrained")
        axes = figure.add_subplot()
        for row in results["standings"]:
            times = np.array([0.0, *row["won_after_s"], limit])
            left = 1.0 - np.arange(len(times) - 1) / row["games"]
            colour, dash = _COLOURS[systems.index(row["system"]) % len(_COLOURS)], DASHES[row["kind"] == "learned"]
            look = {"where": "post", "color": colour, "linestyle": dash}
            axes.step(times, [*left, left[-1]], label=f"{row['system']} by {row['player']}", **look)
        axes.set(xlabel="seconds of game", ylabel="share of games not won yet", xlim=(0, limit), ylim=(-0.02, 1.02))
        figure.legend(loc="outside right upper", fontsize=8)
        with draft_of(path) as draft:
            figure.savefig(draft, dpi=DPI, format="png")


def draw_field(results: dict[str, Any], path: Path) -> None:
    """Draw each entrant's share of the points against each other."""
    figure_class = require_extra("matplotlib.figure", "cli").Figure
    names, count = results["order"], len(results["order"])
    size = 0.45 * count + 2.0
    figure = figure_class(figsize=(1.3 * size, size), layout="constrained")
    axes = figure.add_subplot()
    shares = np.array([[np.nan if value is None else value for value in row] for row in results["payoffs"]])
    image = axes.imshow(100 * shares, cmap="RdBu", vmin=0, vmax=100, aspect="auto")
    axes.set_xticks(range(count), names, rotation=60, ha="right")
    axes.set_yticks(range(count), names)
    for (i, j), value in np.ndenumerate(shares):
        if np.isfinite(value):
            colour = "white" if abs(value - 0.5) > 0.3 else "black"
            axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set_title("% of the points that the row takes from the column", fontsize=10)
    figure.colorbar(image, shrink=0.6)
    with draft_of(path) as draft:
        figure.savefig(draft, dpi=DPI, format="png")
