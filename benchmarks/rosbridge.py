"""The rosbridge beside a table, as ROS programs meet it: the tablet's sequence, a loss, and a client that misbehaves.

python -m benchmarks.rosbridge --python old/bin/python --python new/bin/python

Each Python brings a roslibpy of its own, which plays red in a whole game against `uniform`: 20 deploys, with the
connection lost in the middle of them so that the server does not notice, and in the second half a stranger who sends
300 messages that are none. What follows is measured by the recording, and by a watcher at the table.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import re
import sys
import tempfile
import time
from asyncio.subprocess import PIPE, Process
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from websockets import Subprotocol
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.table.clients import server
from swarm_pz.config import RED, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, decode_frame
from swarm_pz.play.recordings.format import Recording
from swarm_pz.simulator.commands import make_target

_TABLET = Path(__file__).parent / "table" / "tablet.py"
_DEPLOYS, _PAUSE_S = 20, 2.0
_HOSTILE = 300


class Wire:
    """A wire between a client and a server that can be cut so that only the client notices."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._clients: list[asyncio.StreamWriter] = []
        self._ends: list[asyncio.StreamWriter] = []
        self._server: asyncio.Server | None = None
        self._tasks: set[asyncio.Task[None]] = set()
        self._is_cut: list[asyncio.Event] = []

    async def lay(self) -> int:
        """Begin to take connections, and return the port."""
        self._server = await asyncio.start_server(self._meet, "127.0.0.1", 0)
        return int(self._server.sockets[0].getsockname()[1])

    async def end(self) -> None:
        """Take it away."""
        if self._server is not None:
            self._server.close()
        for task in self._tasks:
            task.cancel()
        for writer in (*self._clients, *self._ends):
            writer.transport.abort()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _meet(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, away = await asyncio.open_connection("127.0.0.1", self._to)
        cut = asyncio.Event()
        self._clients.append(writer)
        self._ends.append(away)
        self._is_cut.append(cut)
        for source, sink in ((reader, away), (there, writer)):
            task = asyncio.create_task(self._carry(source, sink, cut))
            self._tasks.add(task)

    async def _carry(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, cut: asyncio.Event) -> None:
        with contextlib.suppress(ConnectionError):
            while (data := await source.read(2**16)) and not cut.is_set():
                sink.write(data)
                await sink.drain()

    def cut(self) -> None:
        """Let the client lose its connection; the server's end stays as it is, and is silent."""
        for event in self._is_cut:
            event.set()
        for writer in self._clients:
            writer.transport.abort()


class Watcher:
    """Somebody at the table who sees every frame when it comes."""

    def __init__(self) -> None:
        self.made_s: dict[int, float] = {}
        """When each tick's frame was made, on this machine's clock."""
        self.outcome: str | None = None

    async def watch(self, address: str, room: str) -> None:
        """Watch a room until its game is over."""
        url, began_s = f"ws://{address}/socket", float("inf")
        async with connect(url, subprotocols=[Subprotocol(protocol.SUBPROTOCOL)], max_size=None) as socket:
            for message in (protocol.Hello(), protocol.Join(room)):
                await socket.send(protocol.encode(message))
            async for data in socket:
                now = time.monotonic()
                if isinstance(data, bytes) and data[0] == FRAME:
                    frame = decode_frame(data)
                    began_s = min(began_s, now - frame.server_ms / 1000.0)
                    self.made_s[frame.tick] = began_s + frame.server_ms / 1000.0
                    await socket.send(protocol.encode(protocol.Acknowledge(frame.sequence)))
                elif isinstance(data, str):
                    told = protocol.decode_server(data)
                    if isinstance(told, protocol.RoomState) and told.phase == "over":
                        self.outcome = told.outcome
                        return

    def gaps_ms(self, since_s: float, until_s: float) -> dict[str, float]:
        """Return the gaps between the ticks of a stretch of time, by the table's clock."""
        ticks = sorted(tick for tick, at in self.made_s.items() if tick and since_s <= at <= until_s)
        pairs = [(a, b) for a, b in itertools.pairwise(ticks) if b == a + 1]
        gaps = 1000.0 * np.array([self.made_s[b] - self.made_s[a] for a, b in pairs])
        percentile = round(float(np.percentile(gaps, 99)), 1)
        return {"median": round(float(np.median(gaps)), 1), "p99": percentile, "most": round(float(gaps.max()), 1)}


def _publish(topic: str, message: Any) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": message})


_IMAGE = {"name": "attract data", "team": "red", "map_width": 50, "map_height": 50, "data": [0.1] * 2500}
_HOSTILE_MESSAGES: list[str | bytes] = [
    '{"op": "teleport"}',
    "[" * 100_000,
    b"\xff\xfe\x00",
    _publish("/tablet_comm", _IMAGE | {"team": "green"}),
    _publish("/tablet_comm", _IMAGE | {"data": [0.1] * 2499}),
    _publish("/tablet_comm", _IMAGE | {"data": [float("nan")] * 2500}),
    _publish("/tablet_comm", _IMAGE | {"data": "attract"}),
    _publish("/tablet_comm", _IMAGE),  # another client's seat
    _publish("/swarm/blue/accelerations", {"data": [1.0] * 40}),
    _publish("blue_connection_service", {}),
    json.dumps({"op": "subscribe", "topic": "/tf", "compression": "png"}),
    "{",
]
_LARGE = _publish("/tablet_comm", _IMAGE | {"data": [0.1] * 1_500_000})
_MOST_LARGE = 5


def hostile(number: int) -> str | bytes:
    """Return one of the messages that are none; some of the first are of 9 MB."""
    if number % 12 == 11 and number < 12 * _MOST_LARGE:
        return _LARGE
    return _HOSTILE_MESSAGES[number % 12]


async def misbehave(port: int) -> int:
    """Send what is refused until it was refused often enough, and return how often; who is shown out comes back."""
    refused = sent = 0
    while refused < _HOSTILE:
        async with connect(f"ws://127.0.0.1:{port}", max_size=None) as socket:
            await socket.send(json.dumps({"op": "set_level", "level": "error"}))
            try:
                while refused < _HOSTILE:
                    await socket.send(hostile(sent))
                    sent += 1
                    told = json.loads(await asyncio.wait_for(socket.recv(), 120))
                    refused += told["op"] == "status"
                    await asyncio.sleep(0.01)
            except ConnectionClosed:
                pass
    return refused


def density_of(data: list[float], cells: int) -> NDArray[np.float64]:
    """Return the density of a tablet's image (cells, cells), of integral 1 over the square."""
    part = 50 // cells
    image = np.array(data).reshape(cells, part, cells, part).mean(axis=(1, 3))
    return np.asarray(image / image.mean())


def compare(recording: Recording, sent: list[list[float]]) -> dict[str, Any]:
    """Compare the densities that came into force with those that were deployed."""
    game = GameConfig()
    followed = [command for _, command in recording.in_force() if command.team == RED]
    densities = np.array([density_of(data, game.command_cells) for data in sent])
    differences = []
    for command in followed:
        target, _ = make_target(command.values, game.controller.modes)
        differences.append(float(np.abs(target / target.mean() - densities).max(axis=(1, 2)).min()))
    return {"deploys": len(sent), "in_force": len(followed), "largest_difference": max(differences)}


def _find(lines: Iterable[str], pattern: str) -> str:
    """Wait for a line that a table prints, and return the pattern's group."""
    return next(found[1] for line in lines if (found := re.search(pattern, line)))


async def play(python: str, folder: Path) -> dict[str, Any]:
    """Play a game with a Python's roslibpy, and return what was measured."""
    options = ["--rosbridge", "0", "--ros-opponent", "uniform", "--game.time-limit", "75"]
    with server(folder, 1.0, options) as (address, process):
        said = process.stdout or sys.stdin
        port = int(await asyncio.to_thread(_find, said, r"rosbridge is at .*:(\d+)$"))
        wire, watcher = Wire(port), Watcher()
        arguments = [python, str(_TABLET), str(await wire.lay()), "red", str(_DEPLOYS), str(_PAUSE_S), str(port)]
        tablet = await asyncio.create_subprocess_exec(*arguments, stdin=PIPE, stdout=PIPE, limit=2**26)
        room = await asyncio.to_thread(_find, said, r"plays in room (\w+)")
        watching = asyncio.create_task(watcher.watch(address, room))
        found = await _follow(tablet, wire, port, watcher)
        await wire.end()
        await asyncio.wait_for(watching, 120)
        recording = Recording.read(next(folder.glob(f"*-{room}-*.jsonl")))
        compared = compare(recording, found.pop("sent"))
        return found | {"outcome": watcher.outcome} | compared


async def _follow(tablet: Process, wire: Wire, port: int, watcher: Watcher) -> dict[str, Any]:
    assert tablet.stdout is not None and tablet.stdin is not None  # noqa: S101
    found: dict[str, Any] = {"sent": []}
    hostility: asyncio.Task[int] | None = None
    began_s = hostile_s = 0.0
    async for line in tablet.stdout:
        told = json.loads(line)
        if told.get("began"):
            found["roslibpy"], began_s = told["version"], time.monotonic()
        if "deploy" in told:
            found["sent"].append(told["data"])
            if told["deploy"] == _DEPLOYS // 2 - 1:
                await asyncio.sleep(_PAUSE_S / 2)  # between two deploys
                wire.cut()
            if told["deploy"] == _DEPLOYS * 3 // 5:
                hostile_s = time.monotonic()
                hostility = asyncio.create_task(misbehave(port))
        if told.get("deployed") and hostility is not None:
            found["refused"] = await hostility
            ended_s = time.monotonic()
            found["ticks_ms"] = {
                "before": watcher.gaps_ms(began_s + 3.0, hostile_s),
                "during": watcher.gaps_ms(hostile_s, ended_s),
            }
            await asyncio.sleep(max(began_s + 62.0 - time.monotonic(), 0.0))
            tablet.stdin.close()
        if "poses" in told:
            found["poses"] = _ages(told["poses"], watcher.made_s, began_s)
    await tablet.wait()
    return found


def _ages(poses: list[tuple[float, int]], made_s: dict[int, float], began_s: float) -> dict[str, Any]:
    """Return how old messages were when they came, in the last ten seconds of a minute, or of a shorter game."""
    end_s = min(began_s + 60.0, poses[-1][0])
    last = [(at, tick) for at, tick in poses if end_s - 10.0 <= at <= end_s]
    known = sorted(made_s)
    made = np.interp([tick for _, tick in last], known, [made_s[tick] for tick in known])
    ages = 1000.0 * (np.array([at for at, _ in last]) - made)
    return {
        "seconds": round(end_s - began_s, 1),
        "hz_of_last_10_s": len(last) / 10.0,
        "age_ms_median": round(float(np.median(ages)), 1),
        "age_ms_most": round(float(ages.max()), 1),
        "count": len(ages),
    }


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", action="append", help="a Python that has roslibpy; may be given again")
    for python in parser.parse_args().python or [sys.executable]:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(asyncio.run(play(python, Path(folder))), indent=2), flush=True)


if __name__ == "__main__":
    main()
