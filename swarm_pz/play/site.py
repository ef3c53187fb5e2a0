"""The page as a folder for any static file host: `static/engine` plays the games in the browser."""

from __future__ import annotations

import hashlib
import html
import re
from collections.abc import Mapping
from pathlib import Path

import msgspec

from swarm_pz.config.base import canonical
from swarm_pz.play import protocol
from swarm_pz.play.forms import commands_of, welcome_of
from swarm_pz.play.game import TableConfig

STATIC = Path(__file__).parent / "static"
_OF_SERVERS = {"marks.js", "practice.js"}
"""Scripts for other control systems, and for practice while waiting: both need a server."""
_PICTURE = "static/picture.png"
"""Shown beside links to the page; the page itself never loads it."""
_UNREAD = re.compile(rb"^ *(//.*|/\*.*\*/$)?", re.MULTILINE)
"""Matches indents and comment lines, which no browser needs. Line numbers stay."""
_HEAD = """\
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'self'; worker-src 'self';
 style-src 'self'; img-src 'self' data:; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'">
<meta name="table" content="page">"""
"""The last line tells the page that the game runs in its worker."""


def files_of(
    policies: Mapping[str, str], cards: Mapping[str, protocol.Card], weights: Mapping[str, Path], address: str = ""
) -> dict[str, bytes]:
    """Return the site's files by their paths.

    - `policies`: installed ones, with a line about each; those that the engine cannot play are left out.
    - `cards`: of rated policies.
    - `weights`: files of learned policies.
    - `address`: of the folder; link previews need it for the picture.
    """
    files = {
        path.relative_to(STATIC.parent).as_posix(): _read(path)
        for path in sorted(STATIC.rglob("*"))
        if path.is_file() and path.name not in _OF_SERVERS
    }
    players = files["static/engine/players.js"].decode()
    for name, path in weights.items():
        if f'"{name}"' in players:
            files[f"static/engine/{name}.safetensors"] = path.read_bytes()
    playable = {name: text for name, text in policies.items() if re.search(rf"\b{name}\b", players)}
    files["static/engine/table.json"] = msgspec.json.encode(_table_file(playable, cards))
    page = files.pop("static/index.html").decode().replace('"/static/', '"static/')
    page = page.replace(f'content="{_PICTURE}"', f'content="{html.escape(address)}{_PICTURE}"')
    files["index.html"] = page.replace("<head>\n", f"<head>\n{_HEAD}\n", 1).encode()
    worker = files.pop("static/engine/sw.js").decode()
    digest = hashlib.sha256(b"".join(path.encode() + data for path, data in sorted(files.items()))).hexdigest()[:16]
    names = msgspec.json.encode(["./" if path == "index.html" else path for path in files if path != _PICTURE]).decode()
    files["sw.js"] = worker.replace('VERSION = "", FILES = []', f'VERSION = "{digest}", FILES = {names}').encode()
    return files


def _read(path: Path) -> bytes:
    """Return a file as a browser needs it."""
    data = path.read_bytes()
    return _UNREAD.sub(b"", data) if path.suffix in (".css", ".html", ".js") else data


def _table_file(policies: Mapping[str, str], cards: Mapping[str, protocol.Card]) -> dict[str, object]:
    """Return the engine's rules, and its welcome to a visitor."""
    table = TableConfig()
    system = table.game.team_systems[0]
    welcome = welcome_of(table, policies, cards, guests=False)
    welcome.systems = [one for one in welcome.systems if one.name == system.name]
    for policy in welcome.policies:
        policy.card = policy.card if policy.name in welcome.opponents else None
    return {"welcome": welcome, "rules": canonical(table), "commands": commands_of(system, table.game)}


def write(folder: Path, files: Mapping[str, bytes]) -> int:
    """Write files into a folder, and return their total bytes."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    return sum(map(len, files.values()))
