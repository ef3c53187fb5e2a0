"""A recorded game shown to one client, who may go to any moment of it.

Where a simulation comes out as recorded, that is what is shown, with capture fields and targets; where
it does not, because the processor is of another kind, the recorded frames are.
"""

from __future__ import annotations

import asyncio
import bisect
import logging
from dataclasses import dataclass, replace
from pathlib import Path

from swarm_pz.config import BLUE, RED, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.recordings.format import Origin, Recording
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.live_session import Moment
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
    playback : Playback
    is_verified : bool
        Whether its simulation comes out as recorded.
    """

    recording: Recording
    frames: list[Frame]
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
        return cls(recording, frames, playback, playback.verify().verified)


class ReplaySession:
    """See the module.

    Parameters
    ----------
    loaded : LoadedRecording
        For this replay alone.
    connection : Connection
    """

    def __init__(self, loaded: LoadedRecording, connection: Connection) -> None:
        self.recording, self.is_verified, self._connection = loaded.recording, loaded.is_verified, connection
        self._frames, self._playback = loaded.frames, loaded.playback
        self._ticks = [frame.tick for frame in loaded.frames]
        self._tick = 0
        self._speed = 1.0
        self._sequence = 0
        self._tell_state()
        self._clock = asyncio.create_task(self._run())

    def seek(self, tick: int) -> None:
        """Show a moment."""
        self._tick = min(tick, self.recording.last_tick)
        if self.is_verified:
            self._playback.seek(self._tick)
            for team in (RED, BLUE):
                self._send_target(team, 0)
        self._show()

    def pace(self, speed: float) -> None:
        """Play at this many seconds of game a second; 0 holds."""
        self._speed = speed

    def moment(self) -> Moment | None:
        """Return the moment that is shown, to play on from; None where simulations come out otherwise."""
        if not self.is_verified:
            return None
        playback = Playback(self.recording)
        playback.seek(self._tick)
        past = self.recording.until(playback.game.tick)
        return Moment(
            game=playback.game,
            seed=self.recording.header.seed,
            sizes=self._sizes()[: self._tick // TICKS_PER_SECOND + 1],
            origin=Origin(recording=self.recording.name, tick=playback.game.tick, lines=len(past)),
            past=past,
        )

    def close(self) -> None:
        """Show nothing more."""
        self._clock.cancel()

    async def _run(self) -> None:
        owed = 0.0
        try:
            self.seek(0)
            while True:
                await asyncio.sleep(1.0 / TICKS_PER_SECOND)
                owed = min(owed + self._speed, 8.0)
                ticks = min(int(owed), self.recording.last_tick - self._tick)
                owed -= int(owed)
                if ticks > 0:
                    self._tick += ticks
                    self._go_on(ticks)
                    self._show()
        except Exception:
            log.exception("a recorded game was not shown to its end")
            self._connection.send(protocol.Notice(text="this recorded game cannot be shown any further"))

    def _go_on(self, ticks: int) -> None:
        if self.is_verified:
            for command in self._playback.advance(ticks):
                self._send_target(command.team, command.number)

    def _send_target(self, team: int, number: int) -> None:
        coefficients = self._playback.game.simulator.games.coefficients[0, team]
        self._connection.send_bytes(target_message(team, number, coefficients))

    def _show(self) -> None:
        self._sequence += 1
        if self.is_verified:
            shown = frame_of(self._playback.game.simulator, self._sequence, 0.0, fields=True)
        else:
            frame = self._frames[max(bisect.bisect_right(self._ticks, self._tick) - 1, 0)]
            shown = encode_frame(replace(frame, sequence=self._sequence, server_ms=0.0))
        self._connection.show(shown, self._sequence)

    def _sizes(self) -> list[tuple[int, int]]:
        by_second = {frame.tick // TICKS_PER_SECOND: frame for frame in reversed(self._frames)}
        blue = {second: int(frame.teams.sum()) for second, frame in by_second.items()}
        count = len(self._frames[0].teams)
        return [(count - blue[second], blue[second]) for second in sorted(blue)]

    def _tell_state(self) -> None:
        header, end = self.recording.header, self.recording.end
        seats = [
            protocol.SeatState(
                kind=seat.kind,
                name=seat.policy,
                label=seat.label,
                connected=True,
            )
            for seat in (header.red, header.blue)
        ]
        self._connection.send(
            protocol.RoomState(
                code="",
                phase="replay",
                settings=settings_of(self.recording.config),
                red=seats[0],
                blue=seats[1],
                watchers=1,
                sizes=self._sizes(),
                min_command_interval=self.recording.config.min_command_interval,
                outcome=end.outcome if end is not None else None,
                recording=self.recording.name,
                last_tick=self.recording.last_tick,
                verified=self.is_verified,
            )
        )
