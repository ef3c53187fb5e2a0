"""A recorded game shown to one client, who may go to any moment of it.

Where a simulation comes out as recorded, that is what is shown, with capture fields and targets; where
it does not, because the processor is of another kind, the recorded frames are.

Whatever simulates or reads happens in a thread; the event loop only sends what comes of it.
"""

from __future__ import annotations

import asyncio
import bisect
import functools
import logging
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

from swarm_pz.config import BLUE, RED, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.recordings.format import Origin, Recording
from swarm_pz.play.recordings.moment import Moment
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.room_settings import settings_of
from swarm_pz.play.server.views import frame_of, target_message

log = logging.getLogger("swarm_pz.play")
_MOST_BYTES = 64 * 2**20


@dataclass(frozen=True)
class LoadedRecording:
    """A recorded game that was played through.

    Attributes
    ----------
    recording : Recording
    frames : list of Frame
    sizes : list of (int, int)
        Drones of red and blue, once a second since the start.
    playback : Playback
    is_verified : bool
        Whether its simulation comes out as recorded.
    size : int
        Bytes of its file.
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

        Raises
        ------
        RecordingError
            If it is too long, cannot be read, or shows nothing.
        """
        if (size := path.stat().st_size) > _MOST_BYTES:
            raise RecordingError(
                f"{path.name} is too long to be watched here; swarm-pz replay --film makes a film of it"
            )
        recording = Recording.read(path)
        frames = list(recording.frames())
        if not frames:
            raise RecordingError(f"{path.name} broke off before anything was to be seen")
        playback = Playback(recording)
        return cls(recording, frames, sizes_of(frames), playback, playback.verify().verified, size)


def sizes_of(frames: Sequence[Frame]) -> list[tuple[int, int]]:
    """Return the drones of red and blue at the beginning of each second that frames show."""
    by_second = {frame.tick // TICKS_PER_SECOND: frame for frame in reversed(frames)}
    blue = {second: int(frame.teams.sum()) for second, frame in by_second.items()}
    count = len(frames[0].teams)
    return [(count - blue[second], blue[second]) for second in sorted(blue)]


class ReplaySession:
    """See the module.

    Parameters
    ----------
    loaded : LoadedRecording
        For this replay alone.
    connection : Connection
    thread : Executor
        Of one thread, which is the only one to touch what was loaded.
    """

    def __init__(self, loaded: LoadedRecording, connection: Connection, thread: Executor) -> None:
        self.recording, self.is_verified, self._connection = loaded.recording, loaded.is_verified, connection
        self._loaded, self._thread, self.size = loaded, thread, loaded.size
        self._playback = loaded.playback
        self._ticks = [frame.tick for frame in loaded.frames]
        self._tick = 0
        self._is_sought = True
        self._speed = 1.0
        self._sequence = 0
        self._tell_state()
        self._clock = asyncio.create_task(self._run())

    def seek(self, tick: int) -> None:
        """Show a moment soon; of those that are asked for meanwhile, the latest."""
        self._tick, self._is_sought = min(tick, self.recording.last_tick), True

    def pace(self, speed: float) -> None:
        """Play at this many seconds of game a second; 0 holds."""
        self._speed = speed

    async def moment(self) -> Moment:
        """Return the moment that is shown, or sought, to play on from; only where the simulation is verified."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._fork, self._tick)

    def _fork(self, tick: int) -> Moment:
        if self.recording.end is None:
            tick = min(tick, self._ticks[-1])  # of what came after the last frame that was written some may be lost
        game = self._playback.fork(tick).game
        past = self.recording.until(game.tick)
        return Moment(
            game=game,
            seed=self.recording.header.seed,
            sizes=self._loaded.sizes[: game.tick // TICKS_PER_SECOND + 1],
            origin=Origin(recording=self.recording.name, tick=game.tick, lines=len(past)),
            past=past,
        )

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
                    self._tick = min(before + ticks, self.recording.last_tick)
                if is_sought or self._tick > before:
                    await self._show(is_sought)
                await asyncio.sleep(1.0 / TICKS_PER_SECOND)
                owed = min(owed + self._speed, 8.0)
        except Exception:
            log.exception("a recorded game was not shown to its end")
            self._connection.send(protocol.Notice(text="this recorded game cannot be shown any further"))

    async def _show(self, is_sought: bool) -> None:
        self._sequence += 1
        work = functools.partial(self._picture, self._tick, self._sequence, is_sought)
        targets, frame = await asyncio.get_running_loop().run_in_executor(self._thread, work)
        for target in targets:
            self._connection.send_bytes(target)
        self._connection.show(frame, self._sequence)

    def _picture(self, tick: int, sequence: int, is_sought: bool) -> tuple[list[bytes], bytes]:
        """Go to a tick; return targets, all or those that came into force on the way, and the frame."""
        playback = self._playback
        if not self.is_verified:
            frame = self._loaded.frames[max(bisect.bisect_right(self._ticks, tick) - 1, 0)]
            altitudes = playback.game.simulator.altitudes[0]  # of the start, which every processor draws alike
            return [], encode_frame(replace(frame, sequence=sequence, server_ms=0.0, altitudes=altitudes))
        if is_sought:
            playback.seek(tick)
            came = [(team, 0) for team in (RED, BLUE)]
        else:
            came = [(command.team, command.number) for command in playback.advance(tick - playback.game.tick)]
        simulator = playback.game.simulator
        targets = [target_message(team, number, simulator.games.coefficients[0, team]) for team, number in came]
        return targets, frame_of(simulator, sequence, 0.0, altitudes=True, fields=True)

    def _tell_state(self) -> None:
        header, end = self.recording.header, self.recording.end
        seats = [
            protocol.SeatState(
                kind=seat.kind,
                name=seat.policy,
                label=seat.label,
                connected=True,
                system=system.name,
                takes=system.takes,
            )
            for seat, system in zip((header.red, header.blue), self.recording.config.game.team_systems, strict=True)
        ]
        self._connection.send(
            protocol.RoomState(
                code="",
                phase="replay",
                settings=settings_of(self.recording.config),
                red=seats[0],
                blue=seats[1],
                watchers=1,
                sizes=self._loaded.sizes,
                min_command_interval=self.recording.config.min_command_interval,
                outcome=end.outcome if end is not None else None,
                recording=self.recording.name,
                last_tick=self.recording.last_tick,
                verified=self.is_verified,
                ended_by=end.ended_by if end is not None else None,
                forfeit=self.recording.forfeit,
            )
        )
