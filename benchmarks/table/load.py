"""Many rooms at once, for long, and how games begin."""

from __future__ import annotations

import asyncio
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table.clients import CHANCE, Client, fill, server, status
from swarm_pz.play import protocol
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.recordings.format import (
    CommandLine,
    InForceLine,
    Recording,
)
from swarm_pz.play.server.policy_workers import MOST_PROCESSES
from swarm_pz.policies import names


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
