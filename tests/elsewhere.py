"""A pool whose workers are as on machines that have none of this one's files."""

from __future__ import annotations

import contextlib
import pickle
from concurrent.futures import Executor

from swarm_pz.evaluation.workers import SerialExecutor


class Elsewhere(Executor):
    """Does each task in this process, in another folder; whatever goes there or comes back is pickled.

    Parameters
    ----------
    place : Path
        An empty folder.

    Attributes
    ----------
    given : list of str
        What was done.
    """

    elsewhere = True

    def __init__(self, place):
        self._place, self.given = place, []

    def submit(self, fn, /, *args):
        self.given.append(fn.__name__)
        travelled = pickle.dumps((fn, *args))
        with contextlib.chdir(self._place):
            done = SerialExecutor().submit(*pickle.loads(travelled))  # noqa: S301
        if done.exception() is None:
            pickle.dumps(done.result())
        return done
