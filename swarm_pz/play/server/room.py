"""A room: two seats, its watchers, and the games between the seats, one after the other."""

from __future__ import annotations

import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.protocol import EndedBy, Outcome, SeatEvent
from swarm_pz.play.server.audience import Audience
from swarm_pz.play.server.connection import Connection, RefusedError
from swarm_pz.play.server.live_session import LiveSession
from swarm_pz.play.server.rendered_command import RenderedCommand
from swarm_pz.play.server.room_settings import POLICY_COST, RoomPlan, cost_of, settings_of
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.seat_view import SeatView
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.server.views import target_message

AWAY_S = 60.0
"""Seconds that a seat waits between games for a client whose connection was lost."""
PAUSE_S = 1.0
"""Seconds between a countdown that was called off and the next one, since beginning one is costly."""
MOST_WATCHERS = 50
log = logging.getLogger("swarm_pz.play")


class Room:
    """Two seats, and the games between them.

    - `address`: of the client that opened it.
    - `session`: the game that counts down, is played, or was played last.
    - `outcome`, `ended_by`: of that game, once it is over.
    - `last_used`: time of the latest change.
    """

    def __init__(self, code: str, plan: RoomPlan, context: ServerContext, address: str = "") -> None:
        self.code, self.plan, self.address, self._context = code, plan, address, context
        self.settings, self._game_cost = settings_of(plan.config), cost_of(plan.config)
        self.reader = CommandReader(plan.config.game)
        red, blue = (Seat(team, plan.config, code, context.workers) for team in range(2))
        self.seats = red, blue
        self.audience = Audience(self.seats, self._state)
        self.session: LiveSession | None = None
        self.outcome: Outcome | None = None
        self.ended_by: EndedBy | None = None
        self.last_used = time.monotonic()
        self._games = 0
        self._before: tuple[LiveSession | None, Outcome | None] = None, None
        self._called_off_at = -PAUSE_S
        self._is_called_for = False
        """A watcher wants two policies to begin."""
        self._is_rematch = self._is_swapped = False
        """The same two people play again; they have changed sides for the game that counts down."""

    # --- state ------------------------------------------------------------------------------------

    @property
    def phase(self) -> Literal["waiting", "starting", "playing", "over"]:
        """The phase of the latest game."""
        if self.session is None:
            return "waiting"
        if self.outcome is not None:
            return "over"
        return "playing" if self.session.has_begun else "starting"

    @property
    def cost(self) -> float:
        """Cost of its games and policies for the server, in the unit of `cost_of`."""
        return self._game_cost + POLICY_COST * sum(seat.loaded is not None for seat in self.seats)

    @property
    def is_on(self) -> bool:
        """True while a game counts down, or is played."""
        return self.phase in ("starting", "playing")

    @property
    def connections(self) -> list[Connection]:
        """Everybody here."""
        return self.audience.connections

    @property
    def abandoned(self) -> bool:
        """True if nobody is here and nobody can come back to a seat."""
        return not self.connections and not any(seat.token for seat in self.seats)

    def _changed(self) -> None:
        self.last_used = time.monotonic()
        self.audience.send_state()

    def _state(self) -> protocol.RoomState:
        session, outcome, phase = self.session, self.outcome, self.phase
        return protocol.RoomState(
            code=self.code,
            phase=phase,
            settings=self.settings,
            red=self.seats[0].state(),
            blue=self.seats[1].state(),
            sizes=session.sizes if session is not None else [],
            outcome=outcome,
            recording=session.recorder.path.name if session is not None and outcome else None,
            starts_ms=session.starts_ms if session is not None and phase == "starting" else None,
            ended_by=self.ended_by if outcome is not None else None,
            once=self.plan.once,
            forfeit=session.forfeit if session is not None and outcome is not None else "",
            paused=session is not None and session.is_paused and self.is_on,
            wins=(self.seats[0].wins, self.seats[1].wins),
        )

    def _note(self, seat: Seat, event: SeatEvent) -> None:
        if self.session is not None and self.is_on:
            self.session.note(seat, event)

    # --- clients ----------------------------------------------------------------------------------

    def _held_by(self, connection: Connection) -> Seat | None:
        return next((seat for seat in self.seats if seat.connection is connection), None)

    def seat_of(self, connection: Connection) -> Seat:
        """Return a connection's seat, or refuse one without a seat."""
        if (seat := self._held_by(connection)) is None:
            raise RefusedError("out_of_turn", "only players in this room may do that; take a seat first")
        return seat

    def sit(self, connection: Connection, side: protocol.Side, label: str) -> Seat:
        """Give a free seat to a client."""
        seat = self.seats[TEAM_NAMES.index(side)]
        if seat.kind != "free":
            raise RefusedError("taken", f"the {side} seat is taken; take the other one, or watch")
        if self._held_by(connection) is not None:
            raise RefusedError("out_of_turn", "leave the seat that you have first")
        seat.check_side()
        self.audience.watchers.discard(connection)
        self._is_rematch, self.seats[0].wins, self.seats[1].wins = False, 0, 0
        seat.take(connection.kind, label, self._policy_changed)
        self._enter(seat, connection)
        return seat

    def reserve(self, team: int) -> None:
        """Keep a seat for a person, who comes with its token."""
        self.seats[team].take("person", "", self._policy_changed)

    def resume(self, connection: Connection, seat: Seat) -> None:
        """Give a seat back to a client with its token; another connection in it is displaced."""
        displaced = seat.connection
        if displaced is not None and displaced is not connection:
            self._note(seat, "displaced")
            displaced.send(protocol.Displaced())
        self._enter(seat, connection)

    def _enter(self, seat: Seat, connection: Connection) -> None:
        view = seat.meet(connection)
        if self.session is not None and self.outcome is None:
            self.session.measure(seat)
        self._note(seat, "connected")
        self._welcome(view)
        seat.show_target()
        if self.plan.hosted is not None and self.session is None:
            seat.ready = True
            self._begin_if_ready()

    def watch(self, connection: Connection) -> None:
        """Let a client without a seat watch."""
        if self._held_by(connection) is not None:
            raise RefusedError("out_of_turn", "you have a seat in this room and see its games; leave it first to watch")
        if len(self.audience.watchers - {connection}) >= MOST_WATCHERS:
            raise RefusedError("full", f"{MOST_WATCHERS} people watch this room already, and no more can")
        self.audience.watchers.add(connection)
        self._welcome(connection)

    def _welcome(self, view: SeatView | Connection) -> None:
        self.audience.welcome(view)
        if self.session is not None:
            view.send(self.session.frame(keyframe=True))

    def place_policy(self, side: protocol.Side, policy: str) -> None:
        """Give a free seat to a policy."""
        seat = self.seats[TEAM_NAMES.index(side)]
        seat.check_side()
        if seat.helper:
            reason = f"the {side} seat shares its commands with {seat.helper}: it is for a player, not for a policy"
            raise RefusedError("not_valid", reason)
        seat.give(policy, self._policy_changed)
        self._changed()

    def leave(self, connection: Connection) -> None:
        """Give a seat up; in a game the swarm goes on with its last command."""
        self._gone(connection, lambda seat: seat.give_up() if self.phase == "playing" else seat.free())

    def disconnect(self, connection: Connection) -> None:
        """Note that a connection is gone; its seat waits for its token."""
        if connection in self.connections:  # else another has its seat
            self._gone(connection, Seat.wait)

    def _gone(self, connection: Connection, let_go: Callable[[Seat], None]) -> None:
        self.audience.watchers.discard(connection)
        if (seat := self._held_by(connection)) is not None:
            self._note(seat, "disconnected")
            let_go(seat)
            self._call_off()
            if self.session is not None:
                self.session.is_paused = False
        self._changed()

    def free_absent(self) -> None:
        """Between games, free the seats of players who have been away for long, unless a study hosts them."""
        for seat in self.seats if self.plan.hosted is None else ():
            is_away = seat.kind in ("person", "program") and seat.connection is None
            if is_away and self.phase != "playing" and time.monotonic() - seat.away_since > AWAY_S:
                seat.free()
                self._changed()

    # --- commands ---------------------------------------------------------------------------------

    def commanding(self, connection: Connection) -> Seat:
        """Return the seat of a client that may command now, or refuse."""
        seat = self.seat_of(connection)
        if not self.is_on:
            raise RefusedError("out_of_turn", "no game is running: commands count once both seats are ready")
        return seat

    def command(self, connection: Connection, message: protocol.CommandMessage, rendered: RenderedCommand) -> None:
        """Take a command that was rendered from a message."""
        seat = self.commanding(connection)
        assert self.session is not None  # noqa: S101
        self.session.game.check_size(rendered.command)
        self.session.commands.submit(rendered.command, message.strokes, message.timing)
        connection.send(protocol.Received(number=message.number, server_ms=self._context.now_ms()))
        if not seat.helper:  # else the mixture is shown once it is in force
            seat.show_target(rendered.target)

    def visibility(self, connection: Connection, hidden: bool) -> None:
        """Record that a player's page was hidden or shown."""
        if (seat := self._held_by(connection)) is not None:
            self._note(seat, "hidden" if hidden else "shown")

    # --- beginning --------------------------------------------------------------------------------

    @property
    def _taking_part(self) -> list[Seat]:
        return [seat for seat in self.seats if seat.takes_part]

    @property
    def _is_of_policies(self) -> bool:
        return all(seat.kind == "policy" for seat in self._taking_part)

    def ready(self, connection: Connection, ready: bool, label: str | None = None) -> None:
        """Mark a seat as ready; the game begins when both can play. Anybody here may begin a game of two policies."""
        if self.plan.once and self.outcome is not None:
            raise RefusedError("out_of_turn", "one game is played here, and it is over")
        own = None if self._is_of_policies else self.seat_of(connection)
        if self.phase == "playing":
            raise RefusedError("out_of_turn", "the game is running")
        failed = [seat for seat in self.seats if seat.fault]
        if ready and failed:
            raise RefusedError("not_valid", failed[0].fault)
        if ready and not self.is_on and time.monotonic() - self._called_off_at < PAUSE_S:
            raise RefusedError("too_many", "the countdown was called off just now; say that you are ready in a second")
        if own is None:
            self._is_called_for = ready
        else:
            own.ready, own.label = ready, own.label if label is None else label
        if not ready:
            self._call_off()
        self._begin_if_ready()

    def pause(self, connection: Connection, paused: bool) -> None:
        """Pause the game of a player against a policy, or continue it."""
        own = self.seat_of(connection)
        if self.plan.once or self.seats[1 - own.team].kind in ("person", "program"):
            raise RefusedError("out_of_turn", "only a game against a policy can be paused")
        if self.session is not None and self.is_on:
            self.session.is_paused = paused
            self._changed()

    def _begin_if_ready(self) -> None:
        """Begin to count down if everybody can play; send the room's state."""
        is_wanted = self._is_called_for or not self._is_of_policies
        if is_wanted and not self.is_on and all(seat.can_play for seat in self._taking_part):
            self._begin()
        else:
            self._changed()

    def _policy_changed(self) -> None:
        """Begin a game that waited for a policy, if that can play now."""
        try:
            self._begin_if_ready()
        except RefusedError as error:
            self.audience.notice(str(error))

    def _change_sides(self) -> None:
        """Let two people who play again change sides, or change back."""
        self.seats[0].swap(self.seats[1])
        self._is_swapped = not self._is_swapped

    def _begin(self) -> None:
        if self._is_rematch and all(seat.kind == "person" for seat in self.seats):
            self._change_sides()
        if self.plan.seed is None:  # kept if the countdown is called off
            self.plan = replace(self.plan, seed=secrets.randbelow(2**32))
        try:
            session = LiveSession(
                f"{self.code}-{self._games + 1}",
                self.plan,
                self.seats,
                self.audience,
                self._context,
                began=self._began,
                refused=self._refused,
                over=self._over,
            )
        except Exception as error:  # of a control system of another package, perhaps
            is_told = isinstance(error, SwarmError)
            log.error("a game did not begin: %s", error, exc_info=None if is_told else error)
            if self._is_swapped:
                self._change_sides()
            reason = str(error) if is_told else "the server could not do that"
            raise RefusedError("not_valid", f"the game cannot begin: {reason}") from error
        self._before = self.session, self.outcome
        self.session, self.outcome = session, None
        for seat in self.seats:
            seat.target = target_message(seat.team, 0, session.game.simulator.games.coefficients[0, seat.team])
            session.measure(seat)
            if seat.connection is not None:
                session.note(seat, "connected")  # before all other events of the countdown
        self._changed()
        self.audience.send(session.frame(keyframe=True))
        for seat in self.seats:
            seat.show_target()

    def _refused(self, reason: str) -> None:
        self._call_off()
        self._only_policies_are_ready()
        self.audience.notice(reason)
        self._changed()

    def _only_policies_are_ready(self) -> None:
        for seat in self.seats:
            seat.ready = seat.kind == "policy"

    def _began(self) -> None:
        self._before = None, None
        self._is_swapped = False
        self._games += 1
        self.plan = replace(self.plan, seed=None)
        self._is_called_for = False
        self._only_policies_are_ready()
        self._changed()

    # --- end --------------------------------------------------------------------------------------

    def _call_off(self) -> None:
        """Take back a game that counts down, if there is one."""
        if self.session is not None and self.phase == "starting":
            self.session.call_off()
            self.session, self.outcome = self._before
            self._called_off_at = time.monotonic()
            self._is_called_for = False
            if self._is_swapped:
                self._change_sides()

    def _over(self, outcome: Outcome, ended_by: EndedBy) -> None:
        self.outcome, self.ended_by = outcome, ended_by
        self._is_rematch = self.plan.hosted is None and not self.plan.config.varies
        for seat in self.seats:
            seat.wins += outcome == seat.side
            if seat.gone:
                seat.free()
        self._changed()
        if self.plan.hosted is not None:
            self.plan.hosted.over()

    def stop(self) -> None:
        """End the game, if one is running, and finish its file."""
        self._call_off()
        if self.session is not None:
            self.session.stop()

    def close(self) -> None:
        """End the game, and unload the seats' policies."""
        self.stop()
        for seat in self.seats:
            if seat.loaded is not None:
                seat.free()
