"""A recorded game played again: by simulating it, since commands and start decide everything.

Bits depend on the kind of processor, and games are chaotic: on another kind the same commands may lead
elsewhere after some seconds. The recorded frames tell. Of a game that was played in a page they are exact, one for each
control period: there each period is simulated from its own frame, and leads to the next one but for rounding.
"""

from __future__ import annotations

import copy
import math
import time
from collections import defaultdict
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import numpy as np

from swarm_pz.analysis.video import FILM_RATE, open_film
from swarm_pz.config import BLUE, CONTROL_PERIOD, RED, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play.commands import Command
from swarm_pz.play.frames import FASTEST, Frame
from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import CapturedMessage
from swarm_pz.play.recordings.recording import FRAME_TICKS, Recording
from swarm_pz.play.recordings.verification import Verification, faults_of
from swarm_pz.rendering.painter import FILM, Painter

_MOST_FAULTS = 10
_MARK_TICKS = 90
"""Ticks between the moments that are kept, so that going anywhere is quick; more in a game too long to keep so many."""
_MARKS_BYTES = 2**24
"""Memory for the moments that are kept."""
_POSITION_STEP, _VELOCITY_STEP = 1.0 / 65535, FASTEST / 32767
"""Resolution of a frame."""
_ACCELERATION_STEP = 1e-3
"""Tolerance of accelerations in a page, in units of the largest one.

From the same state they differ by less than 1e-4 (tests/play/engine_cases.py); here the controller's memory is our own,
and in 5,300 solves the largest difference was 1.5e-4.
"""
_ROUNDING = 2e-7
"""Further tolerance of positions and velocities of float32."""


class Playback:
    """A recorded game that can be set to any of its ticks; `game` is the one at the present moment."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self._followed = recording.in_force()
        self._exact = {frame.tick: frame for frame in recording.frames() if frame.is_exact}
        self.game = LiveGame(recording.config, recording.header.seed)
        self._next = 0
        start = self.game.simulator.snapshot()
        most = max(2, _MARKS_BYTES // sum(array.nbytes for array in start))
        self._marks, self._mark_ticks = {0: start}, _MARK_TICKS * -(-(recording.last_tick // _MARK_TICKS + 1) // most)

    def seek(self, tick: int) -> None:
        """Go to a tick, before its solve, or to the last one before it that was recorded."""
        tick = max(tick, 0)
        mark = max(known for known in self._marks if known <= tick)
        if tick < self.game.tick or self.game.tick < mark:
            self._go_to_mark(mark)
        self.advance(tick - self.game.tick)

    def fork(self, tick: int) -> Playback:
        """Return another playback of the recording, at a tick; this one stays where it is."""
        other = copy.copy(self)
        other._go_to_mark(0)
        other.seek(tick)
        return other

    def _go_to_mark(self, mark: int) -> None:
        before = [(when, command.team) for when, command in self._followed if when < mark]
        self.game = LiveGame(self.recording.config, self.recording.header.seed)
        last = [max((when for when, whose in before if whose == team), default=None) for team in (RED, BLUE)]
        self.game.restore(self._marks[mark], last)
        self._next = len(before)

    def advance(self, ticks: int) -> list[Command]:
        """Go on by some ticks, or to the end of what was recorded, and return what came into force."""
        game = self.game
        end = min(game.tick + ticks, self.recording.last_tick)
        came: list[Command] = []
        while game.tick < end and not game.over:
            if (frame := self._exact.get(game.tick)) is not None:
                games = game.simulator.games
                games.positions[0], games.velocities[0] = frame.positions, frame.velocities
            if game.tick % self._mark_ticks == 0 and game.tick not in self._marks:
                self._marks[game.tick] = game.simulator.snapshot()
            while self._next < len(self._followed) and self._followed[self._next][0] <= game.tick:
                came.append(self._followed[self._next][1])
                game.put_in_force(came[-1])
                self._next += 1
            until = self._followed[self._next][0] if self._next < len(self._followed) else end
            mark = (game.tick // self._mark_ticks + 1) * self._mark_ticks
            period = (game.tick // FRAME_TICKS + 1) * FRAME_TICKS if self._exact else end
            game.simulator.advance(min(until, end, mark, period) - game.tick)
        return came

    def verify(self, limit_s: float = math.inf) -> Verification:
        """Compare all that follows from commands and start with what was recorded.

        Raises RecordingError if that takes more than `limit_s` seconds.
        """
        frames, difference = self._compare(time.monotonic() + limit_s)
        # Where the simulation leads elsewhere, it says nothing of the end.
        faults = faults_of(self.recording, self.game if difference is None else None)
        return Verification(
            frames=frames,
            first_difference=difference,
            faults=tuple(islice(faults, _MOST_FAULTS)),
            finished=self.recording.end is not None,
            in_page=bool(self._exact),
        )

    def _compare(self, until: float) -> tuple[int, int | None]:
        """Return the number of frames compared, and the first tick whose frame or captures differ."""
        recording = self.recording
        captured: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for line in recording.of(CapturedMessage):
            captured[line.tick].append((line.drone, line.team))
        frames = recording.frames()
        frame, count = next(frames, None), 0
        self.seek(0)
        teams = self.game.simulator.games.teams[0].copy()
        for tick in range(recording.last_tick + 1):
            if time.monotonic() > until:
                raise RecordingError(
                    f"{recording.name} takes too long to play again here; try swarm-pz replay --verify"
                )
            is_torn = recording.end is None and tick == recording.last_tick  # what came after was lost
            self.advance(tick - self.game.tick)
            before, teams = teams, self.game.simulator.games.teams[0].copy()
            taken = [(int(drone), int(teams[drone])) for drone in np.flatnonzero(teams != before)]
            recorded = captured[tick]
            if self.game.tick != tick or recorded != (taken[: len(recorded)] if is_torn else taken):
                return count, tick
            is_due = tick % FRAME_TICKS == 0 or self.game.over
            if frame is not None and frame.tick == tick:
                count += 1
                if not is_due or not self._shows(frame):
                    return count, tick
                frame = next(frames, None)
            elif is_due and not is_torn:
                return count, tick
        return count, None if frame is None else frame.tick

    def film(self, path: Path, speed: float = 2.0, progress: Callable[[float, float], None] | None = None) -> None:
        """Write the game as a film.

        The suffix chooses the format, .gif or .mp4; `speed` is in seconds of game a second of film; `progress` is
        called with the seconds of game shown so far, and all of them. Errors are as of `open_film`.
        """
        every = max(1, round(speed / CONTROL_PERIOD / FILM_RATE)) * TICKS_PER_CONTROL_PERIOD
        seats = (self.recording.header.red, self.recording.header.blue)
        red, blue = (seat.policy or seat.label or seat.kind for seat in seats)
        painter, last = Painter((red, blue), targets=True, layout=FILM), self.recording.last_tick
        with open_film(path, speed * TICKS_PER_SECOND / every, painter.size) as append:
            for tick in range(0, last + every, every):
                self.seek(tick)
                append(painter.draw(self.game.simulator))
                if progress is not None:
                    progress(min(tick, last) / TICKS_PER_SECOND, last / TICKS_PER_SECOND)

    def _shows(self, frame: Frame) -> bool:
        """Tell whether a frame, which holds neither altitudes nor fields in recordings, shows the present moment."""
        simulator = self.game.simulator
        positions = np.abs(frame.positions - simulator.positions[0]).max(initial=0.0)
        velocities = np.abs(np.clip(simulator.speeds[0], -FASTEST, FASTEST) - frame.velocities).max(initial=0.0)
        near, alike = 0.51 * _POSITION_STEP, 0.51 * _VELOCITY_STEP
        if frame.is_exact:
            largest = self.recording.config.game.controller.max_acceleration
            alike = _ACCELERATION_STEP * largest * CONTROL_PERIOD + _ROUNDING
            near = alike * CONTROL_PERIOD + _ROUNDING
        is_here = positions <= near and velocities <= alike
        is_same = is_here and (frame.teams == simulator.teams[0]).all()
        return bool(is_same) and frame.altitudes is None and frame.fields is None
