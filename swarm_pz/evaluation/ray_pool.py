"""A Ray cluster as a pool of workers.

Ray repeats a task if its worker or machine dies. Each player's folder is sent once. The work fails if a machine has
other versions.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ParamSpec, TypeVar

from swarm_pz.errors import WorkerError, require_extra
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.processes import LostTaskError
from swarm_pz.evaluation.provenance import required_versions

_RETRIES = 2
"""Repetitions of a task whose worker dies."""
_MOST_TASKS = 10_000
_LOOK_S = 1.0
"""Seconds between two checks whether `end` was called."""

P = ParamSpec("P")
Result = TypeVar("Result")


class RayPool(ThreadPoolExecutor):
    """The Ray cluster of this machine; a thread here waits for each task.

    `address` is "auto", or HOST:PORT of the cluster's head. Raises a WorkerError if there is no such cluster, or if it
    runs another version of Ray or Python.
    """

    elsewhere = True
    """Workers may lack this machine's files."""

    def __init__(self, address: str) -> None:
        super().__init__(_MOST_TASKS, thread_name_prefix="ray-pool")
        with _handlers_kept():
            self._ray: Any = require_extra("ray", "cluster")
            self._is_ours = not self._ray.is_initialized()
            if self._is_ours:
                _connect(self._ray, address)
        self._expected = required_versions()
        self._run = self._ray.remote(_make_runner()).options(num_cpus=1, max_retries=_RETRIES)
        self._bundles: dict[PolicyBundle, Any] = {}
        self._running: set[Any] = set()
        self._is_over = False
        machines = self._machines()
        print(f"Ray: {len(machines)} machine(s), {int(sum(machines))} processor(s)", flush=True)  # noqa: T201

    @property
    def slots(self) -> int:
        """Tasks that may wait: one more than processors, so that a cluster grows."""
        return int(sum(self._machines())) + 1

    def submit(self, fn: Callable[P, Result], /, *args: P.args, **kwargs: P.kwargs) -> Future[Result]:
        """Submit a task to the cluster."""
        places = [place for place, value in enumerate(args) if isinstance(value, PolicyBundle)]
        bare = [None if place in places else value for place, value in enumerate(args)]
        work = self._ray.cloudpickle.dumps((fn, bare, kwargs))
        return super().submit(self._do, work, places, [self._put(args[place]) for place in places])

    def end(self) -> None:
        """Cancel the running tasks."""
        self._is_over = True
        for ref in list(self._running):
            self._ray.cancel(ref, force=True)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster when the tasks are done."""
        super().shutdown(wait, cancel_futures=cancel_futures)
        if wait and self._is_ours:
            with _handlers_kept():
                self._ray.shutdown()

    def _put(self, bundle: Any) -> Any:
        if bundle not in self._bundles:
            self._bundles[bundle] = self._ray.put((bundle.name, bundle.files))
        return self._bundles[bundle]

    def _machines(self) -> list[float]:
        """Return the number of processors of each machine with any."""
        try:
            nodes = [node for node in self._ray.nodes() if node["Alive"]]
        except Exception as error:
            raise WorkerError(
                f"the Ray cluster cannot be reached any more ({error!r}); run it again to go on"
            ) from error
        return [node["Resources"]["CPU"] for node in nodes if node["Resources"].get("CPU", 0.0)]

    def _do(self, work: bytes, places: list[int], bundles: list[Any]) -> Any:
        """Return the result of a task; raise a WorkerError if its machine has other versions."""
        ref = self._run.remote(self._expected, work, places, *bundles)
        self._running.add(ref)
        try:
            # Ray may miss the cancellation of a task whose worker is just starting, so repeat it.
            while not self._ray.wait([ref], timeout=_LOOK_S)[0]:
                if self._is_over:
                    self._ray.cancel(ref, force=True)
            fault, result = self._ray.get(ref)
        except self._ray.exceptions.RayTaskError as error:
            raise (error.cause if isinstance(error.cause, Exception) else error) from None
        except self._ray.exceptions.RayError as error:
            raise LostTaskError(f"its workers died: {error}") from error
        finally:
            self._running.discard(ref)
        if fault:
            raise WorkerError(
                f"{fault}: install the same versions there, and start its Ray again; what is finished is kept"
            )
        return result


def _make_runner() -> Callable[..., tuple[str, Any]]:
    def run(expected: dict[str, str], work: bytes, places: list[int], *bundles: Any) -> tuple[str, Any]:
        """Return which versions differ on this host, if any, and the task's result; Ray sends it as code."""
        import os
        import pickle
        import platform

        versions: dict[str, str] = {}
        with contextlib.suppress(ImportError):  # missing, or another version
            from swarm_pz.evaluation.bundles import PolicyBundle
            from swarm_pz.evaluation.provenance import required_versions

            versions = required_versions()
        if differing := [
            f"{name} {versions.get(name, 'not at all')}, here {version}"
            for name, version in expected.items()
            if versions.get(name) != version
        ]:
            return f"{platform.node()} has {', '.join(differing)}", None
        os.environ["OMP_NUM_THREADS"] = "1"  # as in `prepare_process`
        function, arguments, keywords = pickle.loads(work)  # noqa: S301 - from the driver, as all that Ray runs
        for place, bundle in zip(places, bundles, strict=True):
            arguments[place] = PolicyBundle(*bundle)
        return "", function(*arguments, **keywords)

    return run


@contextlib.contextmanager
def _handlers_kept() -> Iterator[None]:
    """Restore the handler of SIGTERM, which Ray changes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.getsignal(signal.SIGTERM)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _connect(ray: Any, address: str) -> None:
    match = re.fullmatch(r"([^/\s]+):(\d{1,5})", address)
    if address != "auto" and match is None:
        raise WorkerError(f"ray must be 'auto' or HOST:PORT of a cluster that this machine is part of, got {address!r}")
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_task_oom_retries", str(_RETRIES))  # else Ray retries forever
    try:
        if match is not None:  # Ray itself would try for minutes
            socket.create_connection((match[1], int(match[2])), timeout=10).close()
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except (OSError, OverflowError, RuntimeError, ValueError, AssertionError) as error:
        reason = " ".join(str(error).split())
        raise WorkerError(
            f"there is no Ray cluster at {address!r} that this machine can work with: {reason}; start one with "
            "'ray start --head --disable-usage-stats', and on every other machine 'ray start --address HOST:PORT'"
        ) from error
