"""Where commands are made of what clients send: in a thread, one after the other, so that no game waits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from swarm_pz.config.registry import is_our_own
from swarm_pz.errors import CommandError
from swarm_pz.play.server.orders import Made
from swarm_pz.play.server.watched_thread import WatchedThread

MAKE_S = 5.0
"""Seconds that a command for another package's system may take to be made."""


class Painter:
    """Makes commands, one at a time, since it takes a core.

    Another package's control system that hangs while it reads or draws a command has its thread to itself from then on;
    until it comes back, no other command is made for it. swarm-pz's own may take their time: a machine may be busy, and
    what draws may have to be compiled.
    """

    def __init__(self) -> None:
        self._turn, self._thread = asyncio.Lock(), WatchedThread("painting")
        self._hanging: dict[str, WatchedThread] = {}
        """By the names of control systems."""

    async def make(self, work: Callable[[], Made], system: str) -> Made:
        """Return a command that is made for a control system, after those before it.

        Raises
        ------
        CommandError
            If it cannot be drawn or read, cannot fly its team, or takes too long.
        """
        await self._turn.acquire()
        # Who leaves while theirs is made lets the others wait until it is done.
        making = asyncio.create_task(self._make(work, system))
        making.add_done_callback(lambda made: made.cancelled() or made.exception())  # of whom nobody waits for, too
        return await asyncio.shield(making)

    async def _make(self, work: Callable[[], Made], system: str) -> Made:
        try:
            if system in self._hanging and self._hanging[system].is_alive:
                raise CommandError(f"{system} still reads another command: it takes no more until it is done")
            return await self._thread.do(work, None if is_our_own(system) else MAKE_S)
        except TimeoutError as error:
            self.close()
            self._hanging[system], self._thread = self._thread, WatchedThread("painting")
            raise CommandError(f"{system} did not read that command within {MAKE_S:g} s") from error
        finally:
            self._turn.release()

    def close(self) -> None:
        """Let the thread end, as soon as it has nothing to do."""
        self._thread.close()
