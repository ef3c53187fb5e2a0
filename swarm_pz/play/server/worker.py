"""A thread for slow work, so that neither the event loop nor a game waits for it."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class Worker:
    """Calls functions in a thread of its own, one after the other."""

    def __init__(self, name: str) -> None:
        self._queue: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        # A daemon: work that hangs does not keep the server from ending.
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while (work := self._queue.get()) is not None:
            work()

    def do(self, work: Callable[..., T], *arguments: Any) -> asyncio.Future[T]:
        """Return the future result of a function, which is called after all earlier ones.

        Work is skipped if its future is cancelled before it begins. The future raises the work's error, or RuntimeError
        in place of one that would end the event loop, such as KeyboardInterrupt.
        """
        loop = asyncio.get_running_loop()
        done: asyncio.Future[T] = loop.create_future()
        done.add_done_callback(lambda done: done.cancelled() or done.exception())  # no warning if nobody waits

        def run() -> None:
            if done.done():
                return
            try:
                answer = work(*arguments)
            except BaseException as error:
                is_plain = isinstance(error, Exception) and not isinstance(error, StopIteration)
                tell(done.set_exception, error if is_plain else RuntimeError(f"raised {type(error).__name__}"))
            else:
                tell(done.set_result, answer)

        def finish(end: Callable[[Any], None], value: Any) -> None:
            if not done.done():
                end(value)

        def tell(end: Callable[[Any], None], value: Any) -> None:
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                loop.call_soon_threadsafe(finish, end, value)

        self._queue.put(run)
        return done

    def close(self, *, wait: bool = False) -> None:
        """Let the thread end after the queued work."""
        self._queue.put(None)
        if wait:
            self._thread.join()
