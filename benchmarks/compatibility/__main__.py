"""Run every row of the page and write it.

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

import benchmarks.compatibility
from benchmarks.compatibility.rows import Row, rows_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "compatibility.md"
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

    def line(self) -> str:
        """Return the line of the page."""
        keywords = ", ".join(f"`{name}={value!r}`" for name, value in self.row.keywords.items())
        told = f" **with** {keywords}" if keywords else ""
        if self.error is not None:
            told += f" **fails**: {self.row.fails or f'`{self.error}`'}"
        elif self.without is not None:
            told += f" (without: `{self.without.partition(':')[0]}`)"
        return f"- {self.row.what}{told}"


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


def section(library: str) -> tuple[str, list[Trial]]:
    """Try a library's rows; return its section of the page, and what came of them."""
    trials, versions = [], []
    for name, told in rows_of(rows_file(library)).items():
        error, versions = ask(library, name)
        without = ask(library, name, plain=True)[0] if told.keywords else None
        trials.append(Trial(told, error, without))
        print(f"{library}.{name}: {error or 'works'}{'' if trials[-1].as_told else '  <- NOT AS TOLD'}", flush=True)
    return head(library, ", ".join(versions)) + "\n".join(trial.line() for trial in trials) + "\n", trials


def head(library: str, versions: str) -> str:
    """Return how a library's section begins."""
    title, _, about = (rows_file(library).__doc__ or "").strip().partition("\n\n")
    return f"## {title.removesuffix('.')}\n\n{about}\n\nTried with {versions}:\n\n"


def introduction() -> str:
    """Return how the page begins."""
    title, _, about = (benchmarks.compatibility.__doc__ or "").strip().partition("\n\n")
    return f"# {title.removesuffix('.')}\n\n{about}\n"


def main() -> None:
    """Run rows; write the page if all of them were run."""
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
    sections = [section(library) for library in chosen]
    if not options.libraries:
        PAGE.write_text("\n".join([introduction(), *(text for text, _ in sections)]))
        print(f"{PAGE} is written")
    if not all(trial.as_told for _, trials in sections for trial in trials):
        sys.exit("some rows did not go as told; see above")


if __name__ == "__main__":
    main()
