"""A server in a process of its own, and clients of it."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from websockets import Subprotocol
from websockets.asyncio.client import connect

from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, decode_frame

ACKNOWLEDGE_EVERY = 4
CHANCE = np.random.default_rng(0)


@contextlib.contextmanager
def server(
    folder: Path,
    countdown_s: float = 0.0,
    options: Sequence[str] = (),
    what: Sequence[str] = ("play", "--out"),
    **environment: str,
) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Start a server, whose games begin at once unless told otherwise, and give its address and process."""
    command = [sys.executable, "-u", "-c", "from swarm_pz.cli import main; main()"]
    command += [*what, str(folder), "--port", "0", "--countdown", str(countdown_s), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | environment) as process:  # noqa: S603
        printed = process.stdout or sys.stdin
        try:
            said = next(line for line in printed if "http://" in line)
            yield said.split("http://")[1].strip().partition("/")[0], process
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(20)


def status(address: str) -> dict[str, Any]:
    """Return the server's own figures."""
    with urllib.request.urlopen(f"http://{address}/status", timeout=30) as answer:
        return dict(json.load(answer))


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
