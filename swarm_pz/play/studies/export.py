"""Export of a study for publication: a Psych-DS data set (schema 1.5) of tables, with a report.

============================  ==========================================================================
`report.md`                   wins, lengths and scores by condition, compared
`plan.md`                     the plan made before the data
`results.csv`                 effects and pairs of conditions, with more digits
`data/`                       games, commands, captures, forms and participants, as CSV
`materials/`                  the study's file and its texts
`dataset_description.json`    a schema.org Dataset, which describes every column
`README.md`                   what the data set holds
============================  ==========================================================================
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from swarm_pz.errors import OutputError, require_extra
from swarm_pz.evaluation.provenance import versions
from swarm_pz.files import check_folder, read_text
from swarm_pz.play.recordings.tables import columns_of, write_table
from swarm_pz.play.studies.analysis import Effect
from swarm_pz.play.studies.folder import FILE, FROZEN, folder_draft
from swarm_pz.play.studies.planning import plan_of
from swarm_pz.play.studies.reading import StudyData, read_study
from swarm_pz.play.studies.report import markdown, write_report
from swarm_pz.play.studies.rows import NOTES, TABLES

_MARKS = {"dataset_description.json", "report.md"}
"""Files by which an existing export is recognised."""
_CONTENT = (
    "`report.md` compares the conditions and says how; `results.csv` has its effects and pairs; "
    "`dataset_description.json` explains the columns of the tables in `data`."
)


def export(
    folder: Path,
    out: Path,
    *,
    overwrite: bool = False,
    command: str = "",
    progress: Callable[[float, float], None] | None = None,
) -> StudyData:
    """Export a study into a new or empty folder, completely or not at all, and return its rows.

    The study may still be running. `overwrite` replaces an export in `out`. Raises OutputError if `out` holds anything
    else, lies in `folder`, or cannot be written. `command` is the command line, for the report. See `read_study` for
    `progress` and other errors.
    """
    require_extra("jinja2", "lab")
    if out.resolve().is_relative_to(folder.resolve()):
        raise OutputError(f"the export of {folder} must lie outside of it, got {out}: what ran stays as it is")
    _check_out(out, overwrite)
    data = read_study(folder, progress)
    with folder_draft(out) as draft:
        (draft / "data").mkdir()
        for name, kind in TABLES.items():
            path = draft / "data" / f"description-{name}_data.csv"
            write_table(getattr(data, name), kind, path, data.factor_columns)
        _describe(data, draft)
        (draft / "plan.md").write_text(plan_of(data.study, folder / FROZEN / FILE), encoding="utf-8")
        _copy_materials(data, folder, draft / "materials")
        write_table(write_report(data, draft, command), Effect, draft / "results.csv")
    return data


def _describe(data: StudyData, folder: Path) -> None:
    """Write `dataset_description.json` and `README.md`."""
    title = data.study.title
    about = (
        f"Games of two swarms of drones, played by {len(data.remaining)} participants under the conditions "
        f"{', '.join(one.title for one in data.study.conditions)}: what each of them commanded, took and answered. "
        "Written by swarm-pz from the recordings."
    )
    description = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": title,
        "description": about,
        "keywords": ["swarm-pz", "human-swarm interaction", "drones"],
        "variableMeasured": _variables(data),
    }
    text = json.dumps(description, indent=2, ensure_ascii=False) + "\n"
    (folder / "dataset_description.json").write_text(text, encoding="utf-8")
    made_by = ", ".join(f"{name} {version}" for name, version in versions().items())
    results = [f"- `{name}`: {meaning['about']}" for name, meaning in columns_of(Effect).items()]
    parts = [f"# {markdown(title)}", markdown(about), _CONTENT, *NOTES.values(), f"Versions: {made_by}."]
    parts += ["Columns of `results.csv`:", "\n".join(results)]
    (folder / "README.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _copy_materials(data: StudyData, folder: Path, goal: Path) -> None:
    """Copy the study's file and texts; codes, which open sessions, are left out."""
    for name in (FILE, *data.study.texts):
        copy, text = goal / name, read_text(folder / FROZEN / name)
        if name == FILE:
            text = re.sub(r"^codes\s*=\s*\[[^\]]*\]", "# codes are left out", text, flags=re.MULTILINE)
            if tomllib.loads(text).get("codes"):
                data.faults.append(
                    f"{name} is not published: expected its codes as `codes = [...]` on lines of their own"
                )
                continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(text, encoding="utf-8")


def _variables(data: StudyData) -> list[dict[str, Any]]:
    """Return a description of each column: its meaning in each table that has it, and its unit."""
    variables: dict[str, dict[str, Any]] = {}
    for name, kind in TABLES.items():
        for column, meaning in columns_of(kind).items():
            known = variables.setdefault(column, {"@type": "PropertyValue", "name": column, "description": ""})
            known["description"] += f"{'; ' if known['description'] else ''}in {name}: {meaning['about']}"
            known |= {"unitText": meaning["unit"]} if meaning["unit"] else {}
    for column in data.factor_columns:
        about = f"level of {column.removeprefix('factor_')} in the condition"
        unit = {"unitText": "ms"} if column.endswith("_ms") else {"unitText": "s"} if column.endswith("_s") else {}
        variables[column] = {"@type": "PropertyValue", "name": column, "description": about, **unit}
    return list(variables.values())


def _check_out(out: Path, overwrite: bool) -> None:
    check_folder(out if os.path.lexists(out) else out.parent)
    there = sorted(path.name for path in out.iterdir()) if out.exists() else []
    if there and not _MARKS.issubset(there):
        raise OutputError(f"{out} holds {there[0]!r} and is no export: give a free folder (--out)")
    if there and not overwrite:
        raise OutputError(f"{out} holds an export: replace it (--overwrite), or give a free folder (--out)")
