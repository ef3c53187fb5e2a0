"""A running game's recording."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from swarm_pz.play.game import Captured, InForce, LiveGame
from swarm_pz.play.recordings.format import (
    CapturedLine,
    CommandLine,
    EndedBy,
    EndLine,
    InForceLine,
    Outcome,
    PaintedLine,
    SeatDelays,
    SeatLine,
    frame_line,
)
from swarm_pz.play.recordings.recorder import Recorder

_FLUSH_TICKS = 15


class GameLog:
    """Writes a game down, with its times since it began.

    What happens in the countdown is written once the game has begun; what arrives while control systems choose, once
    they have chosen.

    - `server_ms`: returns the server's clock.
    - `starts_ms`: when the countdown should be over, by that clock.
    - `has_begun`: whether the clock runs, or ran.
    """

    def __init__(
        self,
        recorder: Recorder,
        game: LiveGame,
        server_ms: Callable[[], float],
        starts_ms: float,
    ) -> None:
        self.recorder, self.server_ms, self._game = recorder, server_ms, game
        self._began_ms = starts_ms
        self.has_begun = False
        self._held: list[CommandLine] | None = None
        """What arrives while control systems choose accelerations: it counts from the next solve on."""
        self._early: list[CommandLine | SeatLine] = []
        """What came in the countdown; its times count from when that should have been over."""
        self._away: set[int] = set()

    @property
    def now_ms(self) -> float:
        """Milliseconds since the game began, on the server's clock; negative in the countdown."""
        return self.since_began(self.server_ms())

    def since_began(self, server_ms: float) -> float:
        """Return a time of the server's clock as milliseconds since the game began."""
        return server_ms - self._began_ms

    def begin(self) -> None:
        """Count from now, make the file, and write down what came before.

        Raises OSError if the file cannot be made.
        """
        self.recorder.flush()
        planned, self._began_ms = self._began_ms, self.server_ms()
        self.has_begun = True
        for line in self._early:
            if isinstance(line, CommandLine):
                line.received_ms -= self._began_ms - planned
            else:
                line.ms -= self._began_ms - planned
            self.recorder.write(line)
        self._early.clear()

    # --- what somebody does -----------------------------------------------------------------------

    @property
    def is_somebody_away(self) -> bool:
        """Whether a player has left, or lost their connection."""
        return bool(self._away)

    def note(self, line: SeatLine) -> None:
        """Write down what became of a seat's connection."""
        if line.event == "disconnected":
            self._away.add(line.team)
        elif line.event == "connected":
            self._away.discard(line.team)
        (self.recorder.write if self.has_begun else self._early.append)(line)

    def command(self, line: CommandLine) -> None:
        """Write down a command."""
        if not self.has_begun:
            self._early.append(line)
        elif self._held is not None:
            line.tick = self._game.tick + 1
            self._held.append(line)
        else:
            self.recorder.write(line)

    def painted(self, team: int, number: int, server_ms: float) -> None:
        """Write down when a command's effect was first seen."""
        self.recorder.write(PaintedLine(team=team, number=number, ms=self.since_began(server_ms)))

    @contextlib.contextmanager
    def holding(self) -> Iterator[None]:
        """Write down commands that arrive in this context only at its end."""
        held = self._held = []
        try:
            yield
        finally:
            self._held = None
        for line in held:
            self.recorder.write(line)

    # --- what happens -----------------------------------------------------------------------------

    def frame(self, frame: bytes) -> None:
        """Write down the present moment."""
        self.recorder.write(frame_line(frame, self._game.tick))

    def in_force(self, event: InForce) -> None:
        """Write down that a command has come into force."""
        team, number, sender = event.command.team, event.command.number, event.command.sender
        self.recorder.write(InForceLine(team=team, number=number, tick=event.tick, ms=self.now_ms, sender=sender))

    def captured(self, event: Captured) -> None:
        """Write down a capture."""
        self.recorder.write(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))

    def flush(self) -> str:
        """Write what is due to the disk; return, once, why the recording breaks off, or nothing."""
        if self._game.tick % _FLUSH_TICKS and not self.recorder.is_behind:
            return ""
        self.recorder.flush()
        fault, self.recorder.fault = self.recorder.fault, ""
        return fault

    def end(self, outcome: Outcome, ended_by: EndedBy, delays: tuple[SeatDelays, SeatDelays] | None) -> None:
        """Write down how the game ended, and finish its file."""
        tick, sizes = self._game.tick, self._game.sizes
        self.recorder.write(
            EndLine(outcome=outcome, tick=tick, sizes=sizes, ms=self.now_ms, ended_by=ended_by, delays=delays)
        )
        self.recorder.close()
