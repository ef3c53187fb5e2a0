"""Games compared array by array, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from swarm_pz.kernels.game import Games
from swarm_pz.simulator import Simulator


def assert_same(one: Games, other: Games, but: str = "") -> None:
    """Compare all arrays of some games, but for one of this name."""
    for name, array, expected in zip(Games._fields, one, other, strict=True):
        if name != but:
            np.testing.assert_array_equal(array, expected, err_msg=name)


@contextmanager
def unchanged(simulator: Simulator) -> Iterator[None]:
    """Check that a block changes no game."""
    before = simulator.snapshot()
    yield
    assert_same(simulator.games, before)
