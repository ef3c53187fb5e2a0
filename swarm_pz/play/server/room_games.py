"""The games of a room, one after the other: when they begin, who hears of what happens in them, and how they end."""

from __future__ import annotations

import logging
import secrets
import time
from collections.abc import Callable, Sequence
from typing import Literal

from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import EndedBy, Outcome, SeatEvent, SeatLine
from swarm_pz.play.recordings.moment import Moment
from swarm_pz.play.server.audience import Audience
from swarm_pz.play.server.live_session import Callbacks, LiveSession
from swarm_pz.play.server.orders import target_of
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.room_settings import Hosted
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.server.views import target_message

PAUSE_S = 1.0
"""Seconds after a countdown was called off in which none begins: to begin one is work."""
log = logging.getLogger("swarm_pz.play")


class RoomGames:
    """See the module.

    Parameters
    ----------
    code : str
        The room's.
    config : TableConfig
    seats : sequence of Seat
        Red's and blue's.
    audience : Audience
    context : ServerContext
    changed : callable
        Told when anything has changed that everybody in the room should know.
    moment : Moment, optional
        Of a recorded game, that the first game goes on from.
    hosted : Hosted, optional
        Whose only game it is.

    Attributes
    ----------
    session : LiveSession or None
        The game that counts down, is played, or was played last.
    outcome, ended_by : str or None
        Of that game, once it is over.
    moment : Moment or None
        That the next game goes on from.
    seed : int or None
        Of the next game's start; None takes any. Who calls its countdown off is given the same start again.
    lesson : bool
        They are lessons, and say so in their recordings.
    over : callable or None
        Told the outcome and what ended the game, of each that has begun.
    reader : CommandReader
        Of their commands.
    """

    def __init__(
        self,
        code: str,
        config: TableConfig,
        seats: Sequence[Seat],
        audience: Audience,
        context: ServerContext,
        changed: Callable[[], None],
        moment: Moment | None = None,
        hosted: Hosted | None = None,
    ) -> None:
        self._code, self._config, self._seats, self._audience = code, config, seats, audience
        self._context, self._changed, self._hosted = context, changed, hosted
        self.reader = CommandReader(config.game)
        self.moment = moment
        self.seed: int | None = hosted.seed if hosted is not None else None
        self.lesson = False
        self.over: Callable[[Outcome, EndedBy], None] | None = None
        self.session: LiveSession | None = None
        self.outcome: Outcome | None = None
        self.ended_by: EndedBy | None = None
        self._before: tuple[LiveSession | None, Outcome | None] = None, None
        """The session before the one that starts, and its outcome."""
        self._count = 0
        self._called_off_at = -PAUSE_S
        self._is_called_for = False
        """Somebody who is here wants two policies to begin."""

    @property
    def phase(self) -> Literal["waiting", "starting", "playing", "over"]:
        """How far the latest game is."""
        if self.session is None:
            return "waiting"
        if self.outcome is not None:
            return "over"
        return "playing" if self.session.has_begun else "starting"

    @property
    def is_on(self) -> bool:
        """Whether a game counts down, or is played."""
        return self.phase in ("starting", "playing")

    # --- beginnings -------------------------------------------------------------------------------

    @property
    def _taking_part(self) -> list[Seat]:
        return [seat for seat in self._seats if seat.takes_part]

    @property
    def are_of_policies(self) -> bool:
        """Whether nobody else plays."""
        return all(seat.kind == "policy" for seat in self._taking_part)

    def ready(self, own: Seat | None, ready: bool) -> None:
        """Mark a seat as ready, or, with None, call for two policies to begin; the game begins when both can play."""
        if self.phase == "playing":
            raise RefusedError("out_of_turn", "the game is running")
        failed = [seat for seat in self._seats if seat.fault]
        if ready and failed:
            hint = "; invite another one" if failed[0].policy else ""
            raise RefusedError("not_valid", f"{failed[0].fault}{hint}")
        if ready and not self.is_on and time.monotonic() - self._called_off_at < PAUSE_S:
            raise RefusedError("too_many", "the countdown was called off just now; say that you are ready in a second")
        if own is None:
            self._is_called_for = ready
        else:
            own.ready = ready
        if not ready:
            self.call_off()
        self.begin_if_ready()

    def begin_if_ready(self) -> None:
        """Begin to count down if everybody can play; tell how the room stands."""
        can_begin = all(seat.can_play for seat in self._taking_part) and (
            self._is_called_for or not self.are_of_policies
        )
        if can_begin and not self.is_on:
            self._begin()
        else:
            self._changed()

    def go_on(self) -> None:
        """Begin what waited for a policy, if that can play now."""
        try:
            self.begin_if_ready()
        except RefusedError as error:
            self._notice(str(error))

    def _begin(self) -> None:
        if self.seed is None:
            self.seed = self.moment.seed if self.moment is not None else secrets.randbelow(2**32)
        session = self._open(self.seed)
        self._before = self.session, self.outcome
        self.session, self.outcome = session, None
        for seat in self._seats:
            coefficients = session.game.simulator.games.coefficients[0, seat.team]
            seat.target = target_message(seat.team, 0, coefficients)
            self.measure(seat)
            if seat.connection is not None:
                self.note(seat, "connected")  # before all that is done in the countdown
        self._changed()
        self._audience.send_bytes(session.frame(keyframe=True))
        for seat in self._seats:
            seat.show_target()

    def _open(self, seed: int) -> LiveSession:
        """Return a game that counts down, or refuse."""
        red, blue = (seat.recorded(with_label=self._context.record_labels) for seat in self._seats)
        first, second = self._seats
        try:
            return LiveSession(
                f"{self._code}-{self._count + 1}",
                self._config,
                seed,
                (red, blue),
                (first.place, second.place),
                self._context,
                Callbacks(
                    began=self._began,
                    refused=self._refused,
                    is_seen=lambda: self._hosted is not None or bool(self._audience.connections),
                    show=self._audience.show,
                    look=self._look,
                    in_force=self._in_force,
                    failed=self._failed,
                    notice=self._notice,
                    over=self._over,
                ),
                self.moment,
                self.lesson,
                self._hosted.path if self._hosted is not None else None,
            )
        except Exception as error:  # of a control system of another package, perhaps
            log.exception("a game did not begin")
            told = str(error) if isinstance(error, SwarmError) else "the server could not do that"
            raise RefusedError("not_valid", f"the game cannot begin: {told}") from error

    def _refused(self, reason: str) -> None:
        self.call_off()
        for seat in self._seats:
            seat.ready = seat.kind == "policy"
        self._notice(reason)
        self._changed()

    def _began(self) -> None:
        self._count += 1
        self.seed = self.moment = None
        self._before = None, None
        self._is_called_for = False
        for seat in self._seats:
            seat.ready = seat.kind == "policy"
            if seat.token and self.session is not None and self._hosted is None:  # a host's games lead nobody back
                self._context.seat_index.note(seat.token, self.session.recorder.path.name)
        self._changed()

    # --- what happens in a game -------------------------------------------------------------------

    def measure(self, seat: Seat) -> None:
        """Let what a seat is shown of a game be measured."""
        if seat.view is not None and self.session is not None and self.outcome is None:
            seat.view.measured = self.session.display_measured[seat.team]

    def note(self, seat: Seat, event: SeatEvent, reason: str = "") -> None:
        """Write down what became of a seat's client, or policy."""
        if self.session is not None and (self.is_on or event == "failed"):
            client = seat.connection.client if event == "connected" and seat.connection is not None else None
            log_ = self.session.log
            log_.note(SeatLine(team=seat.team, event=event, ms=log_.now_ms, client=client, reason=reason[:500]))

    def _look(self) -> None:
        for seat in self._seats:
            if seat.responses is not None and self.session is not None:
                seat.responses.look(self.session)

    def _in_force(self, command: Command, tick: int) -> None:
        seat = self._seats[command.team]
        now, sender = self._context.now_ms(), command.sender
        seat.send(protocol.InForceMessage(seat.side, command.number, tick, now, sender))
        if seat.helper:
            seat.show_target(target_of(command, self.reader))

    def _failed(self, team: int, reason: str) -> None:
        seat = self._seats[team]
        self.note(seat, "failed", reason)
        kept = "command" if seat.policy else "share of the command"
        self._notice(f"{seat.policy or seat.helper} keeps its last {kept}: {reason}")

    def _notice(self, text: str) -> None:
        self._audience.tell(protocol.Notice(text=text))

    # --- ends -------------------------------------------------------------------------------------

    def call_off(self) -> None:
        """Take back a game that counts down, if there is one."""
        if self.session is not None and self.phase == "starting":
            self.session.call_off()
            self.session, self.outcome = self._before
            self._called_off_at = time.monotonic()
            self._is_called_for = False

    def stop(self) -> None:
        """End the game, if one is running, and finish its file."""
        self.call_off()
        if self.session is not None:
            self.session.stop()

    def _over(self, outcome: Outcome, ended_by: EndedBy) -> None:
        self.outcome, self.ended_by = outcome, ended_by
        for seat in self._seats:
            if seat.responses is not None:
                seat.responses.rest()
            if seat.gone:
                seat.free()
        self._changed()
        if self.over is not None:
            self.over(outcome, ended_by)
        if self._hosted is not None:
            self._hosted.over()
