"""Everybody in a room: the clients in its seats, through their views, and the watchers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from swarm_pz.play import protocol
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.rate_limit import RateLimit
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.seat_view import SeatView

MOST_STATES_A_SECOND = 20
"""Most states of a room sent in a second: each client who enters changes the state for all."""
SEND_S = 0.5
"""Seconds after which, beyond that limit, the next state is sent."""


class Audience:
    """Everybody in a room; `state` returns the room's state, and `watchers` have no seat."""

    def __init__(self, seats: Sequence[Seat], state: Callable[[], protocol.RoomState]) -> None:
        self._seats, self._state = seats, state
        self.watchers: set[Connection] = set()
        self._limit = RateLimit(MOST_STATES_A_SECOND, 1.0)
        self._later: asyncio.TimerHandle | None = None

    @property
    def connections(self) -> list[Connection]:
        """Everybody here."""
        return [*(seat.connection for seat in self._seats if seat.connection is not None), *self.watchers]

    @property
    def _views(self) -> list[SeatView | Connection]:
        return [*(seat.view for seat in self._seats if seat.view is not None), *self.watchers]

    def send(self, message: protocol.ServerMessage | bytes) -> None:
        """Send everybody a message, or bytes that must arrive."""
        for view in self._views:
            view.send(message)

    def notice(self, text: str) -> None:
        """Send everybody a notice."""
        self.send(protocol.Notice(text=text))

    def show(self, frame: bytes, sequence: int) -> None:
        """Show everybody a frame."""
        for view in self._views:
            view.show(frame, sequence)

    def welcome(self, view: SeatView | Connection) -> None:
        """Send the room's state to everybody, and to a newcomer at once."""
        self.send_state()
        if self._later is not None:
            view.send(self._state())

    def send_state(self) -> None:
        """Send everybody the room's state; a little later if it changes too often."""
        if self._limit.take():
            self.send(self._state())
        elif self._later is None:
            self._later = asyncio.get_running_loop().call_later(SEND_S, self._send_later)

    def _send_later(self) -> None:
        self._later = None
        self.send(self._state())
