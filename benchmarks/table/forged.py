"""Recordings as a stranger might forge them, 200 of one real game: each is named, and none ends or holds up anybody.

    python -m benchmarks.table.forged RECORDING

Every file is verified, opened as a table does, read as a seat's views and simulated to its end, by the code of
`swarm-pz replay`, the table and `swarm-pz dataset`. Where the chain of lines and the hashes were made anew, too, rules
that lead to the same game may verify; whatever else is changed must be named.
"""

from __future__ import annotations

import base64
import copy
import gzip
import itertools
import json
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from swarm_pz.datasets.tables import _views
from swarm_pz.errors import SwarmError
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings import playback
from swarm_pz.play.recordings.chain import START, chained
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.recordings.sandbox import Sandbox
from swarm_pz.play.server.replays import _load

COUNT = 200
NUMBERS = (1e-40, 5e-324, 1e308, float("nan"), float("inf"), -0.0, -1.0, 0, 10**9, 2**64, 10**400)
OTHERS = ("1", None, True, [], {}, [1, 2, 3], "\ud800", "../../etc/passwd")
Line = dict[str, Any]


class Forgery(NamedTuple):
    """A forged file, and whether it must be named: it cannot be a game that came about so."""

    kind: str
    name: str
    data: bytes
    is_named: bool = True


def forgeries(honest: bytes) -> list[Forgery]:
    """Return forged files made of one honest file, 200 in all, spread over the kinds."""
    few = [list(make(honest)) for make in (_headers, _events, _frames, _torn)]
    many = [list(make(honest)) for make in (_numbers, _hashed)]
    found = list(itertools.chain.from_iterable(few))
    for kind in many:
        wanted = -(-(COUNT - sum(map(len, few))) // len(many))
        found += [kind[place * len(kind) // wanted] for place in range(wanted)]
    return found


def verdict(path: Path, sandbox: Sandbox) -> str:
    """Return what is said of a file by all who read it; empty if all of them take it for an honest game."""
    said = []
    try:
        found, _ = sandbox.do(path.name, playback.verify, path)
        if not found.verified or not found.finished:
            said.append(f"{found.faults} differs at {found.first_difference}, finished: {found.finished}")
    except SwarmError as error:
        said.append(str(error))
    for work, *more in ((_load,), (_views, "person"), (_to_the_end,)):
        try:
            sandbox.do(path.name, work, path, *more)
        except SwarmError as error:
            said.append(str(error))
    return "; ".join(said)


def _to_the_end(path: Path) -> None:
    """Simulate a game whatever its frames show, as films do."""
    recording = Recording.read(path)
    playback.Playback(recording).seek(recording.last_tick)


# --- kinds ----------------------------------------------------------------------------------------


def _plain(honest: bytes) -> list[Line]:
    lines = [json.loads(line) for line in honest.splitlines()]
    for line in lines:
        del line["chain"]
    return lines


def _written(lines: Sequence[Line | bytes]) -> bytes:
    """Return lines with the chain made anew."""
    link, text = START, b""
    for line in lines:
        plain = line if isinstance(line, bytes) else json.dumps(line, separators=(",", ":")).encode()
        written, link = chained(plain, link)
        text += written + b"\n"
    return text


def _leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the paths of numbers in nested plain values."""
    if isinstance(value, dict | list):
        for key, entry in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _leaves(entry, (*path, key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path


def _at(value: Any, path: Sequence[Any]) -> Any:
    for key in path:
        value = value[key]
    return value


def _put(value: Any, path: Sequence[Any], new: Any) -> Any:
    value = copy.deepcopy(value)
    _at(value, path[:-1])[path[-1]] = new
    return value


def _numbers(honest: bytes) -> Iterator[Forgery]:
    """Yield files whose rules were changed, and whose hashes are the old ones."""
    first, *rest = _plain(honest)
    for path, value in itertools.product(_leaves(first["table"]), (*NUMBERS, *OTHERS)):
        if value == _at(first["table"], path):
            continue
        name = f"{'.'.join(map(str, path))} = {str(value)[:20]}"
        yield Forgery("rules", name, _written([_put(first, ("table", *path), value), *rest]))


def _hashed(honest: bytes) -> Iterator[Forgery]:
    """Yield files whose rules were changed, and whose hashes were made anew: what is legal is simulated."""
    first, *rest = _plain(honest)
    for path, value in itertools.product(_leaves(first["table"]), NUMBERS):
        forged = _put(first, ("table", *path), value)
        try:
            config = TableConfig.from_dict(forged["table"])
            hashes = {"config_hash": config.hash, "rules_hash": config.game.rules_hash}
        except (SwarmError, ArithmeticError, ValueError, TypeError):
            continue
        name = f"{'.'.join(map(str, path))} = {str(value)[:20]}, hashed"
        yield Forgery("rules, hashed", name, _written([forged | hashes, *rest]), is_named=False)


def _headers(honest: bytes) -> Iterator[Forgery]:
    first, *rest = _plain(honest)
    origin = {"recording": "a.jsonl", "tick": 30, "lines": 5}
    changes: dict[str, dict[str, Any]] = {
        "a huge seed": {"seed": 10**400},
        "a negative seed": {"seed": -1},
        "a text for a seed": {"seed": "1"},
        "no rules": {"table": {}, "rules_hash": ""},
        "a list of rules": {"table": []},
        "a version to come": {"version": 99},
        "version 1": {"version": 1},
        "no version": {"version": None},
        "an unknown seat": {"red": {"kind": "king"}},
        "a free seat that plays": {"blue": {"kind": "free"}, "red": {"kind": "free"}},
        "a past that was not": {"origin": origin},
        "a past of 10**9 lines": {"origin": origin | {"lines": 10**9}},
        "a past of -1 lines": {"origin": origin | {"lines": -1}},
        "10**9 drones": {"table": _put(first["table"], ("game", "drones_per_team"), 10**9)},
        "a path for rules": {"table": "../../etc/passwd"},
    }
    for name, change in changes.items():
        yield Forgery("header", name, _written([first | change, *rest]))
    for name, change in {
        "a path for a policy": {"blue": {"kind": "policy", "policy": "../../etc/passwd"}},
        "a path for its past": {"software": "../../etc/passwd"},
        "a label of every alphabet": {"red": {"kind": "person", "label": "\u202e\u0000ü漢\U0001f600" * 100}},
        "a start at no time": {"started": "x" * 100_000},
        "fields of later versions": {"later": [[]] * 1000},
    }.items():
        yield Forgery("header", name, _written([first | change, *rest]), is_named=False)
    for depth in (500, 100_000):
        deep = b"[" * depth + b"]" * depth
        yield Forgery("header", f"rules {depth} deep", _written([b'{"type":"game","table":' + deep + b"}", *rest]))
        told = json.dumps(first, separators=(",", ":")).encode()
        nested = told[:-1] + b',"table":' + b'{"game":' * depth + b"1" + b"}" * depth + b"}"
        yield Forgery("header", f"rules {depth} deep, twice", _written([nested, *rest]))


def _events(honest: bytes) -> Iterator[Forgery]:
    lines = _plain(honest)
    place_of = {line["type"]: place for place, line in reversed(list(enumerate(lines)))}
    cells = len(lines[place_of["command"]]["density"])
    changes: dict[str, list[dict[str, Any]]] = {
        "command": [
            *(
                {"density": density}
                for density in ([], [[]], [[1.0]], 5, "x", [["x"] * cells] * cells, [[1.0] * 4000] * 200)
            ),
            *({"density": [[value] * cells] * cells} for value in (float("nan"), 1e308, -1.0, 5e-324, 10**400)),
            {"density": None},
            {"density": None, "command": [[1.0] * cells] * cells},
            {"command": [1.0]},
            {"density": None, "command": {"shape": "ring", "centre": [1e308, 1e308]}},
            {"team": 2},
            {"team": -1},
            {"number": 2**32},
            {"number": 2**31},
            {"tick": -1},
            {"tick": 2**32 - 1},
            {"strokes": [{"brush": "attract", "width": 1e308, "points": [[1e308, -1e308]]}]},
            {"strokes": [{"brush": "attract", "width": 0.1, "points": []}]},
            {"strokes": [{"brush": "attract", "width": 0.1, "points": [[0.5, 0.5]] * 100_000}]},
            {"sender": "auto:../../etc/passwd"},
        ],
        "in_force": [{"tick": 2**32 - 1}, {"tick": 1}, {"number": 77}, {"team": 1}, {"sender": "auto:saved"}],
        "seat": [{"event": "flown"}, {"team": 5}],
        "end": [
            {"tick": 2**32 - 1},
            {"tick": 0},
            {"sizes": [65535, 0]},
            {"sizes": [1, 2, 3]},
            {"outcome": "red", "ended_by": "capture"},
            {"ended_by": "left"},
        ],
    }
    for kind, several in changes.items():
        for change in several:
            place = place_of[kind]
            forged = [*lines[:place], lines[place] | change, *lines[place + 1 :]]
            yield Forgery("event", f"{kind}: {str(change)[:60]}", _written(forged))
    end = len(lines) - 1
    extra: dict[str, Line | bytes] = {
        "captured, though it was not": {"type": "captured", "tick": lines[-1]["tick"], "drone": 0, "team": 0},
        "a drone that is not there": {"type": "captured", "tick": lines[-1]["tick"], "drone": 65_535, "team": 0},
        "an unknown kind": {"type": "exploded"},
        "no kind": {},
        "a second header": lines[0],
        "a name twice": b'{"type":"in_force","team":0,"number":0,"tick":0,"ms":1,"tick":9}',
        "a clock at no time": b'{"type":"clock","clock":"lsl","ms":NaN,"seconds":1e999,"uncertainty_ms":0}',
    }
    for name, line in extra.items():
        yield Forgery("event", name, _written([*lines[:end], line, lines[end]]))


def _frames(honest: bytes) -> Iterator[Forgery]:
    lines = _plain(honest)
    places = [place for place, line in enumerate(lines) if line["type"] == "frame"]
    place = places[len(places) // 2]
    data = base64.b64decode(lines[place]["data"])
    count = int.from_bytes(data[2:4], "little")

    def moved(change: bytes, at: int) -> bytes:
        return data[:at] + change + data[at + len(change) :]

    forged: dict[str, bytes] = {
        "positions elsewhere": moved(b"\xff\xff" * 2, 20),
        "NaN for a time": moved(b"\x00\x00\x00\x00\x00\x00\xf8\x7f", 12) + b"x",
        "65535 drones": moved(b"\xff\xff", 2),
        "no drones": moved(b"\x00\x00", 2),
        "another tick": moved(b"\xff\xff\xff\xff", 8),
        "fields that it lacks": moved(b"\x02", 1),
        "all flags": moved(b"\xff", 1),
        "a hidden team": moved(b"\x04", 1),
        "velocities turned": moved(b"\x00\x80" * 2, 20 + 4 * count),
        "teams swapped": data[:-1] + bytes([data[-1] ^ 0xFF]),
        "nothing": b"",
        "half of it": data[: len(data) // 2],
        "a target": b"\x02" + data[1:],
        "16 MB": data * (2**24 // len(data)),
    }
    for name, frame in forged.items():
        line = lines[place] | {"data": base64.b64encode(frame).decode()}
        yield Forgery("frame", name, _written([*lines[:place], line, *lines[place + 1 :]]))
    for name, text in {"no base64": "?" * 100, "a surrogate": "\ud800", "a number": 7}.items():
        yield Forgery("frame", name, _written([*lines[:place], lines[place] | {"data": text}, *lines[place + 1 :]]))
    cut: dict[str, Callable[[int], bool]] = {
        "none": lambda _: False,
        "the first alone": lambda at: at == places[0],
        "every second": lambda at: places.index(at) % 2 == 0,
        "all but one": lambda at: at != place,
    }
    for name, keep in cut.items():
        kept = [line for at, line in enumerate(lines) if line["type"] != "frame" or keep(at)]
        yield Forgery("frame", f"{name} of the frames", _written(kept))
    yield Forgery("frame", "a frame twice", _written([*lines[:place], lines[place], *lines[place:]]))


def _torn(honest: bytes) -> Iterator[Forgery]:
    middle, lines = len(honest) // 2, honest.splitlines(keepends=True)
    half = len(lines) // 2
    for name, data in {
        "empty": b"",
        "a header alone": lines[0],
        "an end alone": lines[-1],
        "no end": b"".join(lines[:-1]),
        "a line cut out": b"".join([*lines[:half], *lines[half + 1 :]]),
        "a line doubled": b"".join([*lines[:half], *lines[half - 1 :]]),
        "lines swapped": b"".join([*lines[:half], lines[half + 1], lines[half], *lines[half + 2 :]]),
        "a line torn": b"".join([*lines[:half], lines[half][: len(lines[half]) // 2], *lines[half + 1 :]]),
        "a bit changed": honest[:middle] + bytes([honest[middle] ^ 1]) + honest[middle + 1 :],
        "no chain": b"".join(json.dumps(line).encode() + b"\n" for line in _plain(honest)),
        "a chain of zeros": b"".join(line[:-20] + b"0" * 16 + line[-4:] for line in lines),
        "zeros": b"\0" * len(honest),
        "empty lines": b"\n" * 100_000,
        "one line of 32 MB": b'{"type":"' + b"x" * 2**25 + b'"}\n',
        "10**6 lists": b'{"type":"command","density":[' + b"[]," * 10**6 + b"[]]}\n",
        "packed": gzip.compress(honest),
        "a packed bomb": gzip.compress(b"\0" * 2**24),
        "another coding": honest.decode().encode("utf-16"),
        "a mark before it": b"\xef\xbb\xbf" + honest,
        "Windows' line ends": honest.replace(b"\n", b"\r\n"),
        "no text": bytes(range(256)) * 100,
        "more after its end": honest + lines[-2],
        "a game after it": honest + honest,
    }.items():
        yield Forgery("file", name, data)


def run(honest: bytes, chosen: Sequence[Forgery], folder: Path) -> list[str]:
    """Judge forged files; return a line about each that is not named or ended a process, or if the honest one did."""
    found, path = [], folder / "forged.jsonl"
    with Sandbox() as sandbox:
        for forgery in (Forgery("honest", "the honest one", honest, is_named=False), *chosen):
            path.write_bytes(forgery.data)
            said = verdict(path, sandbox)
            if not said and forgery.is_named:
                found.append(f"{forgery.kind}, {forgery.name}: nobody has named it")
            if forgery.kind == "honest" and said:
                found.append(f"the honest one: {said}")
            if said and not any(word in said for word in ("line ", "forged.jsonl", "differs at")):
                found.append(f"{forgery.kind}, {forgery.name}: it is not said where: {said}")
            if "ended the process" in said or "given up" in said:
                found.append(f"{forgery.kind}, {forgery.name}: {said}")
    return found


def main(recording: Path) -> None:
    """Judge all of them."""
    honest = recording.read_bytes()
    chosen, began = forgeries(honest), time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        found = run(honest, chosen, Path(folder))
    for fault in found:
        print(ascii(fault)[:500])
    print(f"{len(chosen)} forged recordings, {len(found)} faults, {time.monotonic() - began:.1f} s")


if __name__ == "__main__":
    from benchmarks.table import forged  # under a name that the sandbox's process can import

    forged.main(Path(sys.argv[1]))
