"""Run every row of the table and write it.

scripts/compatibility                # makes the environments that the libraries need, then does this
scripts/compatibility torchrl rllib  # only some libraries; writes nothing
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile
import textwrap
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from benchmarks.compatibility.rows import Row, rows_of
from benchmarks.csv_table import write_csv

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "docs" / "tables" / "compatibility.csv"
COLUMNS = ("library", "what", "keywords", "result", "versions")
ANSWER = "swarm-pz compatibility: "
"""Begins the line that a row's process answers with; libraries print what they like."""
TIME_LIMIT = 600.0
"""Seconds that a row may take."""


class Library(NamedTuple):
    """Where a file's rows run, and whose versions its heading tells."""

    environment: str
    distributions: tuple[str, ...]


LIBRARIES = {
    "stable_baselines3": Library(".venv-compatibility", ("stable_baselines3", "gymnasium", "torch")),
    "sb3_contrib": Library(".venv-compatibility", ("sb3_contrib", "stable_baselines3", "gymnasium", "torch")),
    "gymnasium": Library(".venv-compatibility", ("gymnasium",)),
    "gymnasium_vector": Library(".venv-compatibility", ("gymnasium",)),
    "pettingzoo": Library(".venv-compatibility", ("pettingzoo",)),
    "supersuit": Library(".venv-compatibility", ("supersuit", "pettingzoo", "stable_baselines3")),
    "torchrl": Library(".venv-torchrl", ("torchrl", "tensordict", "pettingzoo", "gymnasium", "torch")),
    "benchmarl": Library(".venv-benchmarl", ("benchmarl", "torchrl", "pettingzoo", "gymnasium", "torch")),
    "rllib": Library(".venv-rllib", ("ray", "pettingzoo", "gymnasium", "torch")),
}


class Trial(NamedTuple):
    """What came of a row: its error with its keywords and without, none where it worked."""

    row: Row
    error: str | None
    without: str | None

    @property
    def as_told(self) -> bool:
        """Whether it went as its row says."""
        return (self.error is None) == (not self.row.fails) and (self.without is None) == (not self.row.keywords)

    def cells(self, library: str, versions: list[str]) -> tuple[str, ...]:
        """Return the row of the table."""
        keywords = ", ".join(f"{name}={value!r}" for name, value in self.row.keywords.items())
        result = "works"
        if self.error is not None:
            result = f"fails: {self.row.fails or self.error}"
        elif self.without is not None:
            result = f"works; without the keywords: {self.without.partition(':')[0]}"
        return library, self.row.what.replace("`", ""), keywords, result.replace("`", ""), ", ".join(versions)


def rows_file(library: str) -> ModuleType:
    """Return the module of a library's rows."""
    return importlib.import_module(f"benchmarks.compatibility.{library}")


def be(library: str, name: str, *, plain: bool) -> None:
    """Be a row's process: run it, with its keywords unless `plain`, and answer with its error."""
    told = rows_of(rows_file(library))[name]
    error = None
    try:
        told.run(**({} if plain else told.keywords))
    except Exception as raised:  # whatever the library does
        lines = str(raised).strip().splitlines() or [""]
        error = f"{type(raised).__name__}: {textwrap.shorten(lines[0], 160, placeholder=' ...')}"
    versions = [f"{each} {version(each)}" for each in LIBRARIES[library].distributions]
    print("\n" + ANSWER + json.dumps({"error": error, "versions": versions}), flush=True)


def ask(library: str, name: str, *, plain: bool = False) -> tuple[str | None, list[str]]:
    """Run a row in a process of its own; return its error, None if it works, and versions."""
    python = ROOT / LIBRARIES[library].environment / "bin" / "python"
    command = [str(python), "-m", "benchmarks.compatibility", "--row", library, name, *["--plain"] * plain]
    settings = {"PYTHONPATH": str(ROOT), "SDL_VIDEODRIVER": "dummy", "CUDA_VISIBLE_DEVICES": ""}
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(  # noqa: S603  (ourselves)
            command, cwd=folder, env=os.environ | settings, capture_output=True, text=True, timeout=TIME_LIMIT
        )
    for line in done.stdout.splitlines():
        if line.startswith(ANSWER):
            answer = json.loads(line.removeprefix(ANSWER))
            return answer["error"], answer["versions"]
    sys.exit(f"{library}.{name} ended without an answer:\n{done.stderr}")


def try_library(library: str) -> list[tuple[Trial, tuple[str, ...]]]:
    """Try a library's rows; return what came of each, and its row of the table."""
    tried = []
    for name, told in rows_of(rows_file(library)).items():
        error, versions = ask(library, name)
        without = ask(library, name, plain=True)[0] if told.keywords else None
        trial = Trial(told, error, without)
        tried.append((trial, trial.cells(library, versions)))
        print(f"{library}.{name}: {error or 'works'}{'' if trial.as_told else '  <- NOT AS TOLD'}", flush=True)
    return tried


def main() -> None:
    """Run rows; write the table if all of them were run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("libraries", nargs="*", choices=[[], *LIBRARIES], help="which ones; all if not given")
    parser.add_argument("--row", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("--plain", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        be(*options.row, plain=options.plain)
        return
    chosen = options.libraries or list(LIBRARIES)
    for library in chosen:
        if not (ROOT / LIBRARIES[library].environment).is_dir():
            sys.exit(
                f"there is no {LIBRARIES[library].environment}, in which {library} runs: use scripts/compatibility"
            )
    tried = [one for library in chosen for one in try_library(library)]
    if not options.libraries:
        write_csv(TABLE, [COLUMNS, *(cells for _, cells in tried)])
        print(f"{TABLE} is written")
    if not all(trial.as_told for trial, _ in tried):
        sys.exit("some rows did not go as told; see above")


if __name__ == "__main__":
    main()
