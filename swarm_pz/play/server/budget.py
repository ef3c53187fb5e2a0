"""What somebody may use up in a time: so much at once, and what comes back with every second."""

from __future__ import annotations


class Budget:
    """What somebody may use up.

    Parameters
    ----------
    most : float
        At once.
    per_second : float
        What comes back.
    now : float
        Seconds, of any clock.
    """

    def __init__(self, most: float, per_second: float, now: float) -> None:
        self._most, self._per_second = most, per_second
        self._left, self._at = most, now

    def take(self, amount: float, now: float) -> bool:
        """Use some up, and tell whether it was there; else nothing is used."""
        self._left = self.left(now)
        self._at = now
        if amount > self._left:
            return False
        self._left -= amount
        return True

    def left(self, now: float) -> float:
        """Return what is there."""
        return min(self._left + (now - self._at) * self._per_second, self._most)

    def is_full(self, now: float) -> bool:
        """Whether nothing was used that has not come back."""
        return self.left(now) >= self._most
