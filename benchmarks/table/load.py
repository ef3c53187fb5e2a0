"""Many rooms at once, and for long."""

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
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.server.policy_workers import MOST_PROCESSES


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
