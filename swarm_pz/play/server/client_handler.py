"""What one client does, from its hello on: messages are obeyed, or refused to it alone."""

from __future__ import annotations

import asyncio
import logging
from typing import Literal

from swarm_pz.errors import PolicyError, ProtocolError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.replay_session import ReplaySession
from swarm_pz.play.server.room import RefusedError, Room
from swarm_pz.play.server.room_settings import settings_of

log = logging.getLogger("swarm_pz.play")


def _facing(seat: protocol.Side | Literal["watch"]) -> protocol.Side:
    """Return the opponent's side; it is blue for who only watches."""
    return "red" if seat == "blue" else "blue"


class ClientHandler:
    """What one client does, from its hello on.

    Parameters
    ----------
    lobby : Lobby
    connection : Connection
    """

    def __init__(self, lobby: Lobby, connection: Connection) -> None:
        self._lobby, self._connection = lobby, connection
        self._room: Room | None = None
        self._replay: ReplaySession | None = None
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
            self._refuse(error.code, str(error), about_, error.recording)
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

    def _refuse(self, code: protocol.Reason, reason: str, about_: str, recording: str | None = None) -> None:
        self._connection.send(protocol.Refused(code=code, reason=reason[:500], about=about_, recording=recording))

    def end(self) -> None:
        """Note that the client is gone."""
        if self._room is not None:
            self._room.disconnect(self._connection)
        if self._opening is not None:
            self._opening.cancel()
        self._stop_watching()

    def _stop_watching(self) -> None:
        if self._replay is not None:
            self._replay.close()
        self._replay = None

    def _go_out(self) -> None:
        """Leave the room or the recorded game that one is in."""
        self._leave_room()
        self._stop_watching()

    def _leave_room(self) -> None:
        room, self._room = self._room, None
        if room is not None:
            room.leave(self._connection)
            if room.abandoned:
                self._lobby.close_room(room)

    async def _open(self, name: str) -> None:
        """Show a recorded game, once it has been played through to see that it comes out as recorded."""
        try:
            loaded = await self._lobby.read(name)
            self._leave_room()
            self._stop_watching()
            self._replay = ReplaySession(loaded, self._connection)
        except SwarmError as error:
            self._refuse("unknown", str(error).replace(f"{self._lobby.context.folder}/", ""), "open_replay")
        except Exception:
            log.exception("a recorded game was not shown")
            self._refuse("not_valid", "the server could not do that", "open_replay")

    def _watched(self) -> ReplaySession:
        if self._replay is None:
            raise RefusedError("out_of_turn", "open a recorded game first")
        return self._replay

    def _take_over(self, message: protocol.TakeOver) -> None:
        replay = self._watched()
        opponent = message.opponent
        if opponent is None:
            header = replay.recording.header
            other = header.blue if message.seat == "red" else header.red
            opponent = other.policy or None
        if opponent is not None:
            self._lobby.check_policy(opponent)
        moment = replay.moment()
        if moment is None:
            raise RefusedError("not_valid", "this game plays differently on this machine, and cannot be gone on with")
        if moment.game.over:
            raise RefusedError("not_valid", "the game is over at this moment; go back to an earlier one")
        room = self._lobby.open_room(settings_of(moment.game.config), moment)
        self._enter(room, message.seat, "", {_facing(message.seat): opponent})

    def _in_room(self) -> Room:
        if self._room is None:
            raise RefusedError("out_of_turn", "create or join a room first")
        return self._room

    def _obey(self, message: protocol.ClientMessage) -> None:
        connection, lobby = self._connection, self._lobby
        if not self._greeted and not isinstance(message, protocol.Hello):
            raise RefusedError("out_of_turn", "the first message must be a hello")
        match message:
            case protocol.Hello():
                self._greet(message)
            case protocol.Ping():
                connection.send(protocol.Pong(sent_ms=message.sent_ms, server_ms=lobby.context.now_ms()))
            case protocol.Acknowledge():
                connection.acknowledge(message.sequence)
            case protocol.Create():
                if message.player is not None and message.seat != "watch":
                    raise RefusedError("not_valid", "a player besides oneself has a seat only if one watches")
                policies = {"red": message.player, _facing(message.seat): message.opponent}
                for name in filter(None, policies.values()):
                    lobby.check_policy(name)
                opened = lobby.open_room(message.settings)
                opened.lesson = message.lesson
                self._enter(opened, message.seat, message.label, policies)
            case protocol.Join():
                room = lobby.rooms.get(message.room.upper())
                if room is None:
                    raise RefusedError("unknown", f"there is no room {message.room}")
                self._enter(room, message.seat, message.label, {})
            case protocol.Invite():
                policy = lobby.check_policy(message.policy) if message.policy is not None else None
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
        connection.send(self._lobby.welcome())
        if message.token is not None:
            place = self._lobby.seat_of(message.token)
            if place is None:
                recording = self._lobby.recording_of(message.token)
                reason = "that seat is gone: its room was closed, or it was given up"
                if recording is not None:
                    reason = f"that seat is gone with its room; its game is recorded as {recording}"
                raise RefusedError("unknown", reason, recording)
            self._room, seat = place
            self._room.resume(connection, seat)

    def _enter(
        self, room: Room, side: protocol.Side | Literal["watch"], label: str, policies: dict[protocol.Side, str | None]
    ) -> None:
        """Go into a room, and give seats there to policies; only who is let in leaves where they were."""
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
        self._stop_watching()
        self._room = room
