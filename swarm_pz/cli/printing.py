"""Figures as tables on the terminal."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from swarm_pz.evaluation.ladder import figure
from swarm_pz.evaluation.match import MatchResult

if TYPE_CHECKING:
    from swarm_pz.bench import Speed
    from swarm_pz.play.studies.planning import PowerRow

_WIDE = 400
"""Width of a table in a pipe or file, in characters; names are not wrapped there."""


def print_matches(matches: list[MatchResult], by: Literal["policy", "opponent"] = "policy", title: str = "") -> None:
    """Print matches of several policies against one opponent, or of one policy against several opponents.

    `by` heads the names of the several. The title of matches against one opponent has its name and the seed.
    """

    def marked(match: MatchResult, which: str) -> str:
        name = str(getattr(match, which))
        return f"{name}*" if name in match.privileged else name

    first = matches[0]
    title = title or f"against {marked(first, 'opponent')}, both sides, seed {first.seed}"
    note = "; * sees the simulator itself" if any(match.privileged for match in matches) else ""
    lines = []
    for match in matches:
        summary = match.summary()
        low, high = summary["win_rate_ci95"]
        lines.append(
            (
                marked(match, by),
                *(str(summary[name]) for name in ("games", "wins", "draws", "losses")),
                f"{100 * low:.0f} to {100 * high:.0f} %",
                f"{summary['mean_share']:.3f}",
                f"{summary['restricted_mean_seconds']:.0f}",
            )
        )
    _print(
        (by, "games", "won", "drawn", "lost", "won 95 %", "share", "mean s"),
        lines,
        title=title,
        caption=f"share of all drones at the end; in the mean length, draws count {first.limit_s:g} s{note}",
    )
    for match in matches:
        for reason, count in Counter(game.forfeit for game in match.forfeits).items():
            print(f"{marked(match, by)}: {count} of {len(match.games)} games are forfeits: {printable(reason)}")


def print_ladder(ladder: dict[str, Any]) -> None:
    """Print the figures of `swarm_pz.evaluation.ladder.make_ladder`."""
    field = ladder["intransitivity"]
    is_any_planned = any(entry["kind"] == "planned" for entry in ladder["players"])
    lines = []
    for entry in ladder["players"]:
        low, high = entry["rating_ci95"]
        lines.append(
            (
                entry["player"],
                entry["kind"],
                f"{entry['rating']:.0f}",
                f"{low:.0f} to {high:.0f}",
                f"{100 * entry['mixture_share']:.0f}",
                f"{100 * entry['points_against_mixture']:.1f}",
                *(str(entry[name]) for name in ("wins", "draws", "losses")),
                figure(entry["median_seconds"], 0),
                figure(entry["thinking_ms"], 1),
            )
        )
    _print(
        ("player", "kind", "rating", "95 %", "Nash\n%", "vs\nNash %", "won", "drawn", "lost", "median\ns", "ms"),
        lines,
        texts=2,
        title=f"{ladder['games_per_pairing']} games of every two, seed {ladder['seed']}",
        caption=f"{100 * field['cyclic_share']:.0f} % cyclic ({100 * field['cyclic_share_of_a_ladder']:.0f} % for a "
        f"true ladder); {field['cycles']} of {field['decided_triples']} clear "
        "triples are cycles; Nash: share of the Nash mixture; vs Nash: share of the points against it"
        + ("; planned players see the simulator itself" if is_any_planned else ""),
    )


def print_speeds(speeds: Sequence[Speed], machine: Mapping[str, object]) -> None:
    """Print what `swarm_pz.bench` measured, and on which machine."""
    _print(
        ("API", "games", "drones", "threads", "drone-steps", "env-steps"),
        [
            (one.api, *map(str, (one.games, one.drones, one.threads)), f"{one.drone_steps / 1e6:.2f} M",
             f"{one.env_steps:,.0f}")
            for one in speeds
        ],
        title="a second, median",
        caption=", ".join(f"{name} {value}" for name, value in machine.items()),
    )  # fmt: skip


def print_status(title: str, rows: Sequence[dict[str, Any]]) -> None:
    """Print how far each participant of a study is: rows of `StudyFolder.summary`."""
    _print(
        ("name", "code", "step", "block", "won", "done"),
        [
            (
                row["name"],
                row["code"],
                row.get("fault") or row["step"],
                row["block"],
                f"{row['won']} of {row['played']}" if row["of"] else "",
                f"{row['done']} of {row['of']}" if row["of"] else "",
            )
            for row in rows
        ],
        texts=4,
        title=title,
    )


def print_power(rows: Sequence[PowerRow]) -> None:
    """Print the power of a study's tests."""
    _print(
        ("effect", "participants", "power", "95 % interval", "by pairs", "false alarms"),
        [
            (
                row.effect,
                f"{row.participants}",
                f"{row.power:.2f}",
                f"{row.low:.2f} to {row.high:.2f}",
                f"{row.pairs:.2f}",
                f"{row.false_alarms:.2f}",
            )
            for row in rows
        ],
        texts=1,
        title="Power",
    )


def print_named(lines: Mapping[str, str]) -> None:
    """Print a line about each name; on a terminal, long lines are wrapped."""
    from rich.console import Console

    console = Console()
    indent = max(map(len, lines), default=0) + 2
    for name, text in lines.items():
        line = f"{name:<{indent}}{printable(text)}".rstrip()
        wrapped = textwrap.fill(line, max(console.width, 2 * indent), subsequent_indent=" " * indent)
        print(wrapped if console.is_terminal else line)


def printable(text: str) -> str:
    """Return a text with its control characters escaped, so that none reaches a terminal."""
    return "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text)


def _print(
    headings: Sequence[str], rows: Sequence[Sequence[str]], *, title: str, caption: str = "", texts: int = 1
) -> None:
    """Print a table; on a narrow terminal, its first columns, the `texts`, are wrapped, but never numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.measure import Measurement
    from rich.table import Table
    from rich.text import Text

    table = Table(
        box=SIMPLE_HEAD,  # no lines between columns: tables must fit 80 characters
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
        title=escape(title),
        caption=escape(caption) or None,
    )
    for number, heading in enumerate(headings):
        is_text = number < texts
        table.add_column(heading, justify="left" if is_text else "right", no_wrap=not is_text, overflow="fold")
    for row in rows:
        table.add_row(*(Text(printable(cell)) for cell in row))  # names are not markup
    console = Console()
    wide = console.options.update(max_width=_WIDE)
    least = Measurement.get(console, wide, table).minimum
    Console(width=max(console.width if console.is_terminal else _WIDE, least)).print("", table)
