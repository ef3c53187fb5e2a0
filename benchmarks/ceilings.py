"""What this machine can do at most, for docs/performance.md: arithmetic, and bandwidth of each cache.

python -m benchmarks.ceilings
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm_pz.kernels import kernel

DEGREE = tuple(range(64))
"""A tuple, whose length the compiler knows."""


@kernel
def polynomials(x: NDArray[np.float32], degree: tuple[int, ...], rounds: int, result: NDArray[np.float32]) -> None:
    """Evaluate a polynomial at every x: two operations a degree, and nothing but registers in between."""
    for _ in range(rounds):
        for r in range(x.shape[0]):
            value = np.float32(0.5)
            for _ in range(len(degree)):
                value = value * x[r] + np.float32(0.25)
            result[r] = value


@njit
def evaluate(x: NDArray[np.float32], degree: tuple[int, ...], rounds: int, result: NDArray[np.float32]) -> None:
    """Call the kernel, as Python cannot."""
    polynomials(x, degree, rounds, result)


def median_rate(work: Callable[[], Any], amount: float) -> float:
    """Return what is done a second, the median of nine tries."""
    work()
    rates = []
    for _ in range(9):
        began = time.perf_counter()
        work()
        rates.append(amount / (time.perf_counter() - began))
    return statistics.median(rates)


def main() -> None:
    """Measure and print."""
    x, result, rounds = np.linspace(0.0, 1.0, 1024, dtype=np.float32), np.empty(1024, np.float32), 2000
    operations = 2.0 * len(DEGREE) * len(x) * rounds
    arithmetic = median_rate(lambda: evaluate(x, DEGREE, rounds, result), operations)
    print(f"float32 arithmetic, one thread: {arithmetic / 1e9:.0f} G operations/s")
    for size, name in ((8, "first-level cache"), (256, "second level"), (8192, "third level"), (262144, "memory")):
        source = np.ones(size * 1024 // 8, np.float32)  # half of it read, half written
        target, times = np.empty_like(source), max(1, 2**18 // size)

        def copy(source: Any = source, target: Any = target, times: int = times) -> None:
            for _ in range(times):
                np.copyto(target, source)

        rate = median_rate(copy, 2.0 * source.nbytes * times)
        print(f"{size:>7} KiB, {name:<18} {rate / 1e9:6.1f} GB/s read and written")


if __name__ == "__main__":
    main()
