"""Recorded games that are watched at a table: two processes read and play them again, so that no file ends the table.

One reads and verifies, which may take long; the other one shows those that somebody watches.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.recordings.sandbox import Sandbox
from swarm_pz.play.server.replay_session import LoadedRecording

_held: dict[int, LoadedRecording] = {}
"""In the process that shows them, by their numbers."""


def _warm() -> None:
    LiveGame(TableConfig(), 0).advance()  # what is loaded late, or compiled, is there then


def _load(path: Path) -> tuple[protocol.RoomState, bytes]:
    loaded = LoadedRecording.read(path)
    if loaded.is_verified:  # its frames are simulated
        loaded = replace(loaded, frames=loaded.frames[-1:])
    return loaded.state, pickle.dumps(loaded)


def _hold(number: int, data: bytes) -> None:
    _held[number] = pickle.loads(data)  # noqa: S301  (of our own process)


def _drop(number: int) -> None:
    _held.pop(number, None)


def _ask(number: int, what: str, *given: Any) -> Any:
    if number not in _held:
        raise RecordingError("the process that showed it has ended; open it again")
    return getattr(_held[number], what)(*given)


@dataclass(frozen=True)
class Replayed:
    """A recorded game that somebody watches.

    Attributes
    ----------
    state : RoomState
        What is told of it.
    size : int
        Bytes of its file.
    ask : callable
        From the name of a method of `LoadedRecording` and its arguments to what it returns, to be awaited.
    drop : callable
        Forgets it.
    """

    state: protocol.RoomState
    size: int
    ask: Callable[..., Any]
    drop: Callable[[], None]


class Replays:
    """The two processes, started when somebody first looks for recorded games, or opens one."""

    def __init__(self) -> None:
        self._reader, self._player = Sandbox(), Sandbox()
        # Of one thread each, so that what is asked for waits in line. A thread reads on when nobody waits any more;
        # the next one begins after it.
        self._reading, self._playing = ThreadPoolExecutor(1, "reading"), ThreadPoolExecutor(1, "replaying")
        self._numbers = itertools.count()
        self._is_warm = False

    def warm(self) -> None:
        """Start the processes, the first time that this is asked for, so that a game opens at once later."""
        if not self._is_warm:
            self._is_warm = True
            self._reading.submit(self._reader.do, "", _warm)
            self._playing.submit(self._player.do, "", _warm)

    async def read(self, path: Path) -> Replayed:
        """Return a recorded game, played through; one at a time, since it takes a core.

        Raises
        ------
        RecordingError
            If it cannot be read or shown, or ended the process that read it.
        """
        self.warm()
        state, data = await self.work(path, _load)
        number, do, loop = next(self._numbers), partial(self._player.do, path.name), asyncio.get_running_loop()

        async def ask(what: str, *given: Any) -> Any:
            return await loop.run_in_executor(self._playing, do, _ask, number, what, *given)

        def drop() -> None:
            with contextlib.suppress(RuntimeError):  # the server has ended
                self._playing.submit(do, _drop, number)

        replayed = Replayed(state, path.stat().st_size, ask, drop)
        try:
            await loop.run_in_executor(self._playing, do, _hold, number, data)
        except BaseException:  # such as that nobody waits any more
            replayed.drop()
            raise
        return replayed

    async def work(self, path: Path, work: Callable[[Path], Any]) -> Any:
        """Return what some work finds in a recording, as `Sandbox.do` would."""
        return await asyncio.get_running_loop().run_in_executor(self._reading, self._reader.do, path.name, work, path)

    def close(self) -> None:
        """End the processes."""
        for thread, sandbox in ((self._reading, self._reader), (self._playing, self._player)):
            thread.shutdown(wait=False, cancel_futures=True)
            sandbox.close()
