"""The server: its pages, the socket that everything goes through, and all rooms."""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import itertools
import logging
import secrets
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.recordings.format import checked_name
from swarm_pz.play.server.client_handler import Visit
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.live_session import House, Moment
from swarm_pz.play.server.middleware import Guard
from swarm_pz.play.server.replay_session import Film
from swarm_pz.play.server.room import RefusedError, Room, Seat

STATIC = Path(__file__).parents[1] / "static"
MOST_ROOMS = 100
_IDLE_S = 600.0
"""Seconds after which a room without anybody is closed."""
_STATUS_TICKS = 20_000
"""Latest ticks that the server's figures are taken of."""
_PATIENCE = 100
"""Refusals in a row after which a client is shown out."""
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
log = logging.getLogger("swarm_pz.play")


class Server:
    """All rooms, and the clients that come to them.

    Parameters
    ----------
    house : House
    policies : mapping of str to str
        What may be given a seat, with a line about each.

    Attributes
    ----------
    rooms : dict of str to Room
        By code.
    """

    def __init__(self, house: House, policies: Mapping[str, str]) -> None:
        self.house = house
        self.rooms: dict[str, Room] = {}
        self.connections: set[Connection] = set()
        self._reading = asyncio.Lock()
        self._policies = [protocol.PolicyInfo(name=name, about=text) for name, text in policies.items()]

    def app(self, hosts: Sequence[str]) -> ASGIApp:
        """Return the application, for the names (with port) that it is served by."""
        routes = [
            Route("/", self._page),
            Route("/status", self._status),
            Route("/recordings/{name}", self._recording),
            WebSocketRoute("/socket", self._socket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
        return Guard(Starlette(routes=routes, lifespan=self._lifespan), hosts)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        sweeper = asyncio.create_task(self._sweep())
        try:
            yield
        finally:
            sweeper.cancel()
            for room in list(self.rooms.values()):
                self.close_room(room)
            self.house.thinkers.close()

    async def _sweep(self) -> None:
        """Close rooms that nobody has been in for a while."""
        while True:
            await asyncio.sleep(5.0)
            now = time.monotonic()
            for room in list(self.rooms.values()):
                room.free_absent()
                if room.connections:
                    room.last_used = now
                if room.abandoned or now - room.last_used > _IDLE_S:
                    self.close_room(room)

    def close_room(self, room: Room) -> None:
        """End a room's game and forget it."""
        self.rooms.pop(room.code, None)
        try:
            room.stop()
        except Exception:  # whatever is wrong with one room is not the others' affair
            log.exception("room %s did not close well", room.code)

    # --- pages ------------------------------------------------------------------------------------

    async def _page(self, _: Request) -> FileResponse:
        return FileResponse(STATIC / "index.html")

    async def _status(self, _: Request) -> JSONResponse:
        punctuality = self.house.punctuality
        late = np.array(list(itertools.islice(reversed(punctuality.lateness_ms), _STATUS_TICKS)))
        figures: dict[str, Any] = {
            "rooms": len(self.rooms),
            "playing": sum(room.phase == "playing" for room in self.rooms.values()),
            "connections": len(self.connections),
            "tasks": len(asyncio.all_tasks()),
            "open_files": len(list(Path("/proc/self/fd").iterdir())) if Path("/proc/self/fd").exists() else None,
            "memory_mb": _resident_mb(),
            "ticks": len(punctuality.lateness_ms),
            "lateness_ms": {
                "p50": float(np.quantile(late, 0.5)),
                "p99": float(np.quantile(late, 0.99)),
                "max": float(late.max()),
            }
            if len(late)
            else None,
            "most_caught_up": punctuality.most_caught_up,
            "slipped": punctuality.slipped,
        }
        return JSONResponse(figures)

    async def _recording(self, request: Request) -> FileResponse | PlainTextResponse:
        try:
            path = self.find_recording(request.path_params["name"])
        except RecordingError as error:
            return PlainTextResponse(f"{error}\n", 404)
        return FileResponse(path, media_type="application/x-ndjson")

    # --- the socket -------------------------------------------------------------------------------

    async def _socket(self, socket: WebSocket) -> None:
        if protocol.SUBPROTOCOL not in socket.scope.get("subprotocols", []):
            await socket.close(code=1002, reason=f"expected the subprotocol {protocol.SUBPROTOCOL}")
            return
        await socket.accept(subprotocol=protocol.SUBPROTOCOL)
        connection = Connection(socket)
        visit = Visit(self, connection)
        self.connections.add(connection)
        sender = asyncio.create_task(connection.run())
        try:
            refusals = 0
            while not connection.closed and refusals < _PATIENCE:
                received = await socket.receive()
                if received["type"] == "websocket.disconnect":
                    break
                refusals = 0 if visit.hear(received.get("text")) else refusals + 1
        except WebSocketDisconnect:
            pass
        finally:
            self.connections.discard(connection)
            visit.end()
            connection.close()
            # A peer that reads nothing any more would keep it for long.
            with contextlib.suppress(TimeoutError, asyncio.CancelledError):
                await asyncio.wait_for(sender, 2.0)

    def seat_of(self, token: str) -> tuple[Room, Seat] | None:
        """Return the seat that a token opens."""
        for room in self.rooms.values():
            for seat in room.seats:
                if seat.token and secrets.compare_digest(seat.token, token):
                    return room, seat
        return None

    def find_recording(self, name: str) -> Path:
        """Return the file of a recorded game that is over: others may not see what a player draws.

        Raises
        ------
        RecordingError
            If there is none of that name.
        """
        path = self.house.folder / checked_name(name)
        running = {room.session.recorder.path for room in self.rooms.values() if room.session and not room.outcome}
        if not path.is_file() or path in running:
            raise RecordingError(f"there is no recording {name} here")
        return path

    async def read(self, name: str) -> Film:
        """Return a recorded game, played through; one at a time, since it takes a core.

        Raises
        ------
        RecordingError
            If there is none of that name, or it cannot be read.
        """
        path = self.find_recording(name)
        async with self._reading:
            return await asyncio.to_thread(Film.read, path)

    def open_room(self, settings: protocol.Settings, moment: Moment | None = None) -> Room:
        """Return a new room, perhaps one in which a recorded game goes on.

        Raises
        ------
        RefusedError
            If there are too many, or there is no such game.
        """
        if len(self.rooms) >= MOST_ROOMS:
            raise RefusedError("full", f"this server has {MOST_ROOMS} rooms and no more; try again later")
        code = ""
        while not code or code in self.rooms:
            code = "".join(secrets.choice(_LETTERS) for _ in range(4))
        try:
            self.rooms[code] = Room(code, settings, self.house, moment)
        except ConfigError as error:
            raise RefusedError("not_valid", str(error)) from error
        return self.rooms[code]

    def check_policy(self, name: str) -> str:
        """Return a policy's name, or refuse one that may not be given a seat."""
        if name not in {policy.name for policy in self._policies}:
            raise RefusedError("unknown", f"there is no policy {name[:80]!r} here")
        return name

    def welcome(self) -> protocol.Welcome:
        """Return what every client is told first."""
        return protocol.Welcome(
            version=importlib.metadata.version("swarm-pz"),
            policies=self._policies,
            min_command_interval=self.house.table.min_command_interval,
            command_cells=self.house.table.game.command_cells,
            server_ms=self.house.now_ms(),
        )


def _resident_mb() -> float | None:
    """Return this process's memory, where the system tells."""
    status = Path("/proc/self/status")
    if not status.exists():
        return None
    kilobytes = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS")).split()[1]
    return int(kilobytes) / 1024
