"""A recorded game shown to one client, who may go to any moment of it.

Where a simulation comes out as recorded, that is what is shown, with capture fields and targets; where
it does not, because the processor is of another kind, the recorded frames are.

A recording may be a stranger's: whatever reads or simulates it does so in a process of its own, of `Replays`. The event
loop only sends what comes of it.
"""

from __future__ import annotations

import asyncio
import bisect
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

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

if TYPE_CHECKING:
    from swarm_pz.play.server.replays import Replayed

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
    """

    recording: Recording
    frames: list[Frame]
    sizes: list[tuple[int, int]]
    playback: Playback
    is_verified: bool

    @classmethod
    def read(cls, path: Path) -> LoadedRecording:
        """Read a recorded game and play it through.

        Raises
        ------
        RecordingError
            If it is too long, cannot be read, or shows nothing.
        """
        if path.stat().st_size > _MOST_BYTES:
            raise RecordingError(
                f"{path.name} is too long to be watched here; swarm-pz replay --film makes a film of it"
            )
        recording = Recording.read(path)
        frames = list(recording.frames())
        if not frames:
            raise RecordingError(f"{path.name} broke off before anything was to be seen")
        playback = Playback(recording)
        return cls(recording, frames, sizes_of(frames), playback, playback.verify().verified)

    @property
    def state(self) -> protocol.RoomState:
        """What is told of it to who watches."""
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
        return protocol.RoomState(
            code="",
            phase="replay",
            settings=settings_of(self.recording.config),
            red=seats[0],
            blue=seats[1],
            watchers=1,
            sizes=self.sizes,
            min_command_interval=self.recording.config.min_command_interval,
            outcome=end.outcome if end is not None else None,
            recording=self.recording.name,
            last_tick=self.recording.last_tick,
            verified=self.is_verified,
            ended_by=end.ended_by if end is not None else None,
            forfeit=self.recording.forfeit,
        )

    def picture(self, tick: int, sequence: int, is_sought: bool) -> tuple[list[bytes], bytes]:
        """Go to a tick; return targets, all or those that came into force on the way, and the frame."""
        playback = self.playback
        if not self.is_verified:
            frame = self.frames[max(bisect.bisect_right(self.frames, tick, key=lambda frame: frame.tick) - 1, 0)]
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

    def moment(self, tick: int) -> Moment:
        """Return a moment to play on from."""
        if self.recording.end is None:
            tick = min(tick, self.frames[-1].tick)  # of what came after the last frame some may be lost
        game = self.playback.fork(tick).game
        past = self.recording.until(game.tick)
        return Moment(
            game=game,
            seed=self.recording.header.seed,
            sizes=self.sizes[: game.tick // TICKS_PER_SECOND + 1],
            origin=Origin(recording=self.recording.name, tick=game.tick, lines=len(past)),
            past=past,
        )


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
    replayed : Replayed
        For this replay alone.
    connection : Connection
    """

    def __init__(self, replayed: Replayed, connection: Connection) -> None:
        self.state, self.size, self._connection = replayed.state, replayed.size, connection
        self._replayed = replayed
        self._last_tick = replayed.state.last_tick or 0
        self._tick = 0
        self._is_sought = True
        self._speed = 1.0
        self._sequence = 0
        connection.send(self.state)
        self._clock = asyncio.create_task(self._run())

    def seek(self, tick: int) -> None:
        """Show a moment soon; of those that are asked for meanwhile, the latest."""
        self._tick, self._is_sought = min(tick, self._last_tick), True

    def pace(self, speed: float) -> None:
        """Play at this many seconds of game a second; 0 holds."""
        self._speed = speed

    async def moment(self) -> Moment:
        """Return the moment that is shown, or sought, to play on from; only where the simulation is verified."""
        return cast("Moment", await self._replayed.ask("moment", self._tick))

    def close(self) -> None:
        """Show nothing more."""
        self._clock.cancel()
        self._replayed.drop()

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
        targets, frame = await self._replayed.ask("picture", self._tick, self._sequence, is_sought)
        for target in targets:
            self._connection.send_bytes(target)
        self._connection.show(frame, self._sequence)
