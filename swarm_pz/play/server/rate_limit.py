"""Rate limits for clients: so many events within some seconds."""

from __future__ import annotations

import time
from collections import deque


class RateLimit:
    """At most `most` events within `seconds`."""

    def __init__(self, most: int, seconds: float) -> None:
        self._seconds = seconds
        self._times: deque[float] = deque(maxlen=most)

    def is_reached(self) -> bool:
        """Return true if the next event would be one too many."""
        return len(self._times) == self._times.maxlen and time.monotonic() - self._times[0] < self._seconds

    def take(self) -> bool:
        """Count an event unless it is one too many; return whether it was counted."""
        if self.is_reached():
            return False
        self._times.append(time.monotonic())
        return True

    def is_idle(self) -> bool:
        """Return true if there are no recent events."""
        return not self._times or time.monotonic() - self._times[-1] >= self._seconds


class AddressLimits:
    """A `RateLimit` for each address."""

    def __init__(self, most: int, seconds: float) -> None:
        self._most, self._seconds = most, seconds
        self._limits: dict[str, RateLimit] = {}

    def of(self, address: str) -> RateLimit:
        """Return the limit of an address."""
        return self._limits.setdefault(address, RateLimit(self._most, self._seconds))

    def forget(self) -> None:
        """Forget addresses without recent events."""
        self._limits = {address: limit for address, limit in self._limits.items() if not limit.is_idle()}
