"""Delays that an experimenter asked for: requested and measured."""

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
    """A requested delay in milliseconds, and the measured ones."""

    def __init__(self, asked_ms: float) -> None:
        self.asked_ms, self._count = asked_ms, 0
        self._got_ms = array("d")  # a long game without delays stores nothing

    def note(self, ms: float) -> None:
        """Count a delay; 0.0 if there was none."""
        self._count += 1
        if ms > 0.0:
            self._got_ms.append(ms)

    def summary(self) -> Delay:
        """Return the requested delay, the median of the measured ones, and their number."""
        median = float(np.median(self._got_ms)) if self._got_ms else 0.0
        return Delay(asked_ms=self.asked_ms, got_ms=median if self._count else None, count=self._count)


class _Waiting(NamedTuple):
    came: float
    act: Callable[[], None]
    measured: Measured | None


class DelayLine:
    """Calls functions after a delay in milliseconds, in order; at once if it is 0."""

    def __init__(self, delay_ms: float) -> None:
        self.delay_ms = delay_ms
        self._waiting: deque[_Waiting] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def put(self, act: Callable[[], None], measured: Measured | None = None) -> None:
        """Call a function after the delay, and measure it."""
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
        # The first is due, even if the timer was early.
        limit = max(time.monotonic() - self.delay_ms / 1000.0, self._waiting[0].came)
        while self._waiting and self._waiting[0].came <= limit:
            came, act, measured = self._waiting.popleft()
            if measured is not None:
                measured.note(1000.0 * (time.monotonic() - came))
            act()
        self._wait()

    def close(self) -> list[Callable[[], None]]:
        """Call nothing more, and return the functions that still wait."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        left = [one.act for one in self._waiting]
        self._waiting.clear()
        return left
