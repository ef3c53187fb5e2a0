"""Adds entries to the board, and shows it: ``scripts/board``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from benchmarks.board import ENTRIES
from benchmarks.board.entries import add, attack, play
from benchmarks.board.page import build
from swarm_pz.errors import SwarmError
from swarm_pz.evaluation.workers import open_pool
from swarm_pz.standard import Protocol
from swarm_pz.standard.protocol import refresh


def main() -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    parser = argparse.ArgumentParser(prog="scripts/board", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    adding = commands.add_parser("add", help="make an entry of policies, run the benchmark on it, let it attack others")
    adding.add_argument("name", help="of the entry's folder, and of the method: a to z, 0 to 9 and '-'")
    adding.add_argument("policies", nargs="+", help="names, or folders with weights: one of each training seed")
    adding.add_argument("--by", required=True, help="who made it, 60 letters or fewer")
    adding.add_argument("--notes", default="", help="what to know of it, 300 letters or fewer")
    adding.add_argument("--link", default="", help="to code or paper, beginning with https://")
    playing = commands.add_parser("play", help="run the benchmark on entries, which attack each other")
    playing.add_argument("names", nargs="*", help="of entries; all if none")
    for one in (adding, playing):
        one.add_argument("--processes", type=int, default=2, help="that share the games")
        one.add_argument("--work", type=Path, default=Path("runs/board"), help="folder of games that were played")
    commands.add_parser("refresh", help="write the digests of installed opponents into an unpublished protocol")
    building = commands.add_parser("build", help="write the pages, which scripts/docs puts on the site")
    building.add_argument("--out", type=Path, default=Path("site/board"))
    options = parser.parse_args()
    try:
        protocol = Protocol.read()
        if options.command == "add":
            card = {"by": options.by, "notes": options.notes, "link": options.link}
            print(f"entry: {add(options.policies, ENTRIES / options.name, card, protocol).folder}")
        if options.command in ("add", "play"):
            names = [options.name] if options.command == "add" else options.names
            with open_pool(options.processes) as pool:
                keywords: dict[str, Any] = {"pool": pool, "say": print, "command": " ".join(sys.argv[1:])}
                play(ENTRIES, protocol, options.work, names, **keywords)
                if options.command == "add":
                    attack(ENTRIES, protocol, options.work, options.name, **keywords)
        elif options.command == "refresh":
            refresh()
        else:
            for path, text in build(ENTRIES).items():
                (options.out / path).parent.mkdir(parents=True, exist_ok=True)
                (options.out / path).write_text(text, encoding="utf-8")
            print(f"open {options.out / 'index.html'}")
    except SwarmError as error:
        print(f"scripts/board: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
