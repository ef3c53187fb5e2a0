"""Delays that an experimenter asked for: what waits, in order, and how long it did wait."""

from __future__ import annotations

import asyncio
import time
from array import array
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from swarm_pz.play.protocol import Delay


class Measured:
    """How long things waited that were to wait for so many milliseconds."""

    def __init__(self, asked_ms: float) -> None:
        self.asked_ms, self._count = asked_ms, 0
        self._got_ms = array("d")
        """Of what waited at all: a long game without a delay keeps nothing."""

    def note(self, ms: float) -> None:
        """Note how long something waited; 0.0 if it was done at once."""
        self._count += 1
        if ms > 0.0:
            self._got_ms.append(ms)

    def told(self) -> Delay:
        """Return what was asked for, the median of what was got, and of how many."""
        got = float(np.median(self._got_ms)) if self._got_ms else 0.0
        return Delay(asked_ms=self.asked_ms, got_ms=got if self._count else None, count=self._count)


class _Waiting(NamedTuple):
    came: float
    act: Callable[[], None]
    measured: Measured | None


class DelayLine:
    """Does things so many milliseconds later, in the order in which they came; with 0 at once."""

    def __init__(self, delay_ms: float) -> None:
        self.delay_ms = delay_ms
        self._waiting: deque[_Waiting] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def put(self, act: Callable[[], None], measured: Measured | None = None) -> None:
        """Do something when its time has come, and note how long it waited."""
        if self.delay_ms > 0.0:
            self._waiting.append(_Waiting(time.monotonic(), act, measured))
            self._wait()
            return
        if measured is not None:
            measured.note(0.0)
        act()

    def _wait(self) -> None:
        if self._waiting and self._timer is None:
            left_s = self._waiting[0].came + self.delay_ms / 1000.0 - time.monotonic()
            self._timer = asyncio.get_running_loop().call_later(max(left_s, 0.0), self._release)

    def _release(self) -> None:
        self._timer = None
        # The first is due, whatever a timer's rounding says.
        limit = max(time.monotonic() - self.delay_ms / 1000.0, self._waiting[0].came)
        while self._waiting and self._waiting[0].came <= limit:
            one = self._waiting.popleft()
            if one.measured is not None:
                one.measured.note(1000.0 * (time.monotonic() - one.came))
            one.act()
        self._wait()

    def close(self) -> list[Callable[[], None]]:
        """Do nothing more, and return what still waited."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        left = [one.act for one in self._waiting]
        self._waiting.clear()
        return left
