"""The application: its pages, and the socket that games go through."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import secrets
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import segno
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp
from starlette.websockets import WebSocket

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.server.client_handler import ClientHandler
from swarm_pz.play.server.connection import Connection, RefusedError
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.middleware import AccessMiddleware, page
from swarm_pz.play.server.robots import PATH
from swarm_pz.play.site import STATIC

if TYPE_CHECKING:
    from swarm_pz.play.server.studies import StudyHost

_SWEEP_S = 1.0


class Server:
    """The server: its pages, its figures, recordings, and the WebSocket of games.

    - `study`: its pages take the place of the start page and the recordings.
    """

    def __init__(self, lobby: Lobby, study: StudyHost | None = None) -> None:
        self.lobby, self.study = lobby, study
        self._handlers: set[ClientHandler] = set()

    def app(self, hosts: Sequence[str], allowed_hosts: Sequence[str] = ()) -> ASGIApp:
        """Return the application, for its own names (with port) and those of a proxy."""
        own = [
            page("/", STATIC / "index.html"),
            Route("/recordings", self._recordings),
            Route("/recordings/{name}", self._recording),
            Route("/invitations/{room}.svg", self._invitation),
        ]
        routes = [
            *(own if self.study is None else self.study.routes()),
            Route("/status", self._status),
            WebSocketRoute("/socket", self._socket),
            WebSocketRoute(PATH, self._robots),
            Mount("/static", GZipMiddleware(StaticFiles(directory=STATIC))),
        ]
        inner = Starlette(routes=routes, lifespan=self._lifespan, exception_handlers={RecordingError: _not_found})
        return AccessMiddleware(inner, hosts, allowed_hosts, self.lobby.embedders)

    @contextlib.asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[dict[str, Any]]:
        sweeping = asyncio.create_task(self._sweep())
        try:
            yield {}
        finally:
            sweeping.cancel()
            self.lobby.close()
            if self.study is not None:
                await self.study.games.close()

    async def _sweep(self) -> None:
        while True:
            await asyncio.sleep(_SWEEP_S)
            self.sweep(time.monotonic())

    def sweep(self, now: float) -> None:
        """Close empty rooms, silent connections, and games of a study that a participant has left."""
        self.lobby.close_idle_rooms()
        if self.study is not None:
            self.study.games.look()
        for handler in self._handlers:
            handler.close_if_silent(now)

    async def _socket(self, socket: WebSocket) -> None:
        if protocol.SUBPROTOCOL not in socket.scope.get("subprotocols", []):
            await socket.close(code=1002, reason=f"expected the subprotocol {protocol.SUBPROTOCOL}")
            return
        await socket.accept(subprotocol=protocol.SUBPROTOCOL)
        address = socket.client.host if socket.client is not None else ""
        handler = ClientHandler(self.lobby, Connection(socket, address))
        self._handlers.add(handler)
        try:
            await handler.serve(socket)
        finally:
            self._handlers.discard(handler)

    async def _robots(self, socket: WebSocket) -> None:
        robots, token = self.lobby.context.robots, socket.query_params.get("token", "")
        if robots is None or not secrets.compare_digest(token.encode(), robots.token.encode()):
            await socket.close(code=1008)
            return
        await robots.serve(socket)

    # --- pages ------------------------------------------------------------------------------------

    async def _recordings(self, _: Request) -> Response:
        return Response(msgspec.json.encode(await self.lobby.recordings()), media_type="application/json")

    async def _recording(self, request: Request) -> FileResponse:
        path = self.lobby.find_recording(request.path_params["name"])
        return FileResponse(path, media_type="application/x-ndjson")

    async def _invitation(self, request: Request) -> Response:
        """Return a QR code of a room's address, at one of this page's addresses."""
        room, at = request.path_params["room"], request.query_params.get("at", "")
        addresses = {f"{scheme}://{request.headers.get('host', '')}/" for scheme in ("http", "https")}
        address = request.client.host if request.client is not None else ""
        try:
            self.lobby.find_room(room, address)
        except RefusedError as error:
            raise HTTPException(429 if error.code == "too_many" else 404, str(error)) from error
        if at not in addresses | {*self.lobby.addresses}:
            raise HTTPException(404, "there is no such address here")
        return Response(_picture_of(f"{at}#room={room}"), media_type="image/svg+xml")

    async def _status(self, _: Request) -> JSONResponse:
        files = Path("/proc/self/fd")
        figures = {
            "rooms": len(self.lobby.rooms),
            "playing": sum(room.phase == "playing" for room in self.lobby.rooms.values()),
            "connections": len(self._handlers),
            "tasks": len(asyncio.all_tasks()),
            "open_files": len(list(files.iterdir())) if files.exists() else None,
        }
        return JSONResponse(figures)


async def _not_found(_: Request, error: Exception) -> Response:
    return PlainTextResponse(f"{error}\n", 404)


@functools.lru_cache(maxsize=512)
def _picture_of(address: str) -> bytes:
    """Return an address as a QR code; it is cached, since games wait while it is drawn."""
    picture = io.BytesIO()
    segno.make(address, micro=False).save(picture, kind="svg", scale=4, border=2, light="white")
    return picture.getvalue()
