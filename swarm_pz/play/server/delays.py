"""Delays that were asked for: what waits, in order, and how long it did wait."""

from __future__ import annotations

import asyncio
import time
from array import array
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from swarm_pz.play.recordings.format import Delay


class Measured:
    """How long things waited that were to wait for so long.

    Parameters
    ----------
    asked_ms : float
    """

    def __init__(self, asked_ms: float) -> None:
        self.asked_ms = asked_ms
        self._got_ms = array("d")

    def note(self, ms: float) -> None:
        """Note how long something waited."""
        self._got_ms.append(ms)

    def told(self) -> Delay:
        """Return what was asked for, the median of what was got, and of how many."""
        got = self._got_ms
        return Delay(asked_ms=self.asked_ms, got_ms=float(np.median(got)) if got else None, count=len(got))


class _Waiting(NamedTuple):
    came: float
    act: Callable[[], None]
    measured: Measured | None


class DelayLine:
    """Does things as much later as was asked for, and in the order in which they came.

    Parameters
    ----------
    delay_ms : float
        0 does them at once.
    """

    def __init__(self, delay_ms: float) -> None:
        self.delay_ms = delay_ms
        self._waiting: deque[_Waiting] = deque()
        self._timer: asyncio.TimerHandle | None = None

    def put(self, act: Callable[[], None], measured: Measured | None = None) -> None:
        """Do something when its time has come."""
        one = _Waiting(time.monotonic(), act, measured)
        if self.delay_ms > 0.0:
            self._waiting.append(one)
            self._wait()
        else:
            self._do(one)

    def _wait(self) -> None:
        if self._waiting and self._timer is None:
            left_s = self._waiting[0].came + self.delay_ms / 1000.0 - time.monotonic()
            self._timer = asyncio.get_running_loop().call_later(max(left_s, 0.0), self._release)

    def _release(self) -> None:
        self._timer = None
        # The first is due, whatever a timer's rounding says.
        limit = max(time.monotonic() - self.delay_ms / 1000.0, self._waiting[0].came)
        while self._waiting and self._waiting[0].came <= limit:
            self._do(self._waiting.popleft())
        self._wait()

    @staticmethod
    def _do(one: _Waiting) -> None:
        if one.measured is not None:
            one.measured.note(1000.0 * (time.monotonic() - one.came))
        one.act()

    def close(self) -> list[Callable[[], None]]:
        """Do nothing more, and return what still waited."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        left = [one.act for one in self._waiting]
        self._waiting.clear()
        return left
