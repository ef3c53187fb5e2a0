"""A Ray cluster as a pool of workers.

Each task is a Ray task of one processor. Its arguments travel with it, folders of players only once. A machine with
other versions is left out, by name; what was done on one that died is given out again.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from typing import Any, ParamSpec, TypeVar

from swarm_pz.errors import WorkerError, require_extra
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.provenance import required_versions
from swarm_pz.evaluation.workers import LostTaskError
from swarm_pz.kernels.cache import processor

_LIVES = 3
"""Workers that may die at a task before it is given up."""
_LOOK_S = 0.2
"""Seconds between two looks at what waits."""

P = ParamSpec("P")
Result = TypeVar("Result")


def _print(line: str) -> None:
    print(line, flush=True)  # noqa: T201


@dataclass
class _Task:
    future: Future[Any]
    work: bytes
    places: list[int]
    """Where bundles stand among the arguments."""
    bundles: list[Any]
    deaths: int = 0


class RayPool(Executor):
    """The machines of a Ray cluster that this one is part of.

    Parameters
    ----------
    address : str
        "auto", or HOST:PORT of the cluster's head.
    say : callable, optional
        Where lines about machines go, from a thread of its own.

    Raises
    ------
    MissingExtraError
        If Ray is not installed.
    WorkerError
        If there is no such cluster, or it runs another version of Ray or Python.
    """

    elsewhere = True
    """Workers may be on machines that have none of this one's files."""

    def __init__(self, address: str, say: Callable[[str], None] = _print) -> None:
        with _handlers_kept():
            self._ray: Any = require_extra("ray", "cluster")
            self._is_ours = not self._ray.is_initialized()
            if self._is_ours:
                _connect(self._ray, address)
        self._say, self._expected, self._processor = say, required_versions(), processor()
        self._run = self._ray.remote(_make_runner()).options(num_cpus=1, max_retries=0)
        self._put: dict[PolicyBundle, Any] = {}
        self._queue: deque[_Task] = deque()
        self._running: dict[Any, _Task] = {}
        self._refused: dict[str, str] = {}
        self._told: set[str] = set()
        self._is_alone = False
        self._is_shut = False
        self._changed = threading.Condition()
        machines = self._machines()
        say(f"Ray: {len(machines)} machine(s), {int(sum(machines.values()))} processor(s)")
        self._thread = threading.Thread(target=self._deal, name="ray-pool", daemon=True)
        self._thread.start()

    @property
    def slots(self) -> int:
        """Tasks that it can be given before the first is done; more of them when machines join."""
        return 2 * self._room()

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Give a task to whichever machine is free; bundles among its arguments travel once."""
        places = [place for place, value in enumerate(args) if isinstance(value, PolicyBundle)]
        bare = [None if place in places else value for place, value in enumerate(args)]
        work = self._ray.cloudpickle.dumps((fn, bare, kwargs))
        future: Future[Result] = Future()
        with self._changed:
            if self._is_shut:
                raise RuntimeError("this pool is shut")
            self._queue.append(_Task(future, work, places, [self._sent(args[place]) for place in places]))
            self._changed.notify()
        return future

    def _sent(self, bundle: Any) -> Any:
        if bundle not in self._put:
            self._put[bundle] = self._ray.put((bundle.name, bundle.files))
        return self._put[bundle]

    def end(self) -> None:
        """End what the workers are at."""
        with self._changed:
            for ref in self._running:
                self._ray.cancel(ref, force=True)
            for task in (*self._running.values(), *self._queue):
                if not task.future.cancel():  # one that is given out again is in the queue, and yet has begun
                    task.future.set_exception(LostTaskError("it was ended"))
            self._running.clear()
            self._queue.clear()
            self._is_shut = True
            self._changed.notify()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more tasks, and part from the cluster when those are done that were given."""
        with self._changed:
            self._is_shut = True
            if cancel_futures:
                for task in self._queue:
                    task.future.cancel()
            self._changed.notify()
        if wait:
            self._thread.join()
            if self._is_ours:
                with _handlers_kept():
                    self._ray.shutdown()

    # --- the thread that deals --------------------------------------------------------------------

    def _machines(self) -> dict[str, float]:
        """Return the processors of every machine that may work, by its number."""
        nodes = [node for node in self._ray.nodes() if node["Alive"] and node["NodeID"] not in self._refused]
        return {node["NodeID"]: node["Resources"]["CPU"] for node in nodes if node["Resources"].get("CPU", 0.0)}

    def _room(self) -> int:
        # One more than can be worked at: a cluster that can grow sees that it should.
        return int(sum(self._machines().values())) + 1

    def _deal(self) -> None:
        try:
            self._deal_out()
        except Exception as error:  # nobody would be told, and who waits would for ever
            lost = WorkerError(f"the Ray cluster cannot be reached any more ({error!r}); run it again to go on")
            with self._changed:
                self._is_shut = True
                for task in (*self._running.values(), *self._queue):
                    if not task.future.done():
                        task.future.set_exception(lost)
                self._running.clear()
                self._queue.clear()

    def _deal_out(self) -> None:
        while True:
            with self._changed:
                while not self._queue and not self._running:
                    if self._is_shut:
                        return
                    self._changed.wait()
                room = self._room() if self._queue else 0
                while self._queue and len(self._running) < room:
                    self._begin(self._queue.popleft())
                refs = list(self._running)
            if not refs:
                time.sleep(_LOOK_S)
                continue
            if self._ray.wait(refs, num_returns=1, timeout=_LOOK_S)[0]:
                done, _ = self._ray.wait(refs, num_returns=len(refs), timeout=0)
                self._settle(done)
            else:
                self._tell_who_waits()

    def _begin(self, task: _Task) -> None:
        # One that is given out again is running already, whoever waits for it.
        if not task.future.running() and not task.future.set_running_or_notify_cancel():
            return
        run = self._run
        if self._refused:
            run = run.options(label_selector={"ray.io/node-id": f"!in({','.join(self._refused)})"})
        self._running[run.remote(self._expected, task.work, task.places, *task.bundles)] = task

    def _settle(self, refs: list[Any]) -> None:
        again = 0
        errors = self._ray.exceptions
        for ref in refs:
            try:
                kind, node, host, told = self._ray.get(ref)
            except errors.RayTaskError as error:
                kind, told = "raised", error.cause if isinstance(error.cause, Exception) else error
            except errors.RayError as error:
                kind, told = "died", error
            with self._changed:
                task = self._running.pop(ref, None)
            if task is None:  # ended meanwhile
                continue
            if kind == "done":
                self._note(host, told[0])
                task.future.set_result(told[1])
            elif kind == "raised":
                task.future.set_exception(told)
            elif kind == "refused":
                if self._refuse(node, host, told):
                    self._give_again(task)
                else:
                    task.future.set_exception(WorkerError("; ".join(self._refused.values())))
            elif (deaths := task.deaths + 1) < _LIVES:
                task.deaths = deaths
                again += 1
                self._give_again(task)
            else:
                task.future.set_exception(LostTaskError(f"{_LIVES} workers died at it: {told}"))
        if again:
            self._say(f"a worker or its machine died: what it was at is given out again ({again} task(s))")

    def _give_again(self, task: _Task) -> None:
        with self._changed:
            self._queue.appendleft(task)

    def _note(self, host: str, kind: str) -> None:
        if kind != self._processor and host not in self._told:
            self._told.add(host)
            self._say(
                f"{host} has a processor of another kind ({kind}, here {self._processor}): its games may go other ways "
                "than here; NUMBA_CPU_NAME=generic on all machines avoids that"
            )

    def _tell_who_waits(self) -> None:
        is_alone = not self._machines()
        if is_alone and not self._is_alone:
            self._say("no machine is left that may work: it goes on when one joins the cluster")
        self._is_alone = is_alone

    def _refuse(self, node: str, host: str, found: dict[str, str]) -> bool:
        """Leave a machine out from now on; return whether any is left."""
        if node not in self._refused:
            differing = [
                f"{name} {found.get(name, 'not at all')}, here {version}"
                for name, version in self._expected.items()
                if found.get(name) != version
            ]
            self._refused[node] = (
                f"{host} is left out, since it has {', '.join(differing)}: install the same versions there, and "
                "start its Ray again"
            )
            self._say(self._refused[node])
        return bool(self._machines())


def _make_runner() -> Callable[..., tuple[str, str, str, Any]]:
    def run(expected: dict[str, str], work: bytes, places: list[int], *bundles: Any) -> tuple[str, str, str, Any]:
        """Do a task, where all is as expected; it travels as code, since nothing may be installed there."""
        import importlib
        import os
        import pickle
        import platform

        node, host = importlib.import_module("ray").get_runtime_context().get_node_id(), platform.node()
        try:
            from swarm_pz.evaluation.bundles import PolicyBundle
            from swarm_pz.evaluation.provenance import required_versions
            from swarm_pz.kernels.cache import processor
        except ImportError:  # it is not there, or another one
            return "refused", node, host, {}
        found = required_versions()
        if any(found.get(name) != version for name, version in expected.items()):
            return "refused", node, host, found
        os.environ["OMP_NUM_THREADS"] = "1"  # as in `prepare_process`
        function, arguments, keywords = pickle.loads(work)  # noqa: S301 - from the driver, as all that Ray runs
        for place, bundle in zip(places, bundles, strict=True):
            arguments[place] = PolicyBundle(*bundle)
        return "done", node, host, (processor(), function(*arguments, **keywords))

    return run


@contextlib.contextmanager
def _handlers_kept() -> Iterator[None]:
    """Keep what signals do: Ray has an opinion of its own on SIGTERM."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _connect(ray: Any, address: str) -> None:
    found = re.fullmatch(r"([^/\s]+):(\d{1,5})", address)
    if address != "auto" and found is None:
        raise WorkerError(f"ray must be 'auto' or HOST:PORT of a cluster that this machine is part of, got {address!r}")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        if found is not None:  # Ray itself would try for minutes
            socket.create_connection((found[1], int(found[2])), timeout=10).close()
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, OverflowError, RuntimeError, ValueError, AssertionError) as error:
        reason = " ".join(str(error).split())
        raise WorkerError(
            f"there is no Ray cluster at {address!r} that this machine can work with: {reason}; start one with "
            "'ray start --head --disable-usage-stats', and on every other machine 'ray start --address HOST:PORT'"
        ) from error
