"""The table under load, and how fast it answers: a server in a process of its own, its clients in this one.

python -m benchmarks.table load --seconds 60          30 rooms, two clients each
python -m benchmarks.table latency --sends 200        a page: from pointer-up to what is seen
python -m benchmarks.table smooth --drones 100        a page: gaps between paintings
python -m benchmarks.table soak --seconds 3600        10 rooms with clients that drop, return, flood and send garbage
python -m benchmarks.table begin                      every policy: how long it loads, and its first command
python -m benchmarks.table attack --seconds 10        a room's frames while five clients do their worst
python -m benchmarks.table rings --games 20           a page: draws rings as slowly as a person, against uniform
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from websockets import Subprotocol
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

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
from swarm_pz.play.server.policy_workers import MOST_PROCESSES
from swarm_pz.play.server.views import frame_of
from swarm_pz.policies import names

ACKNOWLEDGE_EVERY = 4
CHANCE = np.random.default_rng(0)
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update")


@contextlib.contextmanager
def server(folder: Path, countdown_s: float = 0.0, **environment: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Start a server, whose games begin at once unless told otherwise, and give its address and process."""
    command = [sys.executable, "-u", "-c", "from swarm_pz.cli import main; main()"]
    command += ["play", "--port", "0", "--countdown", str(countdown_s), "--out", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | environment) as process:  # noqa: S603
        printed = process.stdout or sys.stdin
        try:
            said = next(line for line in printed if "http://" in line)
            yield said.split("http://")[1].strip().rstrip("/"), process
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(20)


def status(address: str) -> dict[str, Any]:
    """Return the server's own figures."""
    with urllib.request.urlopen(f"http://{address}/status", timeout=30) as answer:
        return dict(json.load(answer))


# --- load and soak ----------------------------------------------------------------------------------


class Client:
    """One client that plays, or watches, and acknowledges frames."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.token: str | None = None
        self.room = ""
        self.seat: protocol.Side | None = None
        self.frames = 0
        self.ages: list[float] = []
        self.socket: Any = None

    def connection(self) -> Any:
        """Return a connection, to be entered."""
        protocols = [Subprotocol(protocol.SUBPROTOCOL)]
        return connect(
            f"ws://{self.address}/socket", subprotocols=protocols, compression=None, max_size=None, close_timeout=1
        )

    async def play(self, first: list[protocol.ClientMessage], stop: asyncio.Event) -> None:
        """Say some messages, command at random until told to stop, and leave; come back when displaced or dropped."""
        while not stop.is_set():
            async with self.connection() as socket:
                self.socket = socket
                await socket.send(protocol.encode(protocol.Hello(token=self.token)))
                for message in first if self.token is None else []:
                    await socket.send(protocol.encode(message))
                tasks = [asyncio.create_task(work) for work in (self._talk(socket), stop.wait(), self._hear(socket))]
                await asyncio.wait(tasks[1:], return_when=asyncio.FIRST_COMPLETED)
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
            await asyncio.sleep(0.5)
        async with self.connection() as socket:
            await socket.send(protocol.encode(protocol.Hello(token=self.token)))
            await socket.send(protocol.encode(protocol.Leave()))

    async def _hear(self, socket: Any) -> None:
        async for data in socket:
            if isinstance(data, str):
                message = protocol.decode_server(data)
                if isinstance(message, protocol.Displaced):
                    return
                if isinstance(message, protocol.Seated):
                    self.token, self.room, self.seat = message.token, message.room, message.seat
                elif isinstance(message, protocol.RoomState):
                    self.room = message.code
                    own = {"red": message.red, "blue": message.blue}[self.seat] if self.seat is not None else None
                    if own is not None and not own.ready and message.phase in ("waiting", "over"):
                        await socket.send(protocol.encode(protocol.Ready()))
            elif data[0] == FRAME:
                self.frames += 1
                if self.frames % ACKNOWLEDGE_EVERY == 0:
                    await socket.send(protocol.encode(protocol.Acknowledge(decode_frame(data).sequence)))

    async def _talk(self, socket: Any) -> None:
        number = 0
        await asyncio.sleep(CHANCE.random())
        while True:
            number += 1
            x, y = CHANCE.random(), CHANCE.random()
            points = [(x + 0.2 * np.cos(a / 6), y + 0.2 * np.sin(a / 6)) for a in range(38)]
            stroke = protocol.StrokeMessage("attract", 0.1, [(float(px), float(py)) for px, py in points])
            await socket.send(protocol.encode(protocol.CommandMessage(number, strokes=[stroke])))
            await asyncio.sleep(CHANCE.uniform(0.5, 2.0))


async def fill(address: str, stop: asyncio.Event, kinds: list[str | None]) -> tuple[list[Client], list[Any]]:
    """Open a room for each opponent, None for a person, with two clients in each."""
    clients: list[Client] = []
    tasks = []
    for opponent in kinds:
        host, guest = Client(address), Client(address)
        create = protocol.Create(settings=protocol.Settings(time_limit=None), opponent=opponent)
        tasks.append(asyncio.create_task(host.play([create, protocol.Ready()], stop)))
        while not host.room:
            await asyncio.sleep(0.02)
        seat: Any = "watch" if opponent is not None else "blue"
        first: list[protocol.ClientMessage] = [protocol.Join(host.room, seat)]
        if opponent is None:
            first.append(protocol.Ready())
        tasks.append(asyncio.create_task(guest.play(first, stop)))
        clients += [host, guest]
    return clients, tasks


async def load(seconds: float, learned: str) -> None:
    """Play 30 rooms, and print how punctual they were."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _):
        stop = asyncio.Event()
        clients, tasks = await fill(address, stop, [None, "uniform", learned] * 10)
        await asyncio.sleep(5.0)
        before = [client.frames for client in clients]
        began = time.monotonic()
        await asyncio.sleep(seconds)
        spent = time.monotonic() - began
        rates = [(client.frames - count) / spent for client, count in zip(clients, before, strict=True)]
        figures = await asyncio.to_thread(status, address)
        stop.set()
        await asyncio.gather(*tasks, return_exceptions=True)
    print(json.dumps(figures, indent=2))
    print(f"frames a second and client: {min(rates):.2f} to {max(rates):.2f}, mean {np.mean(rates):.2f}")


async def soak(seconds: float, rooms: int = 10) -> dict[str, Any]:
    """Play rooms with clients that drop, return, flood and send garbage; return what became of them."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _):
        stop = asyncio.Event()
        first = min(rooms, MOST_PROCESSES)
        _, tasks = await fill(address, stop, ["uniform"] * first)
        while (await asyncio.to_thread(status, address))["playing"] < first:
            await asyncio.sleep(0.5)  # first games start what then stays: the processes in which policies think
        idle = await _end(stop, tasks, address)
        stop = asyncio.Event()
        clients, tasks = await fill(address, stop, (["uniform", None] * rooms)[:rooms])
        began, readings = time.monotonic(), []
        while (spent := time.monotonic() - began) < seconds:
            victims = CHANCE.choice(len(clients), 3, replace=False)
            await asyncio.gather(*[_misbehave(clients[victim]) for victim in victims], return_exceptions=True)
            figures = await asyncio.to_thread(status, address)
            readings.append((spent, figures))
            names = ("rooms", "playing", "connections", "tasks", "open_files", "memory_mb", "lateness_ms")
            print(f"{spent:6.0f} s  " + "  ".join(f"{name} {figures[name]}" for name in names), flush=True)
            await asyncio.sleep(min(10.0, seconds / 20))
        frames = [client.frames for client in clients]
        for _ in range(30):  # until those who are on their way back are back
            await asyncio.sleep(1.0)
            silent = sum(client.frames == before for client, before in zip(clients, frames, strict=True))
            if not silent:
                break
        after = await _end(stop, tasks, address, idle)
        early = next(figures for spent, figures in readings if spent >= seconds / 6)
        paths = list(Path(folder).glob("*.jsonl"))
        return {
            "rooms_lost": rooms - readings[-1][1]["rooms"],
            "clients_without_frames": silent,
            "memory_ratio": readings[-1][1]["memory_mb"] / early["memory_mb"],
            "tasks_left": after["tasks"] - idle["tasks"],
            "rooms_left": after["rooms"],
            "connections_left": after["connections"],
            "files_left": after["open_files"] - idle["open_files"],
            "recordings": len([Recording.read(path) for path in paths]),
            "lateness_ms": after["lateness_ms"],
        }


async def _end(
    stop: asyncio.Event, tasks: list[Any], address: str, idle: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Let clients leave, and return the server's figures once they are gone, and it is as idle as before."""
    stop.set()
    await asyncio.gather(*tasks, return_exceptions=True)
    for _ in range(30):
        await asyncio.sleep(2.0)  # what has not been sent to who is gone is given up after as long
        figures = await asyncio.to_thread(status, address)
        is_empty = figures["rooms"] == figures["connections"] == 0
        if is_empty and (idle is None or all(figures[name] <= idle[name] for name in ("tasks", "open_files"))):
            break
    return figures


async def _misbehave(victim: Client) -> None:
    """Drop a player's connection, take its seat for a moment, or come as somebody who does what one should not."""
    what = str(CHANCE.choice(["vanish", "take", "flood", "garbage", "claim", "oversized"]))
    if what == "vanish":
        victim.socket.transport.abort()
        return
    async with Client(victim.address).connection() as socket:
        await socket.send(protocol.encode(protocol.Hello(token=victim.token if what == "take" else None)))
        if what == "flood":
            for number in range(300):
                await socket.send(protocol.encode(protocol.Ping(number)))
        elif what == "garbage":
            for _ in range(50):
                await socket.send(CHANCE.bytes(CHANCE.integers(200)))
                await socket.send("".join(map(chr, CHANCE.integers(32, 1000, size=CHANCE.integers(200)))))
        elif what == "claim":
            await socket.send(protocol.encode(protocol.Join(victim.room, "red")))
            await socket.send(protocol.encode(protocol.Hello(token="0" * 32)))
        elif what == "oversized":
            await socket.send("x" * 100_000)
        await asyncio.sleep(0.5)


# --- beginnings -------------------------------------------------------------------------------------


async def _begin(address: str, policy: str) -> tuple[float, str]:
    """Watch a policy against itself for two seconds; return for how long it loaded, and the game's recording."""
    loading_s = 0.0
    async with Client(address).connection() as socket:
        settings = protocol.Settings(time_limit=2.0)
        for message in (
            protocol.Hello(),
            protocol.Create(settings=settings, seat="watch", player=policy, opponent=policy),
            protocol.Ready(),
        ):
            await socket.send(protocol.encode(message))
        began = time.monotonic()
        async for data in socket:
            if isinstance(data, bytes):
                await socket.send(protocol.encode(protocol.Acknowledge(decode_frame(data).sequence)))
                continue
            room = protocol.decode_server(data)
            if not isinstance(room, protocol.RoomState):
                continue
            if "failed" in (room.red.policy_state, room.blue.policy_state):
                raise SystemExit(f"{policy} was not loaded: {room.red.reason or room.blue.reason}")
            if room.phase == "starting" and not loading_s:
                loading_s = time.monotonic() - began
            if room.recording is not None:
                return loading_s, room.recording
    raise SystemExit("the table closed the connection")


async def begin() -> None:
    """Begin a game of every policy, with an empty kernel cache; print when their first commands counted."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as cache:
        began = time.monotonic()
        with server(Path(folder), 3.0, NUMBA_CACHE_DIR=cache) as (address, _):
            print(f"the server was there after {time.monotonic() - began:.1f} s")
            for policy in names():
                loading_s, recording = await _begin(address, policy)
                read = Recording.read(Path(folder) / recording)
                sent = {line.team: line.received_ms for line in reversed(read.of(CommandLine))}
                ticks = {line.team: line.tick for line in reversed(read.of(InForceLine))}
                print(
                    f"{policy:12}  both loaded after {loading_s:5.1f} s; first commands given at {sent[0]:6.0f} and "
                    f"{sent[1]:6.0f} ms of the game's clock, in force at ticks {ticks[0]} and {ticks[1]}",
                    flush=True,
                )


# --- attacks ----------------------------------------------------------------------------------------

ATTACKERS = 5
WILD = protocol.StrokeMessage("attract", 0.3, [(float(k % 2), round(float(CHANCE.random()), 3)) for k in range(330)])
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


async def _draw(address: str, _: str) -> None:
    """Send drawings as large as they may be, as often as one may speak."""
    alone = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
    async with _attacker(address, alone, protocol.Ready()) as socket:
        for number in itertools.count():
            strokes = [WILD] if number % 2 else [SLOW]
            await socket.send(protocol.encode(protocol.CommandMessage(number, strokes=strokes)))
            await asyncio.sleep(0.055)


async def _seek(address: str, recording: str) -> None:
    """Jump about in a recorded game."""
    async with _attacker(address, protocol.OpenReplay(recording)) as socket:
        while True:
            await socket.send(protocol.encode(protocol.Seek(int(CHANCE.integers(9000)))))
            await asyncio.sleep(0.055)


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


async def _open(address: str, recording: str) -> None:
    """Open a recorded game, and another before it is there."""
    async with _attacker(address) as socket:
        while True:
            await socket.send(protocol.encode(protocol.OpenReplay(recording)))
            await asyncio.sleep(0.055)


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
        alone = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
        slow = await stack.enter_async_context(Client(address).connection())
        slow.transport.pause_reading()
        for message in (protocol.Hello(), alone, protocol.Ready(), *[protocol.Ping(0.0)] * 10):
            await slow.send(protocol.encode(message))
        while True:
            await slow.send(protocol.encode(protocol.Ping(0.0)))
            await asyncio.sleep(0.055)


ATTACKS: dict[str, Callable[[str, str], Awaitable[None]] | None] = {
    "nothing": None,
    "drawings": _draw,
    "seeks": _seek,
    "take-overs": _take,
    "openings": _open,
    "rooms": _fill_rooms,
    "silence": _be_silent,
}


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
        config_hash=config.hash,
        rules_hash=config.game.rules_hash,
        seed=0,
        red=seat,
        blue=seat,
    )
    recorder = Recorder(folder / "long.jsonl", header)
    recorder.write(frame_line(frame_of(game.simulator, 0, 0.0), 0))
    while not game.over:
        if game.tick % 30 == 0:
            command = game.submit(0, game.tick + 1, CHANCE.random((10, 10)))
            recorder.write(CommandLine(0, command.number, command.density.tolist(), 0.0, tick=game.tick))
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


async def attack(seconds: float, drones: int) -> None:
    """Play a room beside five clients that do their worst, and print how its frames came."""
    for name, worst in ATTACKS.items():
        with tempfile.TemporaryDirectory() as folder:
            recording = _record_long_game(Path(folder), drones)
            with server(Path(folder)) as (address, _):
                stop, victim = asyncio.Event(), Victim(address)
                alone = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
                tasks = [asyncio.create_task(victim.play([alone, protocol.Ready()], stop))]
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


# --- a page -----------------------------------------------------------------------------------------

WATCH = """() => {
    const arena = document.getElementById("arena");
    window.seen = { up: [], target: [], frames: [], ages: [] };
    arena.addEventListener("pointerup", () => seen.up.push(performance.now()), true);
    new MutationObserver((changes) => {
        for (const { attributeName } of changes) {
            if (attributeName === "data-target") seen.target.push([Number(arena.dataset.target), performance.now()]);
            if (attributeName === "data-tick") {
                seen.frames.push([Number(arena.dataset.tick), performance.now()]);
                seen.ages.push(Number(arena.dataset.age));
            }
        }
    }).observe(arena, { attributes: true });
}"""


@contextlib.contextmanager
def page(address: str, hash_: str, width: int = 900, height: int = 700) -> Iterator[Any]:
    """Open the table's page in a browser."""
    from playwright.sync_api import sync_playwright

    executable = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=executable, args=FLAGS)
        opened = browser.new_page(viewport={"width": width, "height": height})
        opened.goto(f"http://{address}/#{hash_}")
        yield opened
        browser.close()


def draw_ring(opened: Any, x: float, y: float, radius: float, points: int = 24) -> None:
    """Draw a ring with the mouse, in map widths."""
    box = opened.locator("#arena").bounding_box()
    for k in range(points + 1):
        angle = 2 * np.pi * k / points
        px = box["x"] + (x + radius * np.cos(angle)) * box["width"]
        py = box["y"] + (1 - y - radius * np.sin(angle)) * box["height"]
        opened.mouse.move(px, py)
        if k == 0:
            opened.mouse.down()
    opened.mouse.up()


def latency(sends: int) -> None:
    """Send at random moments, and print how long it takes until it is seen."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _):
        with page(address, "play=none") as opened:
            opened.wait_for_selector("#send:not([disabled])")
            opened.locator("#on-lift").check()
            opened.evaluate(WATCH)
            for _ in range(sends):
                x, y = CHANCE.uniform(0.3, 0.7, 2)
                draw_ring(opened, float(x), float(y), 0.2, 6)
                opened.wait_for_timeout(600 + 400 * CHANCE.random())
            seen = opened.evaluate("seen")
        (path,) = Path(folder).glob("*.jsonl")
        events = [json.loads(line) for line in path.read_text().splitlines()]
    arrived = {e["number"]: e["received_ms"] for e in events if e["type"] == "command"}
    timing = {e["number"]: e["timing"] for e in events if e["type"] == "command"}
    forced = {e["number"]: (e["tick"], e["ms"]) for e in events if e["type"] == "in_force"}
    targets = dict(map(tuple, reversed(seen["target"])))  # when each was first painted
    to_target, to_force, to_frame = [], [], []
    for number in sorted(forced.keys() & targets.keys() & timing.keys()):
        up = max(at for at in seen["up"] if at <= timing[number]["sent_ms"])
        to_target.append(targets[number] - up)
        sent = timing[number]["sent_ms"] - up + timing[number]["round_trip_ms"] / 2
        to_force.append(sent + forced[number][1] - arrived[number])
        to_frame.append(next(at for tick, at in seen["frames"] if tick > forced[number][0]) - up)
    for name, values in (
        ("acknowledged target painted", to_target),
        ("in force", to_force),
        ("changed frame", to_frame),
    ):
        p50, p95 = np.quantile(values, [0.5, 0.95])
        print(f"pointer-up to {name}: median {p50:.0f} ms, 95 % {p95:.0f} ms, of {len(values)}")
    _print_gaps(seen)


def _print_gaps(seen: dict[str, Any]) -> None:
    ticks, times = np.array(seen["frames"]).T
    gaps = np.diff(times)
    rate = 1000 * (ticks[-1] - ticks[0]) / (times[-1] - times[0])
    print(
        f"paintings of new frames: gaps 95 % {np.quantile(gaps, 0.95):.0f} ms, most {gaps.max():.0f} ms; "
        f"{rate:.2f} ticks a second shown; oldest frame painted {max(seen['ages'])} ms"
    )


def smooth(drones: int, seconds: float) -> None:
    """Watch a game with this many drones a team, stall the page for 20 s, and print gaps and ages."""
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _), page(address, "") as opened:
        opened.wait_for_selector("#opponent option", state="attached")
        opened.click("#more summary")
        opened.fill("#red-drones", str(drones))
        opened.fill("#blue-drones", str(drones))
        opened.click("#create button[type=submit]")
        opened.click("#ready")
        opened.wait_for_selector("#cover", state="hidden")
        opened.wait_for_timeout(1000)
        opened.evaluate(WATCH)
        opened.wait_for_timeout(1000 * seconds)
        _print_gaps(opened.evaluate("seen"))
        opened.evaluate("() => { seen.frames = []; seen.ages = []; }")
        opened.evaluate("() => { const end = performance.now() + 20000; while (performance.now() < end); }")
        opened.wait_for_timeout(3000)
        print("after a stall of 20 s:")
        _print_gaps(opened.evaluate("seen"))


OTHERS = """() => {
    const canvas = document.getElementById("drones"), side = canvas.width;
    const { data } = canvas.getContext("2d").getImageData(0, 0, side, side);
    let count = 0, x = 0, y = 0;
    for (let i = 0; i < data.length; i += 4) {
        if (data[i + 3] > 200 && data[i + 2] > 180 && data[i] < 90) {
            count += 1;
            x += i / 4 % side;
            y += Math.floor(i / 4 / side);
        }
    }
    return count ? [x / count / side, 1 - y / count / side] : null;
}"""


def rings(games: int) -> None:
    """Draw rings where the blue pixels were 0.6 s ago, every 2 s or more, against uniform coverage."""
    standing = {"won": 0, "drawn": 0, "lost": 0}
    with tempfile.TemporaryDirectory() as folder, server(Path(folder)) as (address, _):
        for _ in range(games):
            with page(address, "play=uniform", 700, 500) as opened:
                opened.wait_for_selector("#send:not([disabled])")
                while not opened.locator("#recording").is_visible():
                    began = time.monotonic()
                    place = opened.evaluate(OTHERS)
                    opened.wait_for_timeout(600)
                    if place is not None and opened.locator("#send").is_enabled():
                        draw_ring(opened, *place, 0.2)
                        if opened.locator("#send").is_enabled():
                            opened.click("#send")
                    opened.wait_for_timeout(max(0.0, 2000 - 1000 * (time.monotonic() - began)))
                text = opened.inner_text("#cover-text")
                standing["won" if "You won" in text else "lost" if "You lost" in text else "drawn"] += 1
                print(text, standing, flush=True)
        paths = sorted(Path(folder).glob("*.jsonl"))
        verified = sum(Playback(Recording.read(path)).verify().verified for path in paths)
    print(f"{standing}; {verified} of {len(paths)} recordings verify")


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["load", "attack", "latency", "smooth", "soak", "begin", "rings"])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--sends", type=int, default=200)
    parser.add_argument("--drones", type=int, default=10, help="a team")
    parser.add_argument("--games", type=int, default=20)
    parser.add_argument("--learned", default="champion")
    options = parser.parse_args()
    if options.what == "load":
        asyncio.run(load(options.seconds, options.learned))
    elif options.what == "attack":
        asyncio.run(attack(options.seconds, options.drones))
    elif options.what == "soak":
        print(json.dumps(asyncio.run(soak(options.seconds)), indent=2))
    elif options.what == "begin":
        asyncio.run(begin())
    elif options.what == "latency":
        latency(options.sends)
    elif options.what == "smooth":
        smooth(options.drones, options.seconds)
    else:
        rings(options.games)


if __name__ == "__main__":
    main()
