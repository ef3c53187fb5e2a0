from __future__ import annotations

import numpy as np
import torch

from swarm_pz.training import randomness


def draw():
    return [np.random.normal(), np.random.random(), float(torch.rand(1)), float(torch.randn(1))]  # noqa: NPY002


def test_streams_that_were_put_back_give_the_same_numbers_again():
    with randomness.kept():
        np.random.normal()  # noqa: NPY002  (the second of a pair is kept for the next call)
        found = randomness.streams()
        first = draw()
        with randomness.kept():
            second = draw()
        assert second != first
        assert draw() == second
        randomness.set_streams(found)
        assert draw() == first
