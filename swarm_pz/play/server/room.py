"""A room: two seats, who watches, and the games between them."""

from __future__ import annotations

import asyncio
import functools
import itertools
import logging
import secrets
import time
from collections.abc import Callable
from typing import Literal

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.factors import Factors
from swarm_pz.play.forms import commands_of
from swarm_pz.play.recordings.format import EndedBy, Outcome, PaintedLine, RecordedSeat, SeatEvent, SeatLine
from swarm_pz.play.server.budget import Budget
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.live_session import Callbacks, LiveSession, Moment, ServerContext
from swarm_pz.play.server.orders import Made, target_of
from swarm_pz.play.server.policy_workers import PolicySeat
from swarm_pz.play.server.responses import ReadyRule, Responses
from swarm_pz.play.server.room_settings import Hosted, settings_of, table_config
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.seat_view import SeatView
from swarm_pz.play.server.views import frame_of, target_message

AWAY_S = 60.0
"""Seconds that a seat waits between games for who has left without saying so."""
_MOST_TOLD = 200.0
"""So many are told how a room stands, at once and in a second: each who enters is news to all who are there."""
_TELL_S = 0.5
"""Beyond that, all of them are told after so long."""


log = logging.getLogger("swarm_pz.play")


class RefusedError(SwarmError, ValueError):
    """What a client asked for is not done.

    Attributes
    ----------
    code : str
        One of those of the protocol's `Refused`.
    recording : str or None
        The recorded game that there is instead.
    """

    def __init__(self, code: protocol.Reason, reason: str, recording: str | None = None) -> None:
        super().__init__(reason)
        self.code, self.recording = code, recording


class Room:
    """A room; see the module.

    Parameters
    ----------
    code : str
    settings : protocol.Settings
    context : ServerContext
    moment : Moment, optional
        Of a recorded game, that the first game here goes on from.
    address : str
        Where who opened it is.
    hosted : Hosted, optional
        What a host has decided, in place of the settings and of who is in it.

    Attributes
    ----------
    lesson : bool
        Games here are lessons, and say so in their recordings.
    once : bool
        One game is played here, between those who sat down for it, and no more.
    ranked : bool
        It counts for a player's level: no policy may command in the player's place.
    seed : int or None
        Of the next game's start; None takes any. Who calls its countdown off is given the same start again.
    over : callable or None
        Told the outcome and what ended the game, of each that has begun.
    reader : CommandReader
        Of the commands of its games.
    """

    def __init__(
        self,
        code: str,
        settings: protocol.Settings,
        context: ServerContext,
        moment: Moment | None = None,
        address: str = "",
        hosted: Hosted | None = None,
    ) -> None:
        self.code, self._context, self._moment = code, context, moment
        self.address, self.hosted = address, hosted
        if hosted is not None:
            self.config = hosted.config
        elif moment is None:
            self.config = table_config(settings, context.table)
        else:  # by its rules; what was varied then is not now
            self.config = moment.game.config.replace(factors=(Factors(), Factors()))
        self.settings = settings_of(self.config)
        self.reader = CommandReader(self.config.game)
        self._commands = [commands_of(system, self.config.game) for system in self.reader.systems]
        self.seats = (Seat(0), Seat(1))
        self.watchers: set[Connection] = set()
        self.session: LiveSession | None = None
        self.outcome: Outcome | None = None
        self._ended_by: EndedBy | None = None
        self.last_used = time.monotonic()
        self.lesson = self.once = self.ranked = False
        self.over: Callable[[Outcome, EndedBy], None] | None = None
        self._tells = Budget(_MOST_TOLD, _MOST_TOLD, self.last_used)
        self._tells_later: asyncio.TimerHandle | None = None
        self._games = 0
        self.seed: int | None = hosted.seed if hosted is not None else None
        """Of the next game: who calls its countdown off is given the same start again."""
        self._before: tuple[LiveSession | None, Outcome | None] = None, None
        """The session before the one that starts, and its outcome."""
        self._places = itertools.count()
        self._is_called_for = False
        """Somebody who is here wants two policies to begin."""

    @property
    def phase(self) -> Literal["waiting", "starting", "playing", "over"]:
        """Where the room is."""
        if self.session is None:
            return "waiting"
        if self.outcome is not None:
            return "over"
        return "playing" if self.session.has_begun else "starting"

    # --- who is here ------------------------------------------------------------------------------

    @property
    def connections(self) -> list[Connection]:
        """Everybody here."""
        return [*(seat.connection for seat in self.seats if seat.connection is not None), *self.watchers]

    @property
    def _audience(self) -> list[SeatView | Connection]:
        """What everybody here is sent to through."""
        return [*(seat.view for seat in self.seats if seat.view is not None), *self.watchers]

    def seat_of(self, connection: Connection) -> Seat:
        """Return a connection's seat, or refuse one that has none."""
        for seat in self.seats:
            if seat.connection is connection:
                return seat
        raise RefusedError("out_of_turn", "only who sits at this table may do that; take a seat first")

    def sit(self, connection: Connection, side: protocol.Side, label: str) -> Seat:
        """Give a free seat to a client."""
        seat = self.seats[TEAM_NAMES.index(side)]
        if seat.kind != "free":
            raise RefusedError("taken", f"the {side} seat is taken; take the other one, or watch")
        if any(own.connection is connection for own in self.seats):
            raise RefusedError("out_of_turn", "leave the seat that you have first")
        self._check_side(seat)
        self._check_version(seat, connection)
        self.watchers.discard(connection)
        seat.take(connection, label)
        self._load_helper(seat)
        self._entered(seat, connection)
        return seat

    def reserve(self, team: int) -> None:
        """Keep a seat for a person, who comes with its token."""
        self.seats[team].reserve()
        self._load_helper(self.seats[team])

    def _load_helper(self, seat: Seat) -> None:
        factors = self.config.factors[seat.team]
        if factors.share > 0.0:
            seat.help(self._place(seat, factors.helper), self._context.workers, self._go_on)

    def _place(self, seat: Seat, policy: str) -> PolicySeat:
        key = self.code, seat.team, next(self._places)
        return PolicySeat(key=key, policy=policy, game=self.config.game, team=seat.team)

    def _check_side(self, seat: Seat) -> None:
        if self.config.game.team_sizes[seat.team] == 0:
            raise RefusedError("not_valid", f"{seat.side} has no drones in this room")

    def _check_version(self, seat: Seat, connection: Connection) -> None:
        told = self._commands[seat.team]
        if connection.version < 2 and not told.serves_densities:
            raise RefusedError(
                "not_valid",
                f"{seat.side} is flown by {told.system}, which takes commands of kind {told.takes!r}, and your client "
                "knows densities alone (version 1 of the protocol): watch, take another seat, or use a newer client",
            )

    def resume(self, connection: Connection, seat: Seat) -> None:
        """Give a seat back to who holds its token; another connection that has it is told and left."""
        self._check_version(seat, connection)
        displaced = seat.connection
        if displaced is not None and displaced is not connection:
            self._note(seat, "displaced")
            displaced.send(protocol.Displaced())
        self._entered(seat, connection)

    def _entered(self, seat: Seat, connection: Connection) -> None:
        commands, factors = self._commands[seat.team], self.config.factors[seat.team]
        view = SeatView(connection, seat.team, factors, self.config.speed)
        seat.meet(connection, view)
        told = _told(factors)
        connection.send(
            protocol.Seated(room=self.code, seat=seat.side, token=seat.token, commands=commands, factors=told)
        )
        self._measure(seat)
        self._note(seat, "connected")
        self._welcome(view)
        if seat.target:
            view.send_bytes(seat.target)
        if seat.responses is not None:
            self._tell_acting(seat)
        if self.hosted is not None and self.session is None:
            seat.ready = True
            self._begin_if_ready()

    def _measure(self, seat: Seat) -> None:
        """Let what a seat is shown of a game be measured."""
        if seat.view is not None and self.session is not None and self.outcome is None:
            seat.view.measured = self.session.display_measured[seat.team]

    def watch(self, connection: Connection) -> None:
        """Let somebody look on who has no seat here."""
        if any(own.connection is connection for own in self.seats):
            raise RefusedError("out_of_turn", "you have a seat in this room and see its games; leave it first to watch")
        self.watchers.add(connection)
        self._welcome(connection)

    def _welcome(self, view: SeatView | Connection) -> None:
        self.tell_state()
        if self._tells_later is not None:
            view.send(self._state())
        if self._moment is not None and self.config.speed != 1.0:
            text = f"this game goes on as it was played: at {self.config.speed:g} times the speed"
            view.send(protocol.Notice(text=text))
        if self.session is not None:
            view.send_bytes(self.session.frame(keyframe=True))
        elif self._moment is not None:  # one decides whether one is ready with the board in view
            simulator, now = self._moment.game.simulator, self._context.now_ms()
            view.send_bytes(frame_of(simulator, 0, now, altitudes=True, fields=True))

    def invite(self, connection: Connection, side: protocol.Side, policy: str | None) -> None:
        """Give a seat to a policy, or free it."""
        self.seat_of(connection)
        if self.once:
            raise RefusedError("out_of_turn", "one game is played here, against whom it was opened")
        self.place_policy(side, policy)

    def place_policy(self, side: protocol.Side, policy: str | None) -> None:
        """Give a seat to a policy, or free it."""
        seat = self.seats[TEAM_NAMES.index(side)]
        if seat.kind not in ("free", "policy"):
            raise RefusedError("taken", f"somebody sits in the {side} seat")
        if self.phase in ("starting", "playing"):
            raise RefusedError("out_of_turn", "seats change between games")
        self._check_side(seat)
        helper = self.config.factors[seat.team].helper if self.config.factors[seat.team].share > 0.0 else ""
        if policy is not None and helper:
            reason = f"the {side} seat shares its commands with {helper}: it is for a player, not for another policy"
            raise RefusedError("not_valid", reason)
        seat.free()
        if policy is not None:
            seat.give(self._place(seat, policy), self._context.workers, self._go_on)
        self._changed()

    def _go_on(self) -> None:
        """Begin what waited for a policy, if that can play now."""
        try:
            self._begin_if_ready()
        except RefusedError as error:
            self.tell(protocol.Notice(text=str(error)))

    def ready(self, connection: Connection, ready: bool) -> None:
        """Mark a seat as ready; the game begins when both can play. Whoever is here begins one of two policies."""
        if self.once and self.outcome is not None:
            raise RefusedError("out_of_turn", "one game is played here, and it is over")
        own = None if all(seat.kind == "policy" for seat in self._taking_part) else self.seat_of(connection)
        if self.phase == "playing":
            raise RefusedError("out_of_turn", "the game is running")
        failed = [seat for seat in self.seats if seat.policy_state == "failed"]
        if ready and failed:
            name = failed[0].policy or self.config.factors[failed[0].team].helper
            hint = "; invite another one" if failed[0].policy else ""
            raise RefusedError("not_valid", f"{name} cannot play: {failed[0].reason}{hint}")
        if own is None:
            self._is_called_for = ready
        else:
            own.ready = ready
        if not ready:
            self._call_off()
        self._begin_if_ready()

    @property
    def _taking_part(self) -> list[Seat]:
        return [seat for seat in self.seats if self.config.game.team_sizes[seat.team] > 0]

    def leave(self, connection: Connection) -> None:
        """Give a seat up; in a game the swarm goes on with its last command."""
        self.watchers.discard(connection)
        for seat in self.seats:
            if seat.connection is connection:
                self._note(seat, "disconnected")
                self._call_off()
                if self.phase == "playing":
                    seat.part()
                    seat.token, seat.gone = "", True  # nobody may come back to it
                    seat.drop_responses()
                else:
                    seat.free()
        self._changed()

    def disconnect(self, connection: Connection) -> None:
        """Note that a connection is gone; its seat waits for its token."""
        if connection not in self.connections:
            return  # another has its seat
        self.watchers.discard(connection)
        for seat in self.seats:
            if seat.connection is connection:
                seat.part()
                seat.away_since = time.monotonic()
                seat.ready = False
                self._note(seat, "disconnected")
                self._call_off()
        self._changed()

    def free_absent(self) -> None:
        """Between games, free the seats of those who have been away for long."""
        if self.hosted is not None:
            return  # its host decides
        for seat in self.seats:
            is_away = seat.kind in ("person", "program") and seat.connection is None
            if is_away and self.phase != "playing" and time.monotonic() - seat.away_since > AWAY_S:
                seat.free()
                self._changed()

    @property
    def abandoned(self) -> bool:
        """Whether nobody is here and nobody can come back to a seat."""
        return not self.connections and not any(seat.token for seat in self.seats)

    def tell(self, message: protocol.ServerMessage) -> None:
        """Send a message to everybody here."""
        for view in self._audience:
            view.send(message)

    def _changed(self) -> None:
        self.last_used = time.monotonic()
        self.tell_state()

    def tell_state(self) -> None:
        """Tell everybody how the room stands; soon, where that was told to so many of late that games would wait."""
        if self._tells.take(float(len(self.connections)), time.monotonic()):
            self.tell(self._state())
        elif self._tells_later is None:
            self._tells_later = asyncio.get_running_loop().call_later(_TELL_S, self._tell_later)

    def _tell_later(self) -> None:
        self._tells_later = None
        self.tell(self._state())

    def _state(self) -> protocol.RoomState:
        return protocol.RoomState(
            code=self.code,
            phase=self.phase,
            settings=self.settings,
            red=self.seats[0].state(self.reader.systems[0]),
            blue=self.seats[1].state(self.reader.systems[1]),
            watchers=len(self.watchers),
            sizes=self.session.sizes if self.session is not None else [],
            outcome=self.outcome,
            recording=self.session.recorder.path.name if self.session is not None and self.outcome else None,
            min_command_interval=self.config.min_command_interval,
            starts_ms=self.session.starts_ms if self.session is not None and self.phase == "starting" else None,
            ended_by=self._ended_by if self.outcome is not None else None,
            once=self.once,
            forfeit=self.session.forfeit if self.session is not None and self.outcome is not None else "",
        )

    # --- what players do --------------------------------------------------------------------------

    def commanding(self, connection: Connection) -> Seat:
        """Return the seat of who may command now, or refuse."""
        seat = self.seat_of(connection)
        if self.session is None or self.phase not in ("starting", "playing"):
            raise RefusedError("out_of_turn", "no game is running: commands count once both seats are ready")
        return seat

    def command(self, connection: Connection, message: protocol.CommandMessage, made: Made) -> None:
        """Take a command that was made of a message."""
        seat = self.commanding(connection)
        assert self.session is not None  # noqa: S101
        self.session.game.check_size(made.command)
        self.session.submit(made.command, message.strokes, message.timing)
        connection.send(protocol.Received(number=message.number, server_ms=self._context.now_ms()))
        if self.config.factors[seat.team].share == 0.0:  # else it is shown what is made of it, once that is in force
            self._show_target(seat, made.target)

    def _show_target(self, seat: Seat, target: bytes) -> None:
        seat.target = target
        if seat.view is not None:
            seat.view.send_bytes(target)

    def respond(self, connection: Connection, rules: list[ReadyRule]) -> None:
        """Set the automatic responses of a seat, in place of those that it had."""
        seat = self.seat_of(connection)
        if rules and self.config.factors[seat.team].share > 0.0:
            helper = self.config.factors[seat.team].helper
            raise RefusedError("not_valid", f"{helper} shares this seat's commands: it takes no automatic responses")
        if seat.responses is None:
            told = functools.partial(self._tell_acting, seat), functools.partial(self._rule_failed, seat)
            key, game = (self.code, next(self._places)), self.config.game
            seat.responses = Responses(key, game, seat.team, self._context.workers, *told)
        seat.responses.replace(rules)

    def _tell_acting(self, seat: Seat) -> None:
        connection, view = seat.connection, seat.view
        if connection is not None and view is not None and connection.version > 1 and seat.responses is not None:
            place, sender = seat.responses.acting
            view.send(protocol.Acting(seat=seat.side, rule=place, sender=sender))

    def _rule_failed(self, seat: Seat, reason: str) -> None:
        if seat.connection is not None:
            seat.connection.send(protocol.Refused(code="not_valid", reason=reason[:500], about="rules"))

    def _look(self) -> None:
        for seat in self.seats:
            if seat.responses is not None and self.session is not None:
                seat.responses.look(self.session)

    def painted(self, connection: Connection, message: protocol.Painted) -> None:
        """Note when a command's effect was first seen."""
        seat = self.seat_of(connection)
        if self.session is not None and self.phase == "playing":
            ms = self.session.since_began(message.painted_ms)
            self.session.recorder.write(PaintedLine(team=seat.team, number=message.number, ms=ms))

    def visibility(self, connection: Connection, hidden: bool) -> None:
        """Note that a player's page was hidden or shown."""
        for seat in self.seats:
            if seat.connection is connection:
                self._note(seat, "hidden" if hidden else "shown")

    # --- games ------------------------------------------------------------------------------------

    def _begin_if_ready(self) -> None:
        """Begin to count down if everybody can play; tell how the room stands."""
        of_policies = all(seat.kind == "policy" for seat in self._taking_part)
        can_begin = all(seat.can_play for seat in self._taking_part) and (self._is_called_for or not of_policies)
        if can_begin and self.phase in ("waiting", "over"):
            self._begin()
        else:
            self._changed()

    def _begin(self) -> None:
        recorded = [
            RecordedSeat(kind=seat.kind, policy=seat.policy, label=seat.label if self._context.record_labels else "")
            for seat in self.seats
        ]
        if self.seed is None:
            self.seed = self._moment.seed if self._moment is not None else secrets.randbelow(2**32)
        try:
            session = LiveSession(
                f"{self.code}-{self._games + 1}",
                self.config,
                self.seed,
                (recorded[0], recorded[1]),
                (self.seats[0].place, self.seats[1].place),
                self._context,
                Callbacks(
                    began=self._began,
                    show=self._show,
                    look=self._look,
                    in_force=self._in_force,
                    failed=self._failed,
                    notice=lambda text: self.tell(protocol.Notice(text=text)),
                    over=self._over,
                ),
                self._moment,
                self.lesson,
                self.hosted.path if self.hosted is not None else None,
            )
        except OSError as error:
            raise RefusedError("not_valid", f"the game cannot be recorded: {error.strerror}") from error
        except Exception as error:  # of a control system of another package, perhaps
            log.exception("a game did not begin")
            told = str(error) if isinstance(error, SwarmError) else "the server could not do that"
            raise RefusedError("not_valid", f"the game cannot begin: {told}") from error
        self._before = self.session, self.outcome
        self.session, self.outcome = session, None
        for seat in self.seats:
            coefficients = session.game.simulator.games.coefficients[0, seat.team]
            seat.target = target_message(seat.team, 0, coefficients)
            self._measure(seat)
            if seat.connection is not None:
                self._note(seat, "connected")  # before all that is done in the countdown
        self._changed()
        keyframe = session.frame(keyframe=True)
        for view in self._audience:
            view.send_bytes(keyframe)
        for seat in self.seats:
            if seat.view is not None:
                seat.view.send_bytes(seat.target)

    def _began(self) -> None:
        self._games += 1
        self.seed = self._moment = None
        self._before = None, None
        self._is_called_for = False
        for seat in self.seats:
            seat.ready = seat.kind == "policy"
            if seat.token and self.session is not None:
                self._context.seat_index.note(seat.token, self.session.recorder.path.name)
        self._changed()

    def _call_off(self) -> None:
        """Take back a game that counts down, if there is one."""
        if self.session is not None and self.phase == "starting":
            self.session.call_off()
            self.session, self.outcome = self._before
            self._is_called_for = False

    def stop(self) -> None:
        """End the game, if one is running, and finish its file."""
        self._call_off()
        if self.session is not None:
            self.session.stop()

    def close(self) -> None:
        """End the game, and let the seats' policies go."""
        self.stop()
        for seat in self.seats:
            seat.drop_responses()
            if seat.place is not None:
                seat.free()

    def _show(self, frame: bytes, sequence: int) -> None:
        for view in self._audience:
            view.show(frame, sequence)

    def _in_force(self, command: Command, tick: int) -> None:
        seat = self.seats[command.team]
        if seat.view is not None:
            now, sender = self._context.now_ms(), command.sender
            seat.view.send(protocol.InForceMessage(seat.side, command.number, tick, now, sender))
        if self.config.factors[seat.team].share > 0.0:
            self._show_target(seat, target_of(command, self.reader))

    def _failed(self, team: int, reason: str) -> None:
        seat = self.seats[team]
        self._note(seat, "failed", reason)
        name, kept = seat.policy, "command"
        if not name:
            name, kept = self.config.factors[team].helper, "share of the command"
        self.tell(protocol.Notice(text=f"{name} keeps its last {kept}: {reason}"))

    def _over(self, outcome: Outcome, ended_by: EndedBy) -> None:
        self.outcome, self._ended_by = outcome, ended_by
        for seat in self.seats:
            if seat.responses is not None:
                seat.responses.rest()
            if seat.gone:
                seat.free()
        self._changed()
        if self.over is not None:
            self.over(outcome, ended_by)
        if self.hosted is not None:
            self.hosted.over()

    def _note(
        self,
        seat: Seat,
        event: SeatEvent,
        reason: str = "",
    ) -> None:
        if self.session is not None and (self.phase in ("starting", "playing") or event == "failed"):
            client = seat.connection.client if event == "connected" and seat.connection is not None else None
            self.session.note(
                SeatLine(team=seat.team, event=event, ms=self.session.now_ms, client=client, reason=reason[:500])
            )


def _told(factors: Factors) -> protocol.SeatFactors | None:
    """Return what a seat's client has to know of its factors; None if that is nothing."""
    told = protocol.SeatFactors(
        hide=[*factors.hide],
        frame_rate=factors.frame_rate,
        helper=factors.helper if factors.share > 0.0 else "",
        share=factors.share,
    )
    return told if told != protocol.SeatFactors() else None
