"""A room: two seats, who watches, and the games between them."""

from __future__ import annotations

import time
from typing import Literal

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.recordings.format import Outcome
from swarm_pz.play.recordings.moment import Moment
from swarm_pz.play.server.audience import Audience
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.live_session import LiveSession
from swarm_pz.play.server.orders import Made
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.responses import ReadyRule
from swarm_pz.play.server.room_games import RoomGames
from swarm_pz.play.server.room_settings import Hosted, cost_of, settings_of, table_config
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.seat_view import SeatView
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.server.views import frame_of

AWAY_S = 60.0
"""Seconds that a seat waits between games for who has left without saying so."""


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
    config : TableConfig
    settings : protocol.Settings
    cost : float
        What its games take of the server, as `cost_of` says.
    seats : (Seat, Seat)
    audience : Audience
    games : RoomGames
    once : bool
        One game is played here, between those who sat down for it, and no more.
    ranked : bool
        It counts for a player's level: no policy may command in the player's place.
    last_used : float
        When anything was last done here.
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
        self.code, self._context = code, context
        self.address, self.hosted = address, hosted
        if hosted is not None:
            self.config = hosted.config
        elif moment is None:
            self.config = table_config(settings, context.table)
        else:  # by its rules; what was varied then is not now
            self.config = moment.game.config.replace(factors=(Factors(), Factors()))
        self.settings, self.cost = settings_of(self.config), cost_of(self.config)
        self.last_used = time.monotonic()
        self.once = self.ranked = False
        self.seats = (
            Seat(0, self.config, code, context.workers),
            Seat(1, self.config, code, context.workers),
        )
        self.audience = Audience(self.seats, self._state)
        self.games = RoomGames(code, self.config, self.seats, self.audience, context, self._changed, moment, hosted)
        self.reader = self.games.reader

    # --- how it stands ----------------------------------------------------------------------------

    @property
    def phase(self) -> Literal["waiting", "starting", "playing", "over"]:
        """How far its latest game is."""
        return self.games.phase

    @property
    def session(self) -> LiveSession | None:
        """Its latest game."""
        return self.games.session

    @property
    def outcome(self) -> Outcome | None:
        """Of that, once it is over."""
        return self.games.outcome

    @property
    def connections(self) -> list[Connection]:
        """Everybody here."""
        return self.audience.connections

    @property
    def abandoned(self) -> bool:
        """Whether nobody is here and nobody can come back to a seat."""
        return not self.connections and not any(seat.token for seat in self.seats)

    def _changed(self) -> None:
        self.last_used = time.monotonic()
        self.audience.tell_state()

    def _state(self) -> protocol.RoomState:
        session, outcome, phase = self.session, self.outcome, self.phase
        return protocol.RoomState(
            code=self.code,
            phase=phase,
            settings=self.settings,
            red=self.seats[0].state(),
            blue=self.seats[1].state(),
            watchers=len(self.audience.watchers),
            sizes=session.sizes if session is not None else [],
            outcome=outcome,
            recording=session.recorder.path.name if session is not None and outcome else None,
            min_command_interval=self.config.min_command_interval,
            starts_ms=session.starts_ms if session is not None and phase == "starting" else None,
            ended_by=self.games.ended_by if outcome is not None else None,
            once=self.once,
            forfeit=session.forfeit if session is not None and outcome is not None else "",
        )

    # --- who sits where ---------------------------------------------------------------------------

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
        seat.check_side()
        self.audience.watchers.discard(connection)
        seat.take(connection, label)
        seat.help(self.games.go_on)
        self._entered(seat, connection)
        return seat

    def reserve(self, team: int) -> None:
        """Keep a seat for a person, who comes with its token."""
        self.seats[team].reserve()
        self.seats[team].help(self.games.go_on)

    def resume(self, connection: Connection, seat: Seat) -> None:
        """Give a seat back to who holds its token; another connection that has it is told and left."""
        displaced = seat.connection
        if displaced is not None and displaced is not connection:
            self.games.note(seat, "displaced")
            displaced.send(protocol.Displaced())
        self._entered(seat, connection)

    def _entered(self, seat: Seat, connection: Connection) -> None:
        view = seat.meet(connection)
        self.games.measure(seat)
        self.games.note(seat, "connected")
        self._welcome(view)
        seat.show_target()
        seat.tell_acting()
        if self.hosted is not None and self.session is None:
            seat.ready = True
            self.games.begin_if_ready()

    def watch(self, connection: Connection) -> None:
        """Let somebody look on who has no seat here."""
        if any(own.connection is connection for own in self.seats):
            raise RefusedError("out_of_turn", "you have a seat in this room and see its games; leave it first to watch")
        self.audience.watchers.add(connection)
        self._welcome(connection)

    def _welcome(self, view: SeatView | Connection) -> None:
        moment = self.games.moment
        self.audience.welcome(view)
        if moment is not None and self.config.speed != 1.0:
            text = f"this game goes on as it was played: at {self.config.speed:g} times the speed"
            view.send(protocol.Notice(text=text))
        if self.session is not None:
            view.send_bytes(self.session.frame(keyframe=True))
        elif moment is not None:  # one decides whether one is ready with the board in view
            simulator, now = moment.game.simulator, self._context.now_ms()
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
        if self.games.is_on:
            raise RefusedError("out_of_turn", "seats change between games")
        seat.check_side()
        if policy is not None and seat.helper:
            reason = (
                f"the {side} seat shares its commands with {seat.helper}: it is for a player, not for another policy"
            )
            raise RefusedError("not_valid", reason)
        seat.free()
        if policy is not None:
            seat.give(policy, self.games.go_on)
        self._changed()

    def leave(self, connection: Connection) -> None:
        """Give a seat up; in a game the swarm goes on with its last command."""
        self.audience.watchers.discard(connection)
        for seat in self.seats:
            if seat.connection is connection:
                self.games.note(seat, "disconnected")
                self.games.call_off()
                if self.phase == "playing":
                    seat.give_up()
                else:
                    seat.free()
        self._changed()

    def disconnect(self, connection: Connection) -> None:
        """Note that a connection is gone; its seat waits for its token."""
        if connection not in self.connections:
            return  # another has its seat
        self.audience.watchers.discard(connection)
        for seat in self.seats:
            if seat.connection is connection:
                seat.wait()
                self.games.note(seat, "disconnected")
                self.games.call_off()
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

    def stop(self) -> None:
        """End the game, if one is running, and finish its file."""
        self.games.stop()

    def close(self) -> None:
        """End the game, and let the seats' policies go."""
        self.stop()
        for seat in self.seats:
            seat.drop_responses()
            if seat.loaded is not None:
                seat.free()

    # --- what players do --------------------------------------------------------------------------

    def ready(self, connection: Connection, ready: bool) -> None:
        """Mark a seat as ready; the game begins when both can play. Whoever is here begins one of two policies."""
        if self.once and self.outcome is not None:
            raise RefusedError("out_of_turn", "one game is played here, and it is over")
        self.games.ready(None if self.games.are_of_policies else self.seat_of(connection), ready)

    def commanding(self, connection: Connection) -> Seat:
        """Return the seat of who may command now, or refuse."""
        seat = self.seat_of(connection)
        if not self.games.is_on:
            raise RefusedError("out_of_turn", "no game is running: commands count once both seats are ready")
        return seat

    def command(self, connection: Connection, message: protocol.CommandMessage, made: Made) -> None:
        """Take a command that was made of a message."""
        seat = self.commanding(connection)
        assert self.session is not None  # noqa: S101
        self.session.game.check_size(made.command)
        self.session.commands.submit(made.command, message.strokes, message.timing)
        connection.send(protocol.Received(number=message.number, server_ms=self._context.now_ms()))
        if not seat.helper:  # else it is shown what is made of it, once that is in force
            seat.show_target(made.target)

    def respond(self, connection: Connection, rules: list[ReadyRule]) -> None:
        """Set the automatic responses of a seat, in place of those that it had."""
        self.seat_of(connection).respond(rules)

    def painted(self, connection: Connection, message: protocol.Painted) -> None:
        """Note when a command's effect was first seen."""
        seat = self.seat_of(connection)
        if self.session is not None and self.phase == "playing":
            self.session.log.painted(seat.team, message.number, message.painted_ms)

    def visibility(self, connection: Connection, hidden: bool) -> None:
        """Note that a player's page was hidden or shown."""
        for seat in self.seats:
            if seat.connection is connection:
                self.games.note(seat, "hidden" if hidden else "shown")
