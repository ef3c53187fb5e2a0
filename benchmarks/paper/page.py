"""What a figure leaves behind: its picture, its numbers, and its part of the page."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import swarm_pz
from benchmarks.paper.figure import Figure, Finding
from benchmarks.paper.style import DPI, RC
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.provenance import provenance


@dataclass(frozen=True)
class Page:
    """A page that holds figures: the file's name, its heading, and the Markdown that it opens with."""

    file: str
    title: str
    opening: str


def to_dict(figure: Figure, finding: Finding, seed: int, command: str = "") -> dict[str, Any]:
    """Return everything about a figure as plain values, ready for JSON."""
    return {
        "name": figure.name,
        "title": figure.title,
        "claim": figure.claim,
        "section": figure.section,
        "quote": figure.quote,
        "paper": figure.paper,
        "rule": figure.rule,
        "revised": figure.revised,
        "statistic": {name: _plain(value) for name, value in finding.statistic.items()},
        "interval": {
            "level": LEVEL,
            "method": finding.method,
            **{name: [_plain(end) for end in ends] for name, ends in finding.interval.items()},
        },
        "supported": bool(finding.supported),
        "parts": {name: bool(holds) for name, holds in finding.parts.items()},
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
    """Write a figure's NAME.json."""
    text = {name: value for name, value in record.items() if name != "series"}
    series = json.dumps(record["series"], separators=(",", ":"), allow_nan=False)
    # The long rows of numbers on one line, so that the rest can be read.
    body = json.dumps(text, indent=2, allow_nan=False).removesuffix("\n}")
    (out / f"{record['name']}.json").write_text(f'{body},\n  "series": {series}\n}}\n')


def draw(figure: Figure, series: dict[str, Any], out: Path) -> None:
    """Draw a figure's NAME.png."""
    matplotlib = require_extra("matplotlib", "ladder")
    figure_class = require_extra("matplotlib.figure", "ladder").Figure
    with matplotlib.rc_context(RC):
        canvas = figure_class(figsize=figure.size, layout="constrained")
        canvas.suptitle(figure.title, x=0.01, ha="left")
        figure.draw(canvas, series)
        drawn = io.BytesIO()
        canvas.savefig(drawn)
    image_module = require_extra("PIL.Image", "ladder")
    # A palette takes less than half of the room.
    cut, plain = image_module.Quantize.MEDIANCUT, image_module.Dither.NONE
    picture = image_module.open(drawn).convert("RGB").quantize(256, method=cut, dither=plain)
    picture.save(out / f"{figure.name}.png", optimize=True, dpi=(DPI, DPI))


def write_page(page: Page, names: Iterable[str], out: Path) -> None:
    """Write a page of those figures that a folder holds, in the order of `names`."""
    records = [json.loads(path.read_text()) for name in names if (path := out / f"{name}.json").exists()]
    (out / page.file).write_text(to_markdown(page, records))


def to_markdown(page: Page, records: Sequence[dict[str, Any]]) -> str:
    """Return a page: its opening, a table of verdicts, then each figure with claim, caption and numbers."""
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
        "The command plays the games, draws the pictures and decides each claim by a rule that stands in the code. "
        "Rules were fixed before the first look; where one was set right after it, that is said. Of "
        f"{len(records)} claims {holding} hold here; those that do not are discussed. Intervals are 95 %. In the "
        "folder that it writes, NAME.json holds the numbers, the hashes of the rules, the seeds and what is drawn "
        f"({'; '.join(versions)}).",
        "",
        *_table(records),
    ]
    for record in records:
        lines += _part(record)
    return "\n".join(lines) + "\n"


def _table(records: Sequence[dict[str, Any]]) -> list[str]:
    """Return a row for each figure; a column of sections where there are any."""
    with_section = any(record.get("section") for record in records)
    sections = [f" {record.get('section', '')} |" if with_section else "" for record in records]
    head, rule = (" section |", "---|") if with_section else ("", "")
    return [f"| figure |{head} claim | holds |", f"|---|{rule}---|---|"] + [
        f"| [{record['name']}](#{record['name']}) |{section} {record['claim']} | {verdict(record)} |"
        for record, section in zip(records, sections, strict=True)
    ]


def _part(record: dict[str, Any]) -> list[str]:
    """Return a figure's part of the page."""
    parts = "; ".join(f"{name}: {'yes' if holds else 'no'}" for name, holds in record.get("parts", {}).items())
    said = f"> \u201c{record['quote']}\u201d (the paper, {record['section']})" if record.get("quote") else ""
    lines = [
        "",
        f"## {record['name']}",
        "",
        *([said, ""] if said else []),
        f"**Claim**: {record['claim']} **Holds**: {verdict(record).strip('*')}{f' ({parts})' if parts else ''}.",
        "",
        f"![{record['title']}]({record['name']}.png)",
        "",
        record["caption"],
        "",
        f"Rule: {record['rule']}",
        "",
        *([f"Set right after the first look: {record['revised']}", ""] if record["revised"] else []),
        "| number | value | 95 % |",
        "|---|---|---|",
    ]
    for name, value in record["statistic"].items():
        ends = record["interval"].get(name)
        spread = f"{_show(ends[0])} to {_show(ends[1])}" if ends else ""
        lines.append(f"| {name.replace('_', ' ')} | {_show(value)} | {spread} |")
    return [*lines, "", f"Intervals: {record['interval']['method']}."]


def verdict(record: dict[str, Any]) -> str:
    """Return whether a claim holds, in a word."""
    return "yes" if record["supported"] else "**no**"


def _show(value: float | None) -> str:
    return "never" if value is None else f"{value:.3g}"
