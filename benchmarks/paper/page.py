"""What a figure leaves behind: its picture, its numbers, and its part of the page and its tables."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import swarm_pz
from benchmarks.csv_table import write_csv
from benchmarks.paper.figure import Figure, Finding
from benchmarks.paper.style import DPI, RC
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.provenance import provenance


class Page(NamedTuple):
    """A page that holds figures: its name, its heading, and the Markdown that it opens with."""

    name: str
    title: str
    opening: str


def to_dict(figure: Figure, finding: Finding, seed: int, command: str = "") -> dict[str, Any]:
    """Return everything about a figure as plain values, ready for JSON."""
    numbers, holds = finding.numbers, finding.holds
    parts = holds if isinstance(holds, dict) else {}
    said = ("name", "title", "claim", "section", "quote", "paper", "rule", "revised")
    return {
        **{name: getattr(figure, name) for name in said},
        "statistic": {name: _plain(value) for name, (value, _) in numbers.items()},
        "interval": {
            "level": LEVEL,
            "method": finding.method,
            **{name: [*map(_plain, ends)] for name, (_, ends) in numbers.items() if ends is not None},
        },
        "supported": all(parts.values()) if parts else bool(holds),
        "parts": {name: bool(part) for name, part in parts.items()},
        "caption": f"{figure.paper} {finding.seen}",
        "config_hash": {name: config.hash for name, config in finding.configs.items()},
        **provenance(finding.configs, command),
        "seed": seed,
        "seeds": finding.seeds,
        "swarm_pz": swarm_pz.__version__,
        "series": finding.series,
    }


def _plain(value: float) -> float | None:
    """Return a number as JSON holds it: None for what never happens."""
    return float(f"{value:.6g}") if math.isfinite(value) else None


def write(record: dict[str, Any], out: Path) -> None:
    """Write a figure's NAME.json, the long rows of numbers on one line, so that the rest can be read."""
    text = {name: value for name, value in record.items() if name != "series"}
    series = json.dumps(record["series"], separators=(",", ":"), allow_nan=False)
    body = json.dumps(text, indent=2, allow_nan=False).removesuffix("\n}")
    (out / f"{record['name']}.json").write_text(f'{body},\n  "series": {series}\n}}\n')


def draw(figure: Figure, series: dict[str, Any], out: Path) -> None:
    """Draw a figure's NAME.png, with a palette, which takes less than half of the room."""
    matplotlib, image = require_extra("matplotlib", "cli"), require_extra("PIL.Image", "render")
    figure_class = require_extra("matplotlib.figure", "cli").Figure
    with matplotlib.rc_context(RC), io.BytesIO() as drawn:
        canvas = figure_class(figsize=figure.size, layout="constrained")
        canvas.suptitle(figure.title, x=0.01, ha="left")
        figure.draw(canvas, series)
        canvas.savefig(drawn)
        cut, plain = image.Quantize.MEDIANCUT, image.Dither.NONE
        picture = image.open(drawn).convert("RGB").quantize(256, method=cut, dither=plain)
    picture.save(out / f"{figure.name}.png", optimize=True, dpi=(DPI, DPI))


def write_page(page: Page, names: Iterable[str], out: Path) -> None:
    """Write a page of those figures that a folder holds, in the order of `names`, and its two tables."""
    records = [json.loads(path.read_text()) for name in names if (path := out / f"{name}.json").exists()]
    (out / f"{page.name}.md").write_text(to_markdown(page, records))
    for name, rows in tables(records).items():
        write_csv(out / f"{page.name}_{name}.csv", rows)


def to_markdown(page: Page, records: Sequence[dict[str, Any]]) -> str:
    """Return a page: its opening, a table of verdicts, then each figure's picture and what is seen."""
    holding = sum(record["supported"] for record in records)
    versions = sorted({f"seed {record['seed']}, swarm-pz {record['swarm_pz']}" for record in records})
    lines = [
        f"# {page.title}",
        "",
        "```bash",
        "python -m benchmarks.paper",
        "```",
        "",
        page.opening,
        "",
        "The command plays the games, draws the pictures and decides each claim by a rule in the code. The rules were "
        f"fixed before the first look, or the table says otherwise. Of {len(records)} claims {holding} hold here "
        f"({'; '.join(versions)}). [Claims and rules]({page.name}_claims.csv), [numbers with 95 % "
        f"intervals]({page.name}_numbers.csv).",
        "",
        "| figure | claim | holds |",
        "|---|---|---|",
        *(f"| [{one['name']}](#{one['name']}) | {one['claim']} | {verdict(one)} |" for one in records),
    ]
    for record in records:
        seen = record["caption"].removeprefix(record["paper"]).strip()
        lines += ["", f"## {record['name']}", "", f"![{record['title']}]({record['name']}.png)", "", seen]
    return "\n".join(lines) + "\n"


def tables(records: Sequence[dict[str, Any]]) -> dict[str, list[tuple[str, ...]]]:
    """Return the rows of a page's tables: its claims with their rules, and its numbers."""
    claims: list[tuple[str, ...]] = [
        ("figure", "section", "the paper", "claim", "rule", "changed after the first look", "holds", "parts")
    ]
    numbers: list[tuple[str, ...]] = [("figure", "number", "value", "low", "high", "intervals")]
    for record in records:
        parts = "; ".join(f"{name}: {'yes' if holds else 'no'}" for name, holds in record["parts"].items())
        rules = (record["claim"], record["rule"], record["revised"], verdict(record).strip("*"), parts)
        claims.append((record["name"], record["section"], record["quote"], *rules))
        for name, value in record["statistic"].items():
            low, high = map(_show, record["interval"][name]) if name in record["interval"] else ("", "")
            row = (record["name"], name.replace("_", " "), _show(value), low, high, record["interval"]["method"])
            numbers.append(row)
    return {"claims": claims, "numbers": numbers}


def verdict(record: dict[str, Any]) -> str:
    """Return whether a claim holds, in a word."""
    return "yes" if record["supported"] else "**no**"


def _show(value: float | None) -> str:
    return "never" if value is None else f"{value:.3g}"
