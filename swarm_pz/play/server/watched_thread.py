"""A thread that is watched: who waits for what it does waits for so long and no longer."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


class WatchedThread:
    """Does one thing after the other, off the event loop.

    Parameters
    ----------
    name : str
    """

    def __init__(self, name: str) -> None:
        self._work: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        # A daemon: what hangs in it does not keep the server from ending.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            work()

    def close(self) -> None:
        """Let the thread end, as soon as it has nothing to do."""
        self._work.put(None)

    @property
    def is_alive(self) -> bool:
        """Whether it has not ended yet."""
        return self._thread.is_alive()

    async def do(self, work: Callable[[], T], limit_s: float | None) -> T:
        """Return what is answered; what is raised is raised here.

        Raises
        ------
        TimeoutError
            If it takes longer than the limit, where there is one, and goes on.
        RuntimeError
            If it raises what would end the event loop, such as a KeyboardInterrupt.
        """
        loop = asyncio.get_running_loop()
        done: asyncio.Future[T] = loop.create_future()

        def run() -> None:
            try:
                answer = work()
            except Exception as error:
                fail(RuntimeError("an iteration stopped") if isinstance(error, StopIteration) else error)
            except BaseException as error:
                fail(RuntimeError(f"{type(error).__name__} was raised"))
            else:
                tell(lambda: done.set_result(answer))

        def fail(fault: Exception) -> None:
            tell(lambda: done.set_exception(fault))

        def tell(what: Callable[[], None]) -> None:
            with contextlib.suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(lambda: None if done.done() else what())

        self._work.put(run)
        return await asyncio.wait_for(done, limit_s)
