"""A room's frames while clients do their worst."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import tempfile
import time
import urllib.request
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.table.clients import ACKNOWLEDGE_EVERY, CHANCE, Client, server, status
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, decode_frame
from swarm_pz.play.game import InForce, LiveGame, TableConfig
from swarm_pz.play.recordings.format import (
    FRAME_TICKS,
    VERSION,
    CommandLine,
    EndLine,
    Header,
    InForceLine,
    RecordedSeat,
    Recording,
    frame_line,
)
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.server.views import frame_of

ATTACKERS = 5
WILD = protocol.StrokeMessage("attract", 0.3, [(float(k % 2), round(float(CHANCE.random()), 3)) for k in range(330)])
DEAR = ",".join(["1e300"] * 10_900)
"""Numbers of 65 kB: some readers take four hundred times as long for them as for others."""
DEAR_COMMAND = f'{{"type":"command","number":1,"density":[[{DEAR}]]}}'
PAUSE_S = 0.055
"""Between two messages: as often as one may speak."""
ALONE, READY = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None)), protocol.Ready()
ROS_PORT = 19_090
PLAN = """
title = "Attacked"
participants = 2
codes = ["victim", "other"]
games = 1
rules = { time_limit = 300.0, capture = { enabled = false } }
[[conditions]]
title = "alone"
opponent = "uniform"
"""
SLOW = protocol.StrokeMessage("attract", 0.3, [(0.5, round(0.3 + k / 10_000, 4)) for k in range(3500)])


class Victim(Client):
    """A player in another room, who notes when each frame came."""

    def __init__(self, address: str) -> None:
        super().__init__(address)
        self.came: list[tuple[float, int]] = []

    async def _hear(self, socket: Any) -> None:
        async for data in socket:
            if isinstance(data, str):
                message = protocol.decode_server(data)
                if isinstance(message, protocol.Seated):
                    self.token, self.room = message.token, message.room
            elif data[0] == FRAME:
                frame = decode_frame(data)
                self.came.append((time.monotonic(), frame.tick))
                if len(self.came) % ACKNOWLEDGE_EVERY == 0:
                    await socket.send(protocol.encode(protocol.Acknowledge(frame.sequence)))


@contextlib.asynccontextmanager
async def _attacker(address: str, *first: protocol.ClientMessage) -> AsyncIterator[Any]:
    async with Client(address).connection() as socket:
        for message in (protocol.Hello(), *first):
            await socket.send(protocol.encode(message))

        async def listen() -> None:
            async for data in socket:
                if not isinstance(data, str) and data[0] == FRAME:
                    await socket.send(protocol.encode(protocol.Acknowledge(decode_frame(data).sequence)))

        listening = asyncio.create_task(listen())
        try:
            yield socket
        finally:
            listening.cancel()


async def _repeat(address: str, make: Callable[[int], Any], *first: protocol.ClientMessage) -> None:
    """Say something again and again, as often as one may speak."""
    async with _attacker(address, *first) as socket:
        for number in itertools.count():
            said = make(number)
            await socket.send(said if isinstance(said, str) else protocol.encode(said))
            await asyncio.sleep(PAUSE_S)


def _drawing(number: int, stroke: protocol.StrokeMessage) -> protocol.CommandMessage:
    return protocol.CommandMessage(number, strokes=[stroke])


async def _take(address: str, recording: str) -> None:
    """Take a recorded game over near its end, and begin, again and again."""
    while True:
        async with _attacker(address, protocol.OpenReplay(recording)) as socket:
            for _ in range(40):
                await socket.send(protocol.encode(protocol.Seek(8000)))
                await socket.send(protocol.encode(protocol.TakeOver("red")))
                await asyncio.sleep(0.3)
            await socket.send(protocol.encode(protocol.Ready()))
            await asyncio.sleep(0.5)


async def _fill_rooms(address: str, _: str) -> None:
    """Open rooms, begin games of many drones in them, and vanish."""
    many = protocol.Create(settings=protocol.Settings(red=200, blue=0, time_limit=None, speed=2.0))
    while True:
        async with _attacker(address, many, protocol.Ready()) as socket:
            await asyncio.sleep(0.1)
            socket.transport.abort()


async def _be_silent(address: str, _: str) -> None:
    """Hold connections that say nothing, or read nothing of a game and what they ask for."""
    async with contextlib.AsyncExitStack() as stack:
        for _ in range(50):
            await stack.enter_async_context(Client(address).connection())
        slow = await stack.enter_async_context(Client(address).connection())
        slow.transport.pause_reading()
        for message in (protocol.Hello(), ALONE, READY, *[protocol.Ping(0.0)] * 10):
            await slow.send(protocol.encode(message))
        while True:
            await slow.send(protocol.encode(protocol.Ping(0.0)))
            await asyncio.sleep(PAUSE_S)


def _seat_of_participant(address: str) -> str:
    """Begin a participant's game, and return the token of the seat."""

    def say(act: str, **said: Any) -> dict[str, Any]:
        body = json.dumps({"window": "w", "loaded": 1.0} | said).encode()
        with urllib.request.urlopen(f"http://{address}/study/victim/{act}", body, timeout=30) as answer:
            return dict(json.load(answer))

    state = say("state")
    while not (seat := state.get("game", {}).get("seat")):
        state = say("play", step=state["step"]["id"])
    return str(seat["token"] if isinstance(seat, dict) else seat)


async def _publish(_: str, __: str) -> None:
    """Publish such numbers to a rosbridge."""
    message = f'{{"op":"publish","topic":"/tablet_comm","msg":{{"team":"red","data":[{DEAR * 15}0]}}}}'
    async with connect(f"ws://127.0.0.1:{ROS_PORT}", compression=None, max_size=None) as socket:
        while True:
            await socket.send(message)
            await asyncio.sleep(PAUSE_S)


async def _request(address: str, head: str, body: str = "", more: str = "") -> None:
    """Send a request again and again."""
    host, port = address.split(":")
    length = f"Content-Length: {len(body)}\r\n" if body else ""
    reader, writer = await asyncio.open_connection(host, int(port))
    try:
        while True:
            writer.write(f"{head} HTTP/1.1\r\nHost: {address}\r\n{more}{length}\r\n{body}".encode())
            await writer.drain()
            if not await reader.read(65536):
                return
    finally:
        writer.close()


ATTACKS: dict[str, Callable[[str, str], Awaitable[None]] | None] = {
    "nothing": None,
    "drawings": lambda address, _: _repeat(address, lambda n: _drawing(n, WILD if n % 2 else SLOW), ALONE, READY),
    "seeks": lambda address, recording: _repeat(
        address, lambda _: protocol.Seek(int(CHANCE.integers(9000))), protocol.OpenReplay(recording)
    ),
    "take-overs": _take,
    "openings": lambda address, recording: _repeat(address, lambda _: protocol.OpenReplay(recording)),
    "rooms": _fill_rooms,
    "silence": _be_silent,
    "numbers": lambda address, _: _repeat(address, lambda _: DEAR_COMMAND),
    "numbers-of-a-player": lambda address, _: _repeat(address, lambda _: DEAR_COMMAND, ALONE, READY),
    "posts": lambda address, _: _request(address, "POST /study/other/state", f'{{"window":[{DEAR * 15}0]}}'),
    "rosbridge": _publish,
    "pages": lambda address, _: _request(address, "GET /"),
    "headers": lambda address, _: _request(address, "GET /", more="a:b\r\n" * 2500),
}
"""What attackers do: to a table's address, with a recorded game; drawings are as large as they may be."""


async def _again(worst: Callable[[str, str], Awaitable[None]], address: str, recording: str) -> None:
    """Come back when shown out."""
    while True:
        with contextlib.suppress(ConnectionClosed, OSError):
            await worst(address, recording)
        await asyncio.sleep(0.1)


def _record_long_game(folder: Path, drones: int) -> str:
    """Write a game of five minutes in which many drones are moved about; return the file's name."""
    captures = CaptureConfig(enabled=False)
    config = TableConfig(game=GameConfig(drones_per_team=drones, capture=captures))
    game = LiveGame(config, 0)
    seat = RecordedSeat(kind="policy", policy="uniform")
    header = Header(
        version=VERSION,
        software="",
        started="",
        table=config.to_dict(),
        seed=0,
        red=seat,
        blue=seat,
    )
    recorder = Recorder(folder / "long.jsonl", header)
    recorder.write(frame_line(frame_of(game.simulator, 0, 0.0), 0))
    while not game.over:
        if game.tick % 30 == 0:
            command = game.submit(0, game.tick + 1, CHANCE.random((10, 10)))
            recorder.write(CommandLine(0, command.number, command.values.tolist(), 0.0, tick=game.tick))
        for event in game.advance():
            if isinstance(event, InForce):
                recorder.write(InForceLine(0, event.command.number, event.tick, 0.0))
        if game.tick % FRAME_TICKS == 0:
            recorder.write(frame_line(frame_of(game.simulator, 0, 0.0), game.tick))
    recorder.write(EndLine("draw", game.tick, game.sizes, 0.0, ended_by="time"))
    recorder.close()
    while not recorder.written:
        time.sleep(0.01)
    found = Playback(Recording.read(recorder.path)).verify()
    assert found.verified, found  # noqa: S101
    return recorder.path.name


async def attack(seconds: float, drones: int, names: Sequence[str] = ()) -> None:
    """Play a room beside five clients that do their worst, and print how its frames came."""
    for name in names or ATTACKS:
        worst = ATTACKS[name]
        with tempfile.TemporaryDirectory() as folder:
            recording = _record_long_game(Path(folder), drones)
            plan = Path(folder) / "study.toml"
            plan.write_text(PLAN)
            is_study = name == "posts"
            what = ["study", "run", str(plan), "--folder"] if is_study else ["play", "--out"]
            options = [] if is_study else ["--rosbridge", str(ROS_PORT)]
            with server(Path(folder) / "data" if is_study else Path(folder), options=options, what=what) as (
                address,
                _,
            ):
                stop, victim = asyncio.Event(), Victim(address)
                if is_study:
                    victim.token = await asyncio.to_thread(_seat_of_participant, address)
                tasks = [asyncio.create_task(victim.play([ALONE, READY], stop))]
                await asyncio.sleep(2.0)
                worked = [asyncio.create_task(_again(worst, address, recording)) for _ in range(ATTACKERS) if worst]
                victim.came.clear()
                await asyncio.sleep(seconds)
                times, ticks = np.array(victim.came).T
                figures = await asyncio.to_thread(status, address)
                for task in worked:
                    task.cancel()
                await asyncio.gather(*worked, return_exceptions=True)
                stop.set()
                await asyncio.gather(*tasks, return_exceptions=True)
        gaps = 1000 * np.diff(times)
        p50, p99 = np.quantile(gaps, [0.5, 0.99])
        lost, played = int((np.diff(ticks) - 1).sum()), int(ticks[-1] - ticks[0])
        late = figures["lateness_ms"]["p99"]
        print(f"{name:10}  gaps: median {p50:.0f} ms, 99 % {p99:.0f} ms, most {gaps.max():.0f} ms; ", end="")
        print(f"{lost} of {played} ticks not shown; ticks late 99 % {late:.1f} ms, ", end="")
        print(
            f"slipped {figures['slipped']} times; {figures['rooms']} rooms, {figures['memory_mb']:.0f} MB", flush=True
        )
