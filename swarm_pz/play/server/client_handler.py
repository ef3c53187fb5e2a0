"""Obeys one client's messages; refusals are sent to it alone."""

from __future__ import annotations

import asyncio
import contextlib
import logging

from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.errors import PolicyError, ProtocolError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.connection import LONG, Connection, RefusedError
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.rendered_command import is_rendered_at_once, render
from swarm_pz.play.server.room import Room
from swarm_pz.play.server.room_settings import RoomPlan, table_config

HELLO_S = 10.0
"""Seconds within which a connection must say hello."""
SILENT_S = 300.0
"""Seconds after which a silent client outside of rooms is closed; pages send pings, hidden ones each minute."""
_OF_PLAYERS = (protocol.Hello, protocol.Ping, protocol.Acknowledge, protocol.CommandMessage, protocol.Visibility)
"""The only messages that a study's server obeys."""
log = logging.getLogger("swarm_pz.play")


class ClientHandler:
    """Obeys the messages of one client."""

    def __init__(self, lobby: Lobby, connection: Connection) -> None:
        self._lobby, self._connection = lobby, connection
        self._room: Room | None = None
        self._rendering: asyncio.Task[None] | None = None
        self._command: tuple[Room, protocol.CommandMessage] | None = None
        """The latest command and its room, while an earlier one is rendered."""
        self._greeted = False

    # --- messages ---------------------------------------------------------------------------------

    async def serve(self, socket: WebSocket) -> None:
        """Obey the messages of an accepted socket until it closes."""
        connection = self._connection
        sender = asyncio.create_task(connection.run())
        try:
            while not connection.closed:
                received = await socket.receive()
                if received["type"] == "websocket.disconnect":
                    break
                self.hear(received.get("text"))
        except WebSocketDisconnect:
            pass
        finally:
            self.end()
            connection.close()
            # A peer that reads nothing would delay this for long.
            with contextlib.suppress(TimeoutError, asyncio.CancelledError):
                await asyncio.wait_for(sender, 2.0)

    def hear(self, text: str | None) -> None:
        """Obey a message, or refuse it."""
        about = ""
        try:
            if text is None:
                raise RefusedError("malformed", "messages to the server are text, not binary")
            if len(text) > LONG:  # only commands are
                self._in_room().seat_of(self._connection)
            if not self._connection.may_send(len(text)):
                raise RefusedError("too_many", "long drawings came too fast after each other; this one is lost")
            message = protocol.decode_client(text)
            about = str(type(message).__struct_config__.tag)
            # Acknowledgements of frames are not counted: without them no more would be sent.
            is_answer = isinstance(message, protocol.Acknowledge) and self._connection.acknowledge(message.sequence)
            if not is_answer and not self._connection.may_speak():
                limit = protocol.MAX_MESSAGES_PER_SECOND
                raise RefusedError("too_many", f"a client may send {limit} messages a second; this one is lost")
            self._obey(message)
        except Exception as error:
            self._refuse(error, about)

    def _refuse(self, error: Exception, about: str) -> None:
        code: protocol.Reason = "not_valid"
        reason = str(error)
        if isinstance(error, RefusedError):
            code = error.code
        elif isinstance(error, ProtocolError):
            code = "malformed"
        elif isinstance(error, PolicyError):
            code = "unknown"
        elif not isinstance(error, SwarmError):
            log.error("a message was not obeyed", exc_info=error)
            reason = "the server could not do that"
        self._connection.refuse(protocol.Refused(code=code, reason=reason[:500], about=about))

    def _obey(self, message: protocol.ClientMessage) -> None:
        connection, lobby = self._connection, self._lobby
        if not self._greeted and not isinstance(message, protocol.Hello):
            raise RefusedError("out_of_turn", "the first message must be a hello")
        if lobby.is_hosted and not isinstance(message, _OF_PLAYERS):
            raise RefusedError("out_of_turn", "games begin from the study's page here, and by themselves")
        match message:
            case protocol.Hello():
                self._greet(message)
            case protocol.Ping():
                connection.send(protocol.Pong(sent_ms=message.sent_ms, server_ms=lobby.context.now_ms()))
            case protocol.Acknowledge():
                pass  # see `hear`
            case protocol.Create():
                self._create(message)
            case protocol.Join():
                room = lobby.find_room(message.room, connection.address)
                self._enter(room, message.seat, message.label, {})
            case protocol.Ready():
                self._in_room().ready(connection, message.ready, message.label)
            case protocol.Pause():
                self._in_room().pause(connection, message.paused)
            case protocol.CommandMessage():
                self._give_command(message)
            case protocol.Visibility():
                if self._room is not None:
                    self._room.visibility(connection, message.hidden)
            case protocol.Leave():
                self._leave_room()

    def _greet(self, message: protocol.Hello) -> None:
        if self._greeted:
            raise RefusedError("out_of_turn", "one hello is enough")
        connection = self._connection
        connection.kind, connection.client = message.kind, message.client
        self._greeted = True
        connection.send(self._lobby.welcome())
        if message.token is not None:
            place = self._lobby.seat_of(message.token)
            if place is None:
                raise RefusedError("unknown", "that seat is gone: its room was closed, or it was given up")
            self._room, seat = place
            self._room.resume(connection, seat)

    # --- where the client is ----------------------------------------------------------------------

    def _in_room(self) -> Room:
        if self._room is None:
            raise RefusedError("out_of_turn", "create or join a room first")
        return self._room

    def _create(self, message: protocol.Create) -> None:
        if message.player is not None and message.seat != "watch":
            raise RefusedError("not_valid", "a player besides oneself has a seat only if one watches")
        facing: protocol.Side = "red" if message.seat == "blue" else "blue"  # for a spectator, too
        policies: dict[protocol.Side, str | None] = {"red": message.player, facing: message.opponent}
        named = [self._lobby.check_policy(name) for name in policies.values() if name is not None]
        config = table_config(message.settings, self._lobby.context.table)
        if (robots := self._lobby.context.robots) is not None:
            config = robots.slowed(config)
        plan = RoomPlan(config=config, once=message.once, lesson=message.lesson, seed=message.seed)
        room = self._lobby.open_room(plan, self._connection.address, len(named))
        self._enter(room, message.seat, message.label, policies)

    def _enter(self, room: Room, side: protocol.Place, label: str, policies: dict[protocol.Side, str | None]) -> None:
        """Enter a room, and give seats there to policies; a client that is refused stays where it was."""
        try:
            for other, policy in policies.items():
                if policy is not None:
                    room.place_policy(other, policy)
            if side == "watch":
                room.watch(self._connection)
            else:
                room.sit(self._connection, side, label)
        except RefusedError:
            if room.abandoned:
                self._lobby.close_room(room)
            raise
        if room is not self._room:
            self._leave_room()
        self._room = room

    def _leave_room(self) -> None:
        room, self._room = self._room, None
        if room is not None:
            room.leave(self._connection)
            if room.abandoned:
                self._lobby.close_room(room)

    def end(self) -> None:
        """Note that the client is gone."""
        if self._room is not None:
            self._room.disconnect(self._connection)

    def close_if_silent(self, now: float) -> None:
        """Close a connection that sends no hello, or is silent outside of rooms."""
        silent_s = now - self._connection.last_heard
        if not self._greeted and silent_s > HELLO_S:
            self._connection.close(f"no hello came within {HELLO_S:g} seconds")
        elif self._room is None and silent_s > SILENT_S:
            self._connection.close(f"nothing was said for {SILENT_S:g} seconds, outside of any room")

    # --- commands ---------------------------------------------------------------------------------

    def _give_command(self, message: protocol.CommandMessage) -> None:
        """Submit a command; while the worker renders one, only the latest of the next ones waits."""
        room = self._in_room()
        if [message.strokes, message.density, message.command].count(None) != 2:
            reason = "a command must hold either strokes or a density or a command of another kind"
            raise RefusedError("not_valid", reason)
        team = room.commanding(self._connection).team
        if self._rendering is None and is_rendered_at_once(message, room.reader, team):
            rendered = render(message, room.reader, room.plan.config.mapping, team)
            room.command(self._connection, message, rendered)
        else:
            self._command = room, message
            if self._rendering is None:
                self._rendering = asyncio.create_task(self._render())

    async def _render(self) -> None:
        while self._command is not None:
            (room, message), self._command = self._command, None
            if room is not self._room:
                continue
            try:
                team, mapping = room.commanding(self._connection).team, room.plan.config.mapping
                rendered = await self._lobby.drawing.do(render, message, room.reader, mapping, team)
                if room is self._room:
                    room.command(self._connection, message, rendered)
            except Exception as error:
                self._refuse(error, "command")
        self._rendering = None
