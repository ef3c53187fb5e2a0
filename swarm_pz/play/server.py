"""The server: pages, the socket that everything goes through, and who may come in.

Whatever a client sends that is not right is refused to that client alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import importlib.metadata
import itertools
import logging
import resource
import secrets
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from starlette.applications import Starlette
from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, PolicyError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.connection import Connection
from swarm_pz.play.recording import checked_name
from swarm_pz.play.room import RefusedError, Room, Seat, settings_of
from swarm_pz.play.screening import Film, Screening
from swarm_pz.play.session import House, Moment
from swarm_pz.policy import about, registered

STATIC = Path(__file__).parent / "static"
MOST_ROOMS = 100
_IDLE_S = 600.0
"""Seconds after which a room without anybody is closed."""
_STATUS_TICKS = 20_000
"""Latest ticks that the server's figures are taken of."""
_PATIENCE = 100
"""Refusals in a row after which a client is shown out."""
_LETTERS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"
_HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cache-control": "no-cache",
}
log = logging.getLogger("swarm_pz.play")


class Guard:
    """Lets in only those who ask for a name that is served here, and from a page that is.

    A page elsewhere may make its name point here (DNS rebinding) or open a socket to here; neither its
    Host nor its Origin is one of ours. Programs send no Origin.

    Parameters
    ----------
    app : ASGI application
    hosts : sequence of str
        Names with their port.
    """

    def __init__(self, app: ASGIApp, hosts: Sequence[str]) -> None:
        self._app, self._hosts = app, {host.lower() for host in hosts}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host, origin = headers.get("host", "").lower(), headers.get("origin")
        allowed = host in self._hosts and (
            origin is None or origin.lower() in {f"http://{name}" for name in self._hosts}
        )
        if not allowed:
            if scope["type"] == "websocket":
                await WebSocket(scope, receive, send).close(code=1008)
            else:
                await PlainTextResponse("this server is not known by that name\n", 403)(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(_HEADERS)
            await send(message)

        await self._app(scope, receive, send_with_headers)


def _addressed(scope: Scope) -> set[str]:
    """Return the address at which a client came in: a name may be pointed elsewhere, an address may not."""
    server = scope.get("server")
    if not server or server[1] is None:
        return set()
    address = f"[{server[0]}]" if ":" in server[0] else server[0]
    return {f"{address}:{server[1]}"} | ({address} if server[1] == 80 else set())


class Server:
    """All rooms, and the clients that come to them.

    Parameters
    ----------
    house : House

    Attributes
    ----------
    rooms : dict of str to Room
        By code.
    """

    def __init__(self, house: House) -> None:
        self.house = house
        self.rooms: dict[str, Room] = {}
        self.connections: set[Connection] = set()
        self._reading = asyncio.Lock()
        self._policies = [protocol.PolicyInfo(name=name, about=about(name)) for name in sorted(registered())]

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
            "peak_memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
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
        """Return a policy's name, or refuse one that is not installed."""
        if name not in {policy.name for policy in self._policies}:
            raise RefusedError("unknown", f"there is no policy {name[:80]!r} here")
        return name

    def welcome(self) -> protocol.Welcome:
        """Return what every client is told first."""
        return protocol.Welcome(
            version=importlib.metadata.version("swarm-pz"),
            policies=self._policies,
            min_command_interval=self.house.min_command_interval,
            command_cells=GameConfig().command_cells,
            server_ms=self.house.now_ms(),
        )


class Visit:
    """What one client does, from its hello on.

    Parameters
    ----------
    server : Server
    connection : Connection
    """

    def __init__(self, server: Server, connection: Connection) -> None:
        self._server, self._connection = server, connection
        self._room: Room | None = None
        self._screening: Screening | None = None
        self._opening: asyncio.Task[None] | None = None
        self._greeted = False

    def hear(self, text: str | None) -> bool:
        """Obey a message, or refuse it and return False."""
        about_ = ""
        try:
            if not self._connection.may_speak():
                raise RefusedError(
                    "too_many",
                    f"a client may send {protocol.MAX_MESSAGES_PER_SECOND} messages a second; this one is lost",
                )
            if text is None:
                raise RefusedError("malformed", "messages to the server are text, not binary")
            message = protocol.decode_client(text)
            about_ = str(type(message).__struct_config__.tag)
            self._obey(message)
        except ProtocolError as error:
            self._refuse("malformed", str(error), about_)
        except RefusedError as error:
            self._refuse(error.code, str(error), about_)
        except PolicyError as error:
            self._refuse("unknown", str(error), about_)
        except SwarmError as error:
            self._refuse("not_valid", str(error), about_)
        except Exception:
            log.exception("a message was not obeyed")
            self._refuse("not_valid", "the server could not do that", about_)
        else:
            return True
        return False

    def _refuse(self, code: protocol.Reason, reason: str, about_: str) -> None:
        self._connection.send(protocol.Refused(code=code, reason=reason[:500], about=about_))

    def end(self) -> None:
        """Note that the client is gone."""
        if self._room is not None:
            self._room.disconnect(self._connection)
        if self._opening is not None:
            self._opening.cancel()
        self._stop_watching()

    def _stop_watching(self) -> None:
        if self._screening is not None:
            self._screening.close()
        self._screening = None

    def _go_out(self) -> None:
        """Leave the room or the recorded game that one is in."""
        self._leave_room()
        self._stop_watching()

    def _leave_room(self) -> None:
        room, self._room = self._room, None
        if room is not None:
            room.leave(self._connection)
            if room.abandoned:
                self._server.close_room(room)

    async def _open(self, name: str) -> None:
        """Show a recorded game, once it has been played through to see that it comes out as recorded."""
        try:
            film = await self._server.read(name)
            self._leave_room()
            self._stop_watching()
            self._screening = Screening(film, self._connection)
        except SwarmError as error:
            self._refuse("unknown", str(error).replace(f"{self._server.house.folder}/", ""), "open_replay")
        except Exception:
            log.exception("a recorded game was not shown")
            self._refuse("not_valid", "the server could not do that", "open_replay")

    def _watched(self) -> Screening:
        if self._screening is None:
            raise RefusedError("out_of_turn", "open a recorded game first")
        return self._screening

    def _take_over(self, message: protocol.TakeOver) -> None:
        screening = self._watched()
        opponent = message.opponent
        if opponent is None:
            header = screening.recording.header
            other = header.blue if message.seat == "red" else header.red
            opponent = other.policy or None
        if opponent is not None:
            self._server.check_policy(opponent)
        moment = screening.moment()
        if moment is None:
            raise RefusedError("not_valid", "this game plays differently on this machine, and cannot be gone on with")
        if moment.game.over:
            raise RefusedError("not_valid", "the game is over at this moment; go back to an earlier one")
        room = self._server.open_room(settings_of(moment.game.config), moment)
        self._enter(room, message.seat, "", opponent)

    def _in_room(self) -> Room:
        if self._room is None:
            raise RefusedError("out_of_turn", "create or join a room first")
        return self._room

    def _obey(self, message: protocol.ClientMessage) -> None:
        connection, server = self._connection, self._server
        if not self._greeted and not isinstance(message, protocol.Hello):
            raise RefusedError("out_of_turn", "the first message must be a hello")
        match message:
            case protocol.Hello():
                self._greet(message)
            case protocol.Ping():
                connection.send(protocol.Pong(sent_ms=message.sent_ms, server_ms=server.house.now_ms()))
            case protocol.Acknowledge():
                connection.acknowledge(message.sequence)
            case protocol.Create():
                if message.opponent is not None:
                    server.check_policy(message.opponent)
                self._enter(server.open_room(message.settings), message.seat, message.label, message.opponent)
            case protocol.Join():
                room = server.rooms.get(message.room)
                if room is None:
                    raise RefusedError("unknown", f"there is no room {message.room}")
                self._enter(room, message.seat, message.label, None)
            case protocol.Invite():
                policy = server.check_policy(message.policy) if message.policy is not None else None
                self._in_room().invite(connection, message.seat, policy)
            case protocol.Ready():
                self._in_room().ready(connection, message.ready)
            case protocol.CommandMessage():
                self._in_room().command(connection, message)
            case protocol.Painted():
                self._in_room().painted(connection, message)
            case protocol.Visibility():
                if self._room is not None:
                    self._room.visibility(connection, message.hidden)
            case protocol.Leave():
                self._go_out()
            case protocol.OpenReplay():
                if self._opening is not None:
                    self._opening.cancel()
                self._opening = asyncio.create_task(self._open(message.recording))
            case protocol.Seek():
                self._watched().seek(message.tick)
            case protocol.Pace():
                self._watched().pace(message.speed)
            case protocol.TakeOver():
                self._take_over(message)

    def _greet(self, message: protocol.Hello) -> None:
        if self._greeted:
            raise RefusedError("out_of_turn", "one hello is enough")
        connection = self._connection
        connection.kind, connection.client = message.kind, message.client
        self._greeted = True
        connection.send(self._server.welcome())
        if message.token is not None:
            place = self._server.seat_of(message.token)
            if place is None:
                raise RefusedError("unknown", "that seat is gone: its room was closed, or it was given up")
            self._room, seat = place
            self._room.resume(connection, seat)

    def _enter(self, room: Room, side: protocol.Side | Literal["watch"], label: str, opponent: str | None) -> None:
        """Go into a room; only who is let in leaves where they were."""
        try:
            if opponent is not None:
                room.place_policy("blue" if side == "red" else "red", opponent)
            if side == "watch":
                room.watch(self._connection)
            else:
                room.sit(self._connection, side, label)
        except RefusedError:
            if room.abandoned:
                self._server.close_room(room)
            raise
        if room is not self._room:
            self._leave_room()
        self._stop_watching()
        self._room = room
