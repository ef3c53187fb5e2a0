"""A pool that stands in for machines with none of this one's files."""

from __future__ import annotations

import contextlib
import pickle
from concurrent.futures import Executor

from swarm_pz.evaluation.workers import SerialExecutor


class Elsewhere(Executor):
    """Do each task in this process, in the empty folder `place`; tasks and results are pickled.

    `submitted` holds the names of the functions submitted so far.
    """

    elsewhere = True

    def __init__(self, place):
        self._place, self.submitted = place, []

    def submit(self, fn, /, *args):
        self.submitted.append(fn.__name__)
        travelled = pickle.dumps((fn, *args))
        with contextlib.chdir(self._place):
            done = SerialExecutor().submit(*pickle.loads(travelled))  # noqa: S301
        if done.exception() is None:
            pickle.dumps(done.result())
        return done
