"""A thread for what takes long, so that neither the event loop nor a game waits for it."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


class HangingError(Exception):
    """Earlier work of the same client was too late, and has not come back yet."""


class Worker:
    """Calls functions in a thread of its own, one after the other.

    Work that takes longer than its limit keeps its thread; a new thread does what waits.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._queue: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._late: dict[str, threading.Thread] = {}  # kept by late work, by client
        self._start()

    def _start(self) -> None:
        # A daemon: work that hangs does not keep the server from ending.
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        own = threading.current_thread()
        while self._thread is own:
            work = self._queue.get()
            if self._thread is not own:
                self._queue.put(work)
            elif work is None:
                return
            else:
                work()

    def do(
        self, work: Callable[..., T], *given: Any, limit_s: float | None = None, client: str = ""
    ) -> asyncio.Future[T]:
        """Return the future result of a function, which is called after all earlier ones.

        Work whose future is cancelled before it begins is left out. The future raises what the work raises, and

        - TimeoutError if the work takes longer than its limit,
        - HangingError if late work of the same client has not come back yet,
        - RuntimeError if the work raises what would end the event loop, such as KeyboardInterrupt.
        """
        loop, is_over = asyncio.get_running_loop(), threading.Event()
        done: asyncio.Future[T] = loop.create_future()
        done.add_done_callback(lambda done: done.cancelled() or done.exception())  # nobody need wait for it

        def run() -> None:
            if done.done():
                return
            if limit_s is not None:
                tell(loop.call_later, limit_s, give_up, threading.current_thread())
            try:
                if client in self._late and self._late[client].is_alive():
                    raise HangingError
                answer = work(*given)
            except BaseException as error:
                is_plain = isinstance(error, Exception) and not isinstance(error, StopIteration)
                tell(finish, done.set_exception, error if is_plain else RuntimeError(f"raised {type(error).__name__}"))
            else:
                tell(finish, done.set_result, answer)
            finally:
                is_over.set()

        def give_up(thread: threading.Thread) -> None:
            if not is_over.is_set():
                finish(done.set_exception, TimeoutError())
                self._late[client] = thread
                self._start()

        def finish(end: Callable[[Any], None], value: Any) -> None:
            if not done.done():
                end(value)

        def tell(act: Callable[..., Any], *values: Any) -> None:
            with contextlib.suppress(RuntimeError):  # the event loop has ended
                loop.call_soon_threadsafe(act, *values)

        self._queue.put(run)
        return done

    def close(self, *, wait: bool = False) -> None:
        """Let the thread end after the work that waits."""
        self._queue.put(None)
        if wait:
            self._thread.join()
