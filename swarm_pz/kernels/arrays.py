"""Arrays by the type of their numbers, as kernels take them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]
Floats = NDArray[np.floating]
Int16s = NDArray[np.int16]
Int64s = NDArray[np.int64]
Int8s = NDArray[np.int8]
Integers = NDArray[np.integer]
Uint16s = NDArray[np.uint16]
Uint64s = NDArray[np.uint64]
Uint8s = NDArray[np.uint8]
