"""Adds, checks and shows entries of the board: ``scripts/board``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.board import ENTRIES
from benchmarks.board.entries import WHOLE, add, check, folders
from benchmarks.board.page import build
from swarm_pz.errors import SwarmError
from swarm_pz.standard.protocol import refresh


def main() -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    parser = argparse.ArgumentParser(prog="scripts/board", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    adding = commands.add_parser("add", help="make an entry from the folder of a report")
    adding.add_argument("report", type=Path)
    adding.add_argument("name", help="of the entry's folder: a to z, 0 to 9 and '-'")
    adding.add_argument("--by", required=True, help="who sends it in, 60 letters or fewer")
    adding.add_argument("--notes", default="", help="what to know of it, 300 letters or fewer")
    adding.add_argument("--link", default="", help="to code or paper, beginning with https://")
    checking = commands.add_parser("check", help="verify entries as tests do, with more games")
    checking.add_argument("names", nargs="*", help="of entries; all of them if none is given")
    for command in (adding, checking):
        command.add_argument("--games", type=int, default=40, help="games that are played again")
    commands.add_parser(
        "refresh", help="write the digests of installed opponents into a protocol before it is published"
    )
    building = commands.add_parser("build", help="write the pages, which scripts/docs puts on the site")
    building.add_argument("--out", type=Path, default=Path("site/board"))
    given = parser.parse_args()
    try:
        if given.command == "add":
            card = {"by": given.by, "notes": given.notes, "link": given.link}
            entry = add(given.report, ENTRIES, given.name, card, games=given.games)
            size = sum(path.stat().st_size for path in entry.folder.rglob("*") if path.is_file())
            print(f"entry: {entry.folder}, {size / 2**20:.1f} MiB of {WHOLE / 2**20:.0f}; send it as a pull request")
        elif given.command == "check":
            for folder in [ENTRIES / name for name in given.names] or folders(ENTRIES):
                print(f"{folder.name}: {check(folder, games=given.games)}", flush=True)
        elif given.command == "refresh":
            refresh()
        else:
            for path, text in build(ENTRIES).items():
                (given.out / path).parent.mkdir(parents=True, exist_ok=True)
                (given.out / path).write_text(text, encoding="utf-8")
            print(f"open {given.out / 'index.html'}")
    except SwarmError as error:
        print(f"scripts/board: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
