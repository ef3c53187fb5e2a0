"""Executors that share work among processes of this machine or the machines of a cluster.

A pool is any executor of `concurrent.futures`. Only the process that shares the work keeps and writes results.
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from typing import Any, ParamSpec, TypeVar

from swarm_pz.config.base import check_count
from swarm_pz.errors import Stopped, WorkerError
from swarm_pz.evaluation.processes import LostTaskError, interrupts_blocked, prepare_process
from swarm_pz.evaluation.ray_pool import RayPool

Task = TypeVar("Task", bound=tuple[Any, ...])
Result = TypeVar("Result")
P = ParamSpec("P")

_LOOK_S = 0.2
"""Seconds between two checks of `should_stop` while `fetch` waits for a task."""


class SerialExecutor(Executor):
    """Runs each task in this process, at once; `slots` are the tasks that may wait, `count` the processes."""

    slots = count = 1

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Run a task; the future is done."""
        future: Future[Result] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Processes(ProcessPoolExecutor):
    """Processes on this machine, which end when this process ends in any way."""

    def __init__(self, count: int) -> None:
        super().__init__(count, mp_context=multiprocessing.get_context("spawn"), initializer=prepare_process)
        self.count, self.slots = count, 2 * count

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Submit a task, and start a process if there are too few."""
        with interrupts_blocked():
            return super().submit(fn, *args, **kwargs)

    def end(self) -> None:
        """Terminate the processes, even busy ones."""
        for process in multiprocessing.active_children():
            process.terminate()


def open_pool(processes: int = 1, ray: str | None = None) -> Executor:
    """Return a pool, a context: this process (1), several, or a Ray cluster ("auto", or HOST:PORT of its head)."""
    check_count(processes, "processes", 1, 1024)
    if ray is not None:
        return RayPool(ray)
    return SerialExecutor() if processes == 1 else Processes(processes)


def share(
    pool: Executor,
    work: Callable[..., Result],
    tasks: Iterable[Task],
    keep: Callable[[Task, Result], None],
    *,
    should_stop: Callable[[], bool] = lambda: False,
    name: Callable[[Task], str] = str,
    verb: str = "played",
) -> None:
    """Run tasks, best the long ones first, in a pool, and keep results as they come.

    `keep` is called with each task and its result, in this thread. After `should_stop` returns True, tasks that have
    begun are finished and kept. If a worker dies, a WorkerError says which tasks (`name`) were being `verb`.
    """
    left = iter(tasks)
    waiting: dict[Future[Result], Task] = {}
    is_over = False
    try:
        while not should_stop():
            slots = getattr(pool, "slots", 2 * (os.cpu_count() or 1))
            for task in itertools.islice(left, max(0, slots - len(waiting))):
                waiting[pool.submit(work, *task)] = task
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                try:
                    result = future.result()
                except BrokenExecutor as error:
                    is_over = not isinstance(error, LostTaskError)
                    lost = list(waiting.values()) if is_over else [waiting[future]]
                    raise _died(verb, {name(task) for task in lost}) from error
                keep(waiting.pop(future), result)
    except KeyboardInterrupt:  # stop at once
        if is_over := hasattr(pool, "end"):
            pool.end()
        raise
    finally:
        # When a pool is over, its futures finish by themselves, mostly with errors.
        begun = [future for future in waiting if is_over or not future.cancel()]
        for future in wait(begun).done:
            if not future.cancelled() and future.exception() is None:
                keep(waiting[future], future.result())


def _died(verb: str, names: Iterable[str]) -> WorkerError:
    return WorkerError(
        f"a process died while these were {verb}: {', '.join(sorted(names))}; run it again to go on, without the one "
        "that crashes if it happens again"
    )


def never() -> bool:
    """Return False: a `should_stop` that can be pickled."""
    return False


def silent(_: str) -> None:
    """Drop a line of progress: a `say` that can be pickled."""


class BackgroundTasks:
    """Long tasks that a pool runs in the background; leaving this context ends unfinished ones."""

    def __init__(self, pool: Executor) -> None:
        self.pool = pool
        self._sent: dict[str, Future[Any]] = {}

    def __enter__(self) -> BackgroundTasks:
        return self

    def __exit__(self, *_: object) -> None:
        under_way = [future for future in self._sent.values() if not future.cancel() and not future.done()]
        if under_way and hasattr(self.pool, "end"):
            self.pool.end()

    def __contains__(self, name: str) -> bool:
        return name in self._sent

    @property
    def is_here(self) -> bool:
        """True if this process runs each task at once."""
        return isinstance(self.pool, SerialExecutor)

    @property
    def is_elsewhere(self) -> bool:
        """True if other machines may run the tasks."""
        return bool(getattr(self.pool, "elsewhere", False))

    def send(self, name: str, work: Callable[..., Any], *arguments: Any) -> None:
        """Submit a task to the pool under a name."""
        self._sent[name] = self.pool.submit(work, *arguments)

    def check(self) -> None:
        """Raise the error of a task that failed, if any."""
        for name in [name for name, future in self._sent.items() if future.done() and future.exception() is not None]:
            self.fetch(name)

    def fetch(self, name: str, should_stop: Callable[[], bool] = never) -> Any:
        """Return the result of a task; raise Stopped if `should_stop`, a WorkerError if the worker died."""
        future = self._sent[name]
        while not wait([future], timeout=_LOOK_S).done:
            if should_stop():
                raise Stopped(f"{name} is under way")
        del self._sent[name]
        try:
            return future.result()
        except BrokenExecutor as error:
            raise _died("done", [name]) from error
