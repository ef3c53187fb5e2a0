"""Who sees what happens in a room: the clients in its seats, through their views, and those who watch."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence

from swarm_pz.play import protocol
from swarm_pz.play.server.budget import Budget
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.seat_view import SeatView

_MOST_TOLD = 200.0
"""So many are told how a room stands, at once and in a second: each who enters is news to all who are there."""
_TELL_S = 0.5
"""Beyond that, all of them are told after so long."""


class Audience:
    """Everybody in a room.

    Parameters
    ----------
    seats : sequence of Seat
    state : callable
        Returns how the room stands.

    Attributes
    ----------
    watchers : set of Connection
        Who has no seat.
    """

    def __init__(self, seats: Sequence[Seat], state: Callable[[], protocol.RoomState]) -> None:
        self._seats, self._state = seats, state
        self.watchers: set[Connection] = set()
        self._tells = Budget(_MOST_TOLD, _MOST_TOLD, time.monotonic())
        self._tells_later: asyncio.TimerHandle | None = None

    @property
    def connections(self) -> list[Connection]:
        """Everybody here."""
        return [*(seat.connection for seat in self._seats if seat.connection is not None), *self.watchers]

    @property
    def _views(self) -> list[SeatView | Connection]:
        """What everybody here is sent to through."""
        return [*(seat.view for seat in self._seats if seat.view is not None), *self.watchers]

    def tell(self, message: protocol.ServerMessage) -> None:
        """Send a message to everybody."""
        for view in self._views:
            view.send(message)

    def send_bytes(self, data: bytes) -> None:
        """Send everybody something binary that must arrive."""
        for view in self._views:
            view.send_bytes(data)

    def show(self, frame: bytes, sequence: int) -> None:
        """Show everybody a frame."""
        for view in self._views:
            view.show(frame, sequence)

    def welcome(self, view: SeatView | Connection) -> None:
        """Tell everybody how the room stands, now that one more is here; who that is, at once."""
        self.tell_state()
        if self._tells_later is not None:
            view.send(self._state())

    def tell_state(self) -> None:
        """Tell everybody how the room stands; soon, where that was told to so many of late that games would wait."""
        if self._tells.take(float(len(self.connections)), time.monotonic()):
            self.tell(self._state())
        elif self._tells_later is None:
            self._tells_later = asyncio.get_running_loop().call_later(_TELL_S, self._tell_later)

    def _tell_later(self) -> None:
        self._tells_later = None
        self.tell(self._state())
