"""The log of a game in real time, which becomes its recording."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import EndedBy, EndMessage, Header, Outcome, SeatCommand, SeatDelays, SeatMessage
from swarm_pz.play.recordings.recorder import Recorder

_FLUSH_TICKS = 15


class GameLog:
    """Records a game; messages during a solve of a control system in Python are logged after it.

    - `server_ms`: returns the server's clock.
    - `has_begun`: the clock runs, or ran.
    """

    def __init__(self, recorder: Recorder, header: Header, game: LiveGame, server_ms: Callable[[], float]) -> None:
        self.recorder, self.server_ms, self._header, self._game = recorder, server_ms, header, game
        self.has_begun = False
        self._held: list[SeatCommand] | None = None
        self._away: set[str] = set()

    def begin(self) -> None:
        """Start the recording's clock, and make its file.

        Raises OSError if the file cannot be made.
        """
        self._header.began_ms = self.server_ms()
        self.recorder.flush()
        self.has_begun = True

    @property
    def is_somebody_away(self) -> bool:
        """True if a player has left, or lost their connection."""
        return bool(self._away)

    def note(self, message: SeatMessage) -> None:
        """Record an event of a seat."""
        if message.event == "disconnected":
            self._away.add(message.seat)
        elif message.event == "connected":
            self._away.discard(message.seat)
        self.recorder.write(message)

    def command(self, message: SeatCommand) -> None:
        """Record a command; one that arrives during a solve counts from the next solve on."""
        if self._held is None:
            self.recorder.write(message)
        else:
            message.tick = self._game.tick + 1
            self._held.append(message)

    @contextlib.contextmanager
    def holding(self) -> Iterator[None]:
        """Hold commands that arrive in this context until its end."""
        held = self._held = []
        try:
            yield
        finally:
            self._held = None
        for message in held:
            self.recorder.write(message)

    def flush(self) -> str:
        """Write what is due to the disk; return a new fault of writing, once, or an empty string."""
        if self._game.tick % _FLUSH_TICKS and not self.recorder.is_behind:
            return ""
        self.recorder.flush()
        fault, self.recorder.fault = self.recorder.fault, ""
        return fault

    def end(self, outcome: Outcome, ended_by: EndedBy, delays: tuple[SeatDelays, SeatDelays] | None) -> None:
        """Record the end of the game, and finish its file."""
        tick, sizes, now = self._game.tick, self._game.sizes, self.server_ms()
        self.recorder.write(EndMessage(outcome, tick, sizes, now, ended_by, delays))
        self.recorder.close()
