"""The random streams that PyTorch and NumPy keep for a whole process, which SB3 draws from."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch

from swarm_pz.training.checkpoint import Arrays


def streams() -> Arrays:
    """Return where the process's streams are."""
    _, keys, place, has_gauss, gauss = np.random.get_state(legacy=True)  # noqa: NPY002  (SB3's)
    return {
        "torch": torch.get_rng_state().numpy(),
        "numpy": np.array(keys, np.uint32),
        "numpy_place": np.array([place, has_gauss], np.int64),
        "numpy_gauss": np.array([gauss], np.float64),
    }


def set_streams(arrays: Arrays) -> None:
    """Put the process's streams where they were when `streams` was called."""
    place, has_gauss = arrays["numpy_place"].tolist()
    torch.set_rng_state(torch.from_numpy(arrays["torch"].copy()))
    np.random.set_state(("MT19937", arrays["numpy"], place, has_gauss, float(arrays["numpy_gauss"][0])))  # noqa: NPY002


@contextmanager
def kept() -> Iterator[None]:
    """Leave the process's streams at the end where they were found."""
    found = streams()
    try:
        yield
    finally:
        set_streams(found)
