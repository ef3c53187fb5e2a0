"""The application: its pages, and the socket that games go through."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import itertools
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
import segno
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.server.budget import Account, Accounts, Rate
from swarm_pz.play.server.client_handler import ClientHandler
from swarm_pz.play.server.connection import SHORT, Connection
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.middleware import AccessMiddleware

if TYPE_CHECKING:
    from swarm_pz.play.server.studies import StudyHost

STATIC = Path(__file__).parents[1] / "static"
_STATUS_TICKS = 20_000
"""Latest ticks that the server's figures are taken of."""
_STATUS_AGE_S = 0.2
"""For so long the server's figures are not taken again, whoever asks."""
_SWEEP_S = 5.0
_TOLD_S = 0.5
"""A debt of so many seconds is worth a word."""
_SLOWED = "your messages cost this server more processor time than a client may use; it reads them more slowly now"
CONNECTION_S, ADDRESS_S = Rate(0.2, 0.05), Rate(3.0, 0.3)
"""Seconds of processor time that a connection may use up, and all of one address: a game in a page uses about a
thousandth of a second each second."""


class Server:
    """What clients ask for: the page, figures, recordings, and the socket that games go through.

    Parameters
    ----------
    lobby : Lobby
    study : StudyHost, optional
        The study that the table is for: its pages take the place of the start and of what was recorded.
    """

    def __init__(self, lobby: Lobby, study: StudyHost | None = None) -> None:
        self.lobby, self.study = lobby, study
        self._handlers: set[ClientHandler] = set()
        self._figures: tuple[float, dict[str, Any]] | None = None
        self.accounts = Accounts(CONNECTION_S, ADDRESS_S)

    def app(self, hosts: Sequence[str], allowed_hosts: Sequence[str] = ()) -> ASGIApp:
        """Return the application, for the names (with port) that it is served by, itself and through a proxy."""
        own = [
            Route("/", self._page),
            Route("/recordings", self._recordings),
            Route("/recordings/{name}", self._recording),
            Route("/recordings/{name}/trial", self._trial),
            Route("/invitations/{room}.svg", self._invitation),
        ]
        routes = [
            *(own if self.study is None else self.study.routes()),
            Route("/status", self._status),
            WebSocketRoute("/socket", self._socket),
            Mount("/static", StaticFiles(directory=STATIC)),
        ]
        inner = Starlette(routes=routes, lifespan=self._lifespan)
        return AccessMiddleware(inner, hosts, allowed_hosts, self.lobby.embedders, accounts=self.accounts)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[dict[str, Any]]:
        tasks = [asyncio.create_task(self._sweep())]
        if self.study is not None:
            tasks.append(asyncio.create_task(self.study.games.watch()))
        try:
            yield {"accounts": self.accounts}
        finally:
            for task in tasks:
                task.cancel()
            self.lobby.close()
            if self.study is not None:
                await self.study.games.close()

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(_SWEEP_S)
            self.sweep(time.monotonic())

    def sweep(self, now: float) -> None:
        """Close rooms that nobody is in, and connections that say nothing."""
        self.lobby.close_idle_rooms()
        self.accounts.forget(now)
        for handler in self._handlers:
            handler.close_if_silent(now)

    # --- pages ------------------------------------------------------------------------------------

    async def _page(self, _: Request) -> FileResponse:
        return FileResponse(STATIC / "index.html")

    async def _status(self, _: Request) -> JSONResponse:
        now = time.monotonic()
        if self._figures is None or now - self._figures[0] > _STATUS_AGE_S:
            self._figures = now, self._take_figures()
        return JSONResponse(self._figures[1])

    def _take_figures(self) -> dict[str, Any]:
        punctuality = self.lobby.context.punctuality
        late = np.array(list(itertools.islice(reversed(punctuality.lateness_ms), _STATUS_TICKS)))
        return {
            "rooms": len(self.lobby.rooms),
            "playing": sum(room.phase == "playing" for room in self.lobby.rooms.values()),
            "connections": len(self._handlers),
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

    async def _recordings(self, _: Request) -> Response:
        listed = await self.lobby.recordings()
        return Response(msgspec.json.encode(listed), media_type="application/json")

    async def _invitation(self, request: Request) -> Response:
        """Answer with the picture of a room's address, at one of the addresses of this page."""
        room, at = request.path_params["room"], request.query_params.get("at", "")
        here = {f"{scheme}://{request.headers.get('host', '')}/" for scheme in ("http", "https")}
        if room not in self.lobby.rooms or at not in here | {*self.lobby.addresses}:
            return PlainTextResponse("there is no such room or address here\n", 404)
        return Response(_picture_of(f"{at}#room={room}"), media_type="image/svg+xml")

    async def _recording(self, request: Request) -> FileResponse | PlainTextResponse:
        try:
            path = self.lobby.find_recording(request.path_params["name"])
        except RecordingError as error:
            return PlainTextResponse(f"{error}\n", 404)
        return FileResponse(path, media_type="application/x-ndjson")

    async def _trial(self, request: Request) -> Response:
        try:
            rows = await self.lobby.trial(request.path_params["name"])
        except RecordingError as error:
            return PlainTextResponse(f"{error}\n", 404)
        return Response(msgspec.json.encode(rows), media_type="application/json")

    # --- the socket -------------------------------------------------------------------------------

    async def _socket(self, socket: WebSocket) -> None:
        offered = socket.scope.get("subprotocols", [])
        if protocol.SUBPROTOCOL not in offered:
            await socket.close(code=1002, reason=f"expected the subprotocol {protocol.SUBPROTOCOL}")
            return
        await socket.accept(subprotocol=protocol.SUBPROTOCOL)
        address = socket.client.host if socket.client is not None else ""
        connection = Connection(socket, address)
        handler = ClientHandler(self.lobby, connection)
        account: Account = socket.scope["account"]
        self._handlers.add(handler)
        sender = asyncio.create_task(connection.run())
        try:
            while not connection.closed:
                received = await socket.receive()
                if received["type"] == "websocket.disconnect":
                    break
                text = received.get("text")
                await _turn(account, connection, len(text or ""))
                handler.hear(text)
        except WebSocketDisconnect:
            pass
        finally:
            self._handlers.discard(handler)
            handler.end()
            connection.close()
            # A peer that reads nothing any more would keep it for long.
            with contextlib.suppress(TimeoutError, asyncio.CancelledError):
                await asyncio.wait_for(sender, 2.0)


async def _turn(account: Account, connection: Connection, size: int) -> None:
    """Wait for a message's turn; who is in debt is told why. Short ones of others do not wait for their neighbours."""
    if account.debt_s() > _TOLD_S:
        connection.send(protocol.Notice(text=_SLOWED))
    await account.turn(in_line=size > SHORT)


@functools.lru_cache(maxsize=512)
def _picture_of(address: str) -> bytes:
    """Return an address as a QR code; drawn once, since all games wait for it."""
    picture = io.BytesIO()
    segno.make(address, micro=False).save(picture, kind="svg", scale=4, border=2, light="white")
    return picture.getvalue()


def _resident_mb() -> float | None:
    """Return this process's memory, where the system tells."""
    status = Path("/proc/self/status")
    if not status.exists():
        return None
    kilobytes = next(line for line in status.read_text().splitlines() if line.startswith("VmRSS")).split()[1]
    return int(kilobytes) / 1024
