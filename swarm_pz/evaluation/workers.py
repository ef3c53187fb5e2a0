"""Executors that share work out: to this process, to others of this machine, or to the machines of a cluster.

A pool is whatever has `submit(function, *arguments)` and returns futures, as the executors of `concurrent.futures`
do. The process that shares the work out is the only one that keeps and writes results.
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
from swarm_pz.evaluation.processes import LostTaskError, end_processes, interrupts_blocked, prepare_process
from swarm_pz.evaluation.ray_pool import RayPool

Task = TypeVar("Task", bound=tuple[Any, ...])
Result = TypeVar("Result")
P = ParamSpec("P")

_LOOK_S = 0.2
"""Seconds between two looks at whether to stop, while a task is waited for."""


class SerialExecutor(Executor):
    """Does each task in this process, as soon as it is given."""

    slots = 1
    """Tasks that it can be given before the first is done."""
    count = 1
    """Processes."""

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Do a task; the future is done."""
        future: Future[Result] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Processes(ProcessPoolExecutor):
    """Processes of this machine, which end with this one, however that ends."""

    def __init__(self, count: int) -> None:
        super().__init__(count, mp_context=multiprocessing.get_context("spawn"), initializer=prepare_process)
        self.count, self.slots = count, 2 * count

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Give a task to a process, and start one if there are too few."""
        with interrupts_blocked():
            return super().submit(fn, *args, **kwargs)

    def end(self) -> None:
        """End the processes, whatever they do."""
        end_processes()


def open_pool(processes: int = 1, ray: str | None = None) -> Executor:
    """Return a pool, a context: this process (1), others, or a Ray cluster ("auto", or HOST:PORT of its head).

    A WorkerError is raised if there is no such cluster, or this machine cannot work with it.
    """
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
    """Give tasks to a pool, in their order, and keep results as they come.

    `work` is importable by its name elsewhere, and called with the arguments of each task; long tasks should come
    first. `keep` is called with each task and its result, in this thread alone. Once `should_stop`, what was begun is
    finished and kept. Errors call a task by `name`, and say that it was `verb`. A worker that dies raises a
    WorkerError; what was finished is kept.
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
    except KeyboardInterrupt:  # at once
        if is_over := hasattr(pool, "end"):
            pool.end()
        raise
    finally:
        # The futures of a pool that is over come back by themselves, mostly as errors.
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
    """Say not to stop, for tasks that are done elsewhere."""
    return False


def silent(_: str) -> None:
    """Drop a line of progress, for tasks that are done elsewhere."""


class BackgroundTasks:
    """Long tasks that a pool does while this process does something else; a context, which ends what is still done."""

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
        """Whether tasks are done by this process, as soon as they are sent."""
        return isinstance(self.pool, SerialExecutor)

    @property
    def is_elsewhere(self) -> bool:
        """Whether they may be done where this machine's files are missing."""
        return bool(getattr(self.pool, "elsewhere", False))

    def send(self, name: str, work: Callable[..., Any], *arguments: Any) -> None:
        """Give a task to the pool; it is fetched by the name."""
        self._sent[name] = self.pool.submit(work, *arguments)

    def check(self) -> None:
        """Raise the error of a task that has failed, if any."""
        for name in [name for name, future in self._sent.items() if future.done() and future.exception() is not None]:
            self.fetch(name)

    def fetch(self, name: str, should_stop: Callable[[], bool] = never) -> Any:
        """Wait for a task, and return its result; raise Stopped if it should stop, a WorkerError if the worker died."""
        future = self._sent[name]
        while not wait([future], timeout=_LOOK_S).done:
            if should_stop():
                raise Stopped(f"{name} is under way")
        del self._sent[name]
        try:
            return future.result()
        except BrokenExecutor as error:
            raise _died("done", [name]) from error
