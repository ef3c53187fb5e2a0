"""A study as what is published of it: tables, a data set of a standard, a codebook, and a report.

====================  ==========================================================================
`report.md`           wins, lengths and scores by condition, compared; with a picture
`tables/`             games, commands, captures, forms and participants, as CSV and Parquet
`codebook.md`         what every column is, with its unit; `codebook.json` for programs
`psychds/`            the tables as a Psych-DS data set
====================  ==========================================================================
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_pz.errors import OutputError, require_extra
from swarm_pz.evaluation.provenance import versions
from swarm_pz.files import check_folder, explain
from swarm_pz.play.recordings.tables import write_table
from swarm_pz.play.studies.reading import StudyData, read_study
from swarm_pz.play.studies.report import codebook_text, write_report
from swarm_pz.play.studies.rows import NOTES, TABLES, codebook
from swarm_pz.play.studies.standards import write_json, write_psychds

VERSION = 1
"""Of the tables: it changes when a column means something else, or is gone."""
_MARK = "codebook.json"
"""By which an export is known."""


def export(
    folder: Path,
    out: Path,
    *,
    overwrite: bool = False,
    command: str = "",
    progress: Callable[[float, float], None] | None = None,
) -> StudyData:
    """Write all that is published of a study into a new or empty folder, or nothing, and return its rows.

    The study may still be running. `overwrite` replaces the export that `out` holds; OutputError if it holds anything
    else, or cannot be written. `command` is what was called, for the report. See `read_study` for `progress` and other
    errors.
    """
    for module in ("pyarrow", "matplotlib", "jinja2"):
        require_extra(module, "lab")
    if out.resolve().is_relative_to(folder.resolve()):
        raise OutputError(f"the export of {folder} must lie outside of it, got {out}: what ran stays as it is")
    _check_out(out, overwrite)
    data = read_study(folder, progress)
    with _draft_of(out) as draft:
        (draft / "tables").mkdir()
        for name, kind in TABLES.items():
            for suffix in ("csv", "parquet"):
                write_table(data.table(name), kind, draft / "tables" / f"{name}.{suffix}")
        known = {
            "version": VERSION,
            "study": data.study.title,
            "versions": versions(),
            "command": command,
            "notes": NOTES,
            "tables": codebook(),
        }
        write_json(known, draft / _MARK)
        (draft / "codebook.md").write_text(codebook_text(data.study.title), encoding="utf-8")
        write_psychds(data, draft / "psychds")
        write_report(data, draft, command)
    return data


def _check_out(out: Path, overwrite: bool) -> None:
    check_folder(out.parent)
    if out.is_dir():
        there = sorted(path.name for path in out.iterdir())
        if there and _MARK not in there:
            raise OutputError(f"{out} holds {there[0]!r} and is no export: give a free folder (--out)")
        if there and not overwrite:
            raise OutputError(f"{out} holds an export: replace it (--overwrite), or give a free folder (--out)")
    elif out.exists() or out.is_symlink():
        raise OutputError(f"cannot write into {str(out)!r}: it is a file, not a folder")


@contextmanager
def _draft_of(out: Path) -> Iterator[Path]:
    """Give a folder beside another, which takes its place when the block ends and is gone if it fails."""
    draft, former = out.with_name(f".{out.name}.draft"), out.with_name(f".{out.name}.former")
    try:
        for left_over in (draft, former):
            shutil.rmtree(left_over, ignore_errors=True)
        draft.mkdir()
        yield draft
        if out.exists():
            out.rename(former)
        draft.rename(out)
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(f"{str(out)!r} cannot be written: {explain(error)}") from error
    finally:
        if former.exists() and not out.exists():
            former.rename(out)
        for left_over in (draft, former):
            shutil.rmtree(left_over, ignore_errors=True)
