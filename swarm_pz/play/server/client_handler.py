"""What one client does, from its hello on: messages are obeyed, or refused to it alone."""

from __future__ import annotations

import asyncio
import functools
import logging
from collections.abc import Awaitable, Callable
from typing import Literal

from swarm_pz.errors import PolicyError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.climbing import Climbing
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.orders import Made, is_made_at_once, make
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.replay_session import ReplaySession
from swarm_pz.play.server.responses import SAVED, ReadyRule, check_rules
from swarm_pz.play.server.room import Room
from swarm_pz.play.server.room_settings import settings_of

HELLO_S = 10.0
"""Seconds within which a connection must say hello."""
_WITHOUT_SEAT = 2048
"""Characters of all that is said without a seat: only drawings, densities and other commands are longer."""
SILENT_S = 300.0
"""Seconds after which who is nowhere and says nothing is closed; pages ask for the clock, hidden ones once a minute."""
_OF_PLAYERS = (
    protocol.Hello,
    protocol.Ping,
    protocol.Acknowledge,
    protocol.CommandMessage,
    protocol.Painted,
    protocol.Visibility,
)
"""All that is said where a host decides which games there are."""
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
        self._going: asyncio.Task[None] | None = None
        """What will take the client elsewhere: a recorded game that is read, or taken over."""
        self._drawing: asyncio.Task[None] | None = None
        self._command: tuple[Room, protocol.CommandMessage] | None = None
        """The latest command and where it was given, while an earlier one is being drawn."""
        self._ruling: asyncio.Task[None] | None = None
        """What makes the commands of automatic responses."""
        self._greeted = False

    def hear(self, text: str | None) -> None:
        """Obey a message, or refuse it."""
        about_ = ""
        try:
            if text is None:
                raise RefusedError("malformed", "messages to the server are text, not binary")
            if len(text) > _WITHOUT_SEAT:
                self._in_room().seat_of(self._connection)
            if not self._connection.may_send(len(text)):
                raise RefusedError("too_many", "drawings came too fast after each other; this one is lost")
            message = protocol.decode_client(text)
            about_ = str(type(message).__struct_config__.tag)
            # Acknowledgements are as many as what is on its way: without them nothing more would be sent.
            is_answer = isinstance(message, protocol.Acknowledge) and self._connection.acknowledge(message.sequence)
            if not is_answer and not self._connection.may_speak():
                raise RefusedError(
                    "too_many",
                    f"a client may send {protocol.MAX_MESSAGES_PER_SECOND} messages a second; this one is lost",
                )
            self._obey(message)
        except Exception as error:  # whatever it is, it is refused to this client alone
            self._refuse(error, about_)

    def _refuse(self, error: Exception, about_: str) -> None:
        code: protocol.Reason = "not_valid"
        reason, recording = str(error), None
        if isinstance(error, RefusedError):
            code, recording = error.code, error.recording
        elif isinstance(error, ProtocolError):
            code = "malformed"
        elif isinstance(error, PolicyError):
            code = "unknown"
        elif not isinstance(error, SwarmError):
            log.error("a message was not obeyed", exc_info=error)
            reason = "the server could not do that"
        self._connection.refuse(protocol.Refused(code=code, reason=reason[:500], about=about_, recording=recording))

    def end(self) -> None:
        """Note that the client is gone."""
        if self._room is not None:
            self._room.disconnect(self._connection)
        self._stop_going()
        self._stop_watching()

    def close_if_silent(self, now: float) -> None:
        """Close a connection that has not even said hello, or that is nowhere and says nothing."""
        silent_s = now - self._connection.last_heard
        if not self._greeted and silent_s > HELLO_S:
            self._connection.close(f"no hello came within {HELLO_S:g} seconds")
        elif self._room is None and self._replay is None and silent_s > SILENT_S:
            self._connection.close(f"nothing was said for {SILENT_S:g} seconds, outside of any room")

    # --- where the client is ----------------------------------------------------------------------

    def _stop_watching(self) -> None:
        if self._replay is not None:
            self._replay.close()
            self._lobby.watched.discard(self._replay)
        self._replay = None

    def _go(self, about_: str, there: Callable[[], Awaitable[None]]) -> None:
        """Begin to take the client elsewhere, in place of what was begun before."""
        self._stop_going()

        async def go() -> None:
            try:
                await there()
            except Exception as error:
                self._refuse(error, about_)

        self._going = asyncio.create_task(go())

    def _stop_going(self) -> None:
        """Whoever has gone somewhere is not taken elsewhere by what was begun before."""
        going, self._going = self._going, None
        if going is not None and going is not asyncio.current_task():
            going.cancel()

    def _leave(self) -> None:
        """Leave the room or the recorded game that one is in."""
        self._stop_going()
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
            replayed = await self._lobby.read(name)
        except RecordingError as error:
            raise RefusedError("unknown", str(error).replace(f"{self._lobby.context.folder}/", "")) from error
        try:
            self._lobby.check_replays(self._replay)
        except RefusedError:
            replayed.drop()
            raise
        self._leave()
        self._replay = ReplaySession(replayed, self._connection)
        self._lobby.watched.add(self._replay)

    def _watched(self) -> ReplaySession:
        if self._replay is None:
            raise RefusedError("out_of_turn", "open a recorded game first")
        return self._replay

    def _take_over(self, message: protocol.TakeOver) -> None:
        replay = self._watched()
        opponent = message.opponent
        if opponent is None:
            other = replay.state.blue if message.seat == "red" else replay.state.red
            opponent = other.name or None
        if opponent is not None:
            self._lobby.check_policy(opponent)
        if not replay.state.verified:
            raise RefusedError("not_valid", "this game plays differently on this machine, and cannot be gone on with")

        async def go_on() -> None:
            moment = await replay.moment()
            if moment.game.over:
                raise RefusedError("not_valid", "the game is over at this moment; go back to an earlier one")
            room = self._lobby.open_room(settings_of(moment.game.config), moment, self._connection.address)
            self._enter(room, message.seat, "", {_facing(message.seat): opponent})

        self._go("take_over", go_on)

    # --- the ladder -------------------------------------------------------------------------------

    def _climbing(self) -> Climbing:
        if self._lobby.climbing is None:
            raise RefusedError("unknown", "there is no ladder here: start the table with --ladder")
        return self._lobby.climbing

    async def _tell_level(self, message: protocol.AskLevel) -> None:
        self._connection.send(await self._climbing().level(message.code, message.system))

    async def _climb(self, message: protocol.Climb) -> None:
        climbing = self._climbing()
        level = await climbing.level(message.code, message.system)
        climbing.check_free(level.code)
        room = self._lobby.open_room(climbing.settings(level), address=self._connection.address)
        self._enter(room, level.side, "", {_facing(level.side): level.opponent})
        climbing.follow(room, level)
        room.audience.tell_state()

    # --- what the client does there ---------------------------------------------------------------

    def _give_command(self, message: protocol.CommandMessage) -> None:
        """Hand in a command; while one is made that takes long, elsewhere, the latest one waits."""
        room = self._in_room()
        if [message.strokes, message.density, message.command].count(None) != 2:
            raise RefusedError(
                "not_valid", "a command must hold either strokes or a density or a command of another kind"
            )
        seat = room.commanding(self._connection)
        if self._drawing is None and is_made_at_once(message, room.reader, seat.team):
            room.command(self._connection, message, self._maker(room, message)())
        else:
            self._command = room, message
            if self._drawing is None:
                self._drawing = asyncio.create_task(self._draw())

    def _maker(self, room: Room, message: protocol.CommandMessage) -> Callable[[], Made]:
        team = room.commanding(self._connection).team
        return functools.partial(make, message, room.reader, room.config.mapping, team, message.number)

    async def _draw(self) -> None:
        while self._command is not None:
            (room, message), self._command = self._command, None
            try:
                if room is not self._room:
                    continue
                system = room.reader.systems[room.commanding(self._connection).team].name
                made = await self._lobby.painter.make(self._maker(room, message), system)
                if room is self._room:
                    room.command(self._connection, message, made)
            except Exception as error:
                self._refuse(error, "command")
        self._drawing = None

    def _set_rules(self, message: protocol.Rules) -> None:
        """Set automatic responses, once their commands are made; of several messages, the latest counts."""
        room = self._in_room()
        team = room.seat_of(self._connection).team
        check_rules(message.rules)
        for rule in message.rules:
            if rule.do.policy is not None and room.ranked:
                raise RefusedError("not_valid", "on the ladder nobody plays for you: no policy may command here")
            if rule.do.policy is not None:
                self._lobby.check_policy(rule.do.policy)
        if self._ruling is not None:
            self._ruling.cancel()

        async def make_all() -> None:
            try:
                rules = []
                for rule in message.rules:
                    work = functools.partial(make, rule.do, room.reader, room.config.mapping, team, 0, SAVED)
                    system = room.reader.systems[team].name
                    made = await self._lobby.painter.make(work, system) if rule.do.policy is None else None
                    rules.append(ReadyRule(rule, made.command if made is not None else None))
                if room is self._room:
                    room.respond(self._connection, rules)
            except Exception as error:
                self._refuse(error, "rules")

        self._ruling = asyncio.create_task(make_all())

    def _in_room(self) -> Room:
        if self._room is None:
            raise RefusedError("out_of_turn", "create or join a room first")
        return self._room

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
                pass  # it was heard before
            case protocol.Create():
                if message.player is not None and message.seat != "watch":
                    raise RefusedError("not_valid", "a player besides oneself has a seat only if one watches")
                policies = {"red": message.player, _facing(message.seat): message.opponent}
                for name in filter(None, policies.values()):
                    lobby.check_policy(name)
                opened = lobby.open_room(message.settings, address=connection.address)
                opened.once, opened.games.lesson, opened.games.seed = message.once, message.lesson, message.seed
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
                self._give_command(message)
            case protocol.Rules():
                self._set_rules(message)
            case protocol.Painted():
                self._in_room().painted(connection, message)
            case protocol.Visibility():
                if self._room is not None:
                    self._room.visibility(connection, message.hidden)
            case protocol.Leave():
                self._leave()
            case protocol.OpenReplay():
                lobby.check_replays(self._replay)
                self._go("open_replay", functools.partial(self._open, message.recording))
            case protocol.Seek():
                self._watched().seek(message.tick)
            case protocol.Pace():
                self._watched().pace(message.speed)
            case protocol.TakeOver():
                self._take_over(message)
            case protocol.AskLevel():
                self._go("ask_level", functools.partial(self._tell_level, message))
            case protocol.Climb():
                self._go("climb", functools.partial(self._climb, message))

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
        self._stop_going()
        self._stop_watching()
        self._room = room
