"""Recorded games that are watched at a table, each by one client, who may go to any moment of it.

Two threads read and simulate them, so the event loop only sends what they return. Where a game comes out as recorded,
the simulation is shown, with capture fields and targets; where it does not, because the processor is of another kind,
the recorded frames are.
"""

from __future__ import annotations

import asyncio
import bisect
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from swarm_pz.config import BLUE, RED, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.recordings.folder import read_regular
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import FRAME_TICKS, Recording
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.room_settings import settings_of
from swarm_pz.play.server.views import frame_of, target_message
from swarm_pz.play.server.worker import Worker

MOST_BYTES, MOST_LISTS = 16 * 2**20, 10**6
"""Largest file that is read here, and most lists in it: each takes twenty times as much memory as in the file."""
MOST_SECONDS = 120.0
"""For playing one through."""
T = TypeVar("T")
log = logging.getLogger("swarm_pz.play")


@dataclass(frozen=True)
class LoadedRecording:
    """A recorded game that was played through.

    - `sizes`: drones of red and blue, once a second since the start.
    - `is_verified`: its simulation comes out as recorded.
    - `size`: bytes of its file.
    """

    recording: Recording
    frames: list[Frame]
    sizes: list[tuple[int, int]]
    playback: Playback
    is_verified: bool
    size: int

    @classmethod
    def read(cls, path: Path) -> LoadedRecording:
        """Read a recorded game and play it through.

        Raises RecordingError if it cannot be read, or shows nothing.
        """
        recording = Recording.read(path)
        frames = list(recording.frames())
        if not frames:
            raise RecordingError(f"{path.name} broke off before anything was to be seen")
        playback = Playback(recording)
        is_verified = playback.verify(MOST_SECONDS).verified
        return cls(recording, frames, sizes_of(frames), playback, is_verified, path.stat().st_size)

    @property
    def state(self) -> protocol.RoomState:
        """The state that the client gets."""
        header, end, config = self.recording.header, self.recording.end, self.recording.config
        red, blue = (
            protocol.SeatState(seat.kind, seat.policy, seat.label, True, system=system.name, takes=system.takes)
            for seat, system in zip((header.red, header.blue), config.game.team_systems, strict=True)
        )
        return protocol.RoomState(
            code="",
            phase="replay",
            settings=settings_of(config),
            red=red,
            blue=blue,
            watchers=1,
            sizes=self.sizes,
            min_command_interval=config.min_command_interval,
            outcome=end.outcome if end is not None else None,
            recording=self.recording.name,
            last_tick=self.recording.last_tick,
            ended_by=end.ended_by if end is not None else None,
            forfeit=self.recording.forfeit,
        )

    def picture(self, tick: int, sequence: int, is_sought: bool) -> tuple[list[bytes], bytes]:
        """Go to a tick; return what comes before the frame, and the frame.

        That is targets, all or those that came into force on the way, and the frames of trails where one has jumped.
        """
        playback, last = self.playback, bisect.bisect_right(self.frames, tick, key=lambda frame: frame.tick)
        past = self.frames[max(last - 5 * TICKS_PER_SECOND // FRAME_TICKS, 0) : last : 3] if is_sought else []
        trails = [encode_frame(replace(frame, sequence=0, server_ms=0.0)) for frame in past]
        if not self.is_verified:
            altitudes = playback.game.simulator.altitudes[0]  # of the start, which every processor draws alike
            frame = replace(self.frames[max(last - 1, 0)], sequence=sequence, server_ms=0.0, altitudes=altitudes)
            return trails, encode_frame(frame)
        if is_sought:
            playback.seek(tick)
            came = [(team, 0) for team in (RED, BLUE)]
        else:
            came = [(command.team, command.number) for command in playback.advance(tick - playback.game.tick)]
        simulator = playback.game.simulator
        targets = [target_message(team, number, simulator.games.coefficients[0, team]) for team, number in came]
        return trails + targets, frame_of(simulator, sequence, 0.0, altitudes=True, fields=True)


def sizes_of(frames: Sequence[Frame]) -> list[tuple[int, int]]:
    """Return the drones of red and blue at the beginning of each second that frames show."""
    by_second = {frame.tick // TICKS_PER_SECOND: frame for frame in reversed(frames)}
    blue = {second: int(frame.teams.sum()) for second, frame in by_second.items()}
    count = len(frames[0].teams)
    return [(count - blue[second], blue[second]) for second in sorted(blue)]


def bounded(path: Path, work: Callable[[Path], T]) -> T:
    """Return the result of a function of a recording's path, if the file is not too large; every error names it."""
    try:
        if path.stat().st_size > MOST_BYTES or read_regular(path).count(b"[") > MOST_LISTS:
            raise RecordingError(
                f"{path.name} is too long to be watched here; swarm-pz replay --film makes a film of it"
            )
        return work(path)
    except SwarmError:
        raise
    except Exception as error:
        raise RecordingError(
            f"{path.name} cannot be played again: {type(error).__name__}: {str(error)[:300]}"
        ) from error


class ReplaySession:
    """A recorded game as one client watches it."""

    def __init__(self, loaded: LoadedRecording, player: Worker, connection: Connection) -> None:
        self.size, self._loaded, self._player, self._connection = loaded.size, loaded, player, connection
        self._last_tick = loaded.recording.last_tick
        self._tick = 0
        self._is_sought = True
        self._speed = 1.0
        self._sequence = 0
        connection.send(loaded.state)
        self._clock = asyncio.create_task(self._run())

    def seek(self, tick: int) -> None:
        """Show a moment soon; of those that are asked for meanwhile, the latest."""
        self._tick, self._is_sought = min(tick, self._last_tick), True

    def pace(self, speed: float) -> None:
        """Play at this many seconds of game a second; 0 holds."""
        self._speed = speed

    def close(self) -> None:
        """Show nothing more."""
        self._clock.cancel()

    async def _run(self) -> None:
        owed = 0.0
        try:
            while True:
                before, ticks, owed = self._tick, int(owed), owed - int(owed)
                is_sought, self._is_sought = self._is_sought, False
                if not is_sought:
                    self._tick = min(before + ticks, self._last_tick)
                if is_sought or self._tick > before:
                    await self._show(is_sought)
                await asyncio.sleep(1.0 / TICKS_PER_SECOND)
                owed = min(owed + self._speed, 8.0)
        except Exception:
            log.exception("a recorded game was not shown to its end")
            self._connection.send(protocol.Notice(text="this recorded game cannot be shown any further"))

    async def _show(self, is_sought: bool) -> None:
        self._sequence += 1
        before, frame = await self._player.do(self._loaded.picture, self._tick, self._sequence, is_sought)
        for data in before:
            self._connection.send_bytes(data)
        self._connection.show(frame, self._sequence)
