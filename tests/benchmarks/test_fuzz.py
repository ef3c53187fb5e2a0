"""No legal configuration ends the process."""

from __future__ import annotations

from benchmarks.fuzz import watch


def test_random_legal_configurations_end_no_process_and_show_no_nan():
    """Numbers at the ends of their ranges made drones fly to NaN, and a kernel write beyond its arrays."""
    assert watch(0, count=100, rare=0.0) == 0
