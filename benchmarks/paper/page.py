"""Files of figures: pictures, numbers, the page and its tables."""

from __future__ import annotations

import io
import json
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import swarm_pz
from benchmarks.csv_table import write_csv
from benchmarks.paper.claims import FIGURES
from benchmarks.paper.figure import PRESETS, Figure, Finding, Setting, verdict
from benchmarks.paper.style import LOOK, RASTER, WIDTH, letters
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.provenance import versions

OPENING = (
    "This page tests the claims of *A Game Benchmark for Real-Time Human-Swarm Control* about its game, by the "
    "rules of the paper and of its [released code](paper.md#the-released-code). Commands are drawings, converted "
    "as the server does. A claim has [parts with numbers](figures_parts.csv). A part holds if its whole 95 % interval "
    "does, and fails if none of it does. If the paper says that something *may* happen, the verdict is how often it "
    "was seen. **All criteria were changed after a first look**: [the table of claims](figures_claims.csv) has the "
    "first ones and the reasons; the column *first criterion* says how they fared, by the preset `paper`. So these "
    "verdicts describe the game; they do not confirm predictions. The paper gives no number for *converges*: here the "
    "ergodic metric E must fall to a tenth, a bound of ours."
)
"""Opening of the page, Markdown."""


def to_dict(figure: Figure, finding: Finding, setting: Setting, command: str = "") -> dict[str, Any]:
    """Return all about a figure under one preset as plain values, for JSON."""
    fields = ("name", "claim", "section", "quote", "note", "first", "first_held", "revised")
    return {
        **{name: getattr(figure, name) for name in fields},
        "preset": setting.preset,
        "mapping": setting.mapping,
        "verdict": verdict(finding.parts),
        "parts": [
            {
                "asked": part.asked,
                "value": _plain(part.value),
                "interval": None if part.interval is None else [*map(_plain, part.interval)],
                "answer": part.answer,
                "ours": part.ours,
                "seen": part.seen,
            }
            for part in finding.parts
        ],
        "interval": {"level": LEVEL, "method": finding.method},
        "config_hash": {name: config.hash for name, config in finding.configs.items()},
        "rules": {name: config.rules for name, config in finding.configs.items()},
        "rules_hash": {name: config.rules_hash for name, config in finding.configs.items()},
        "versions": versions(),
        "command": command,
        "seed": setting.seed,
        "size": setting.size,
        "seeds": finding.seeds,
        "swarm_pz": swarm_pz.__version__,
        "series": finding.series,
    }


def _plain(value: float) -> float | None:
    """Return a number for JSON: None if it is infinite."""
    return float(f"{value:.6g}") if math.isfinite(value) else None


def write(record: dict[str, Any], out: Path) -> None:
    """Write NAME_PRESET.json of a figure, with its series on one line."""
    text = {name: value for name, value in record.items() if name != "series"}
    series = json.dumps(record["series"], separators=(",", ":"), allow_nan=False)
    body = json.dumps(text, indent=2, allow_nan=False).removesuffix("\n}")
    (out / f"{record['name']}_{record['preset']}.json").write_text(f'{body},\n  "series": {series}\n}}\n')


def draw(figure: Figure, series: dict[str, Any], preset: str, out: Path) -> None:
    """Draw a figure, as NAME_PRESET.png."""
    style, image = require_extra("matplotlib.style", "cli"), require_extra("PIL.Image", "render")
    with style.context(["swarm_pz.rendering.plots", LOOK]), io.BytesIO() as drawn:
        size = WIDTH, figure.height
        canvas = require_extra("matplotlib.figure", "cli").Figure(figsize=size, layout="constrained")
        figure.draw(canvas, series)
        letters(canvas)
        canvas.draw_without_rendering()
        canvas.set_layout_engine("none")  # doing the layout again would take most of the time
        canvas.savefig(drawn, dpi=RASTER)
        cut, plain = image.Quantize.MEDIANCUT, image.Dither.NONE  # a palette halves the file
        picture = image.open(drawn).convert("RGB").quantize(256, method=cut, dither=plain)
    picture.save(out / f"{figure.name}_{preset}.png", optimize=True, dpi=(RASTER, RASTER))


def make(name: str, setting: Setting, out: Path, command: str = "") -> str:
    """Write the pictures and NAME_PRESET.json of a figure into a folder, and return a line about it."""
    figure, began = FIGURES[name], time.monotonic()
    record = to_dict(figure, figure.measure(setting), setting, command)
    draw(figure, record["series"], setting.preset, out)
    write(record, out)  # last: the page shows the figures that have such a file
    return f"{name:<24} {setting.preset:<10} {record['verdict']:<16} {time.monotonic() - began:5.1f} s"


Records = Mapping[str, Mapping[str, Any]]
"""Results of one figure, by preset."""


def write_page(out: Path) -> None:
    """Write figures.md of those figures that a folder holds, in their order, and its two tables."""
    figures: list[Records] = []
    for name in FIGURES:
        paths = {preset: out / f"{name}_{preset}.json" for preset in PRESETS}
        records = {preset: json.loads(path.read_text()) for preset, path in paths.items() if path.exists()}
        if records:
            figures.append(records)
    (out / "figures.md").write_text(to_markdown(figures))
    for name, rows in tables(figures).items():
        write_csv(out / f"figures_{name}.csv", rows)


def to_markdown(figures: Sequence[Records]) -> str:
    """Return a page: its opening, a table of verdicts, then each figure's pictures and note."""
    records = [record for one in figures for record in one.values()]
    presets = sorted({record["preset"] for record in records})
    versions = sorted({f"seed {record['seed']}, swarm-pz {record['swarm_pz']}" for record in records})
    trial = min((record["size"] for record in records), default=1.0)
    lines = [
        "# The paper's evidence, made again",
        "",
        "```bash",
        "python -m benchmarks.paper",
        "```",
        "",
        OPENING,
        "",
        f"All verdicts: {'; '.join(versions)}.",
        *([] if trial == 1 else ["", f"**A trial: {100 * trial:.0f} % of the games.**"]),
        "",
        f"|claim|first criterion|{'|'.join(f'`{preset}`' for preset in presets)}|",
        "|---|---|" + "---|" * len(presets),
    ]
    for one in figures:
        first, words = next(iter(one.values())), [one[preset]["verdict"] if preset in one else "" for preset in presets]
        words = ["held" if first["first_held"] else "did not hold", *words]
        lines.append(f"|[{first['name']}](#{first['name']}): {first['claim']}|{'|'.join(words)}|")
    for one in figures:
        first = next(iter(one.values()))
        lines += ["", f"## {first['name']}", ""]
        lines += [f"![{first['name']}, {preset}]({first['name']}_{preset}.png)" for preset in one]
        if first["note"]:
            lines += ["", first["note"]]
    return "\n".join(lines) + "\n"


def tables(figures: Iterable[Records]) -> dict[str, list[tuple[str, ...]]]:
    """Return the rows of a page's tables: its claims, and all parts of their verdicts."""
    columns = (
        "figure, section, the paper, claim, criterion first written, it held, why it changed, preset, present criterion"
    )
    claims: list[tuple[str, ...]] = [(*columns.split(", "), "verdict")]
    parts: list[tuple[str, ...]] = [
        ("figure", "preset", "mapping", "whose", "part", "answer", "value", "low", "high", "intervals")
    ]
    for record in (record for one in figures for record in one.values()):
        name, preset = record["name"], record["preset"]
        held = "yes" if record["first_held"] else "no"
        about = (record["section"], record["quote"], record["claim"], record["first"], held, record["revised"], preset)
        present = "; ".join(part["asked"] for part in record["parts"] if not part["ours"])
        claims.append((name, *about, present, record["verdict"]))
        for part in record["parts"]:
            low, high = map(_show, part["interval"]) if part["interval"] else ("", "")
            whose = "ours" if part["ours"] else "the paper's"
            head = (name, preset, record["mapping"], whose, part["asked"], part["answer"])
            method = record["interval"]["method"] if part["interval"] else "exact"
            parts.append((*head, _show(part["value"]), low, high, method))
    return {"claims": claims, "parts": parts}


def _show(value: float | None) -> str:
    return "never" if value is None else f"{value:.3g}"
