"""Write docs/commands.md from the commands' own help.

python docs/commands.py
"""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

from swarm_pz.cli import main

PAGE = Path(__file__).with_name("commands.md")
_HEAD = """\
# Commands

`swarm-pz COMMAND --help` shows all options of a command. `python docs/commands.py` writes this page from the help.

"""


def page() -> str:
    """Return the page: a line for each command, and for each command of a study."""
    return _HEAD + "".join(f"- `{name}`: {does}\n" for name, does in _listed([]))


def _listed(before: list[str]) -> list[tuple[str, str]]:
    """Return the commands that a help text lists, each with its first paragraph without the link to a page."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        main([*before, "--help"])
    entries = re.findall(r"•\s+(\w+)\s+(.*?)(?=\n\s*\n|•|$)", re.sub(r"[│╭╮╰╯─]", " ", said.getvalue()), re.DOTALL)
    rows = []
    for name, text in entries:
        words = [*before, name]
        does = re.sub(r"[:;] see docs/.*", ".", " ".join(text.split()))
        rows += _listed(words) if words == ["study"] else [(" ".join(words), does)]
    return rows


if __name__ == "__main__":
    PAGE.write_text(page())
