"""The capture field of the preset `released`, from the coefficients of a team's controller.

The team's mean coefficients c_k give a density on the grid: sum_k c_k F_k at the cells' centres. Each cell gets its
average over those of the 16 outer cells of the 5x5 sub-grid around it that lie inside the square. The averages are
rescaled so that the least is 0 and the largest 1.
"""

from __future__ import annotations

import math

import numpy as np

from swarm_pz.config import GRID_CELLS, MAX_MODES
from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Bools, Float32s, Float64s, Int8s, Int16s
from swarm_pz.kernels.capture import FRAMED_CELLS, RING_COUNTS, RING_RADIUS, ring_sum

_CENTRE_COSINES = np.array(
    [[math.cos(math.pi * k * (cell + 0.5) / GRID_CELLS) for cell in range(GRID_CELLS)] for k in range(MAX_MODES)]
)
"""(modes, G) cos(pi k x) at the centres of the cells."""


@kernel
def reconstruct(coefficients: Float32s, density: Float64s) -> None:
    """Write sum_k c_k F_k at the cells' centres into `density` (G, G)."""
    modes = coefficients.shape[0]
    density[:] = 0.0
    for k2 in range(modes):
        for column in range(GRID_CELLS):
            along_x = 0.0
            for k1 in range(modes):
                along_x += coefficients[k1, k2] * _CENTRE_COSINES[k1, column]
            for row in range(GRID_CELLS):
                density[row, column] += along_x * _CENTRE_COSINES[k2, row]


@kernel
def rebuild_field(coefficients: Float32s, field: Float32s) -> None:
    """Compute a team's capture field (G, G) from its mean coefficients (K, K).

    A field that is the same everywhere captures nothing: it becomes 0.
    """
    framed = np.zeros((FRAMED_CELLS, FRAMED_CELLS), np.float64)
    reconstruct(coefficients, framed[RING_RADIUS:-RING_RADIUS, RING_RADIUS:-RING_RADIUS])
    flat = framed.ravel()
    averages = np.empty((GRID_CELLS, GRID_CELLS), np.float64)
    for row in range(GRID_CELLS):
        for column in range(GRID_CELLS):
            averages[row, column] = ring_sum(flat, np.uint64(row * FRAMED_CELLS + column)) / RING_COUNTS[row, column]
    lowest, highest = averages.min(), averages.max()
    spread = highest - lowest
    if spread < 1e-12:  # rounding alone
        field[:] = np.float32(0.0)
        return
    for row in range(GRID_CELLS):
        for column in range(GRID_CELLS):
            field[row, column] = (averages[row, column] - lowest) / spread


@kernel
def find_captured_by_density(cells: Int16s, teams: Int8s, fields: Float32s, threshold: float, captured: Bools) -> bool:
    """Mark the drones (N,) of one game where the opposing field is at least the threshold; return whether any is."""
    found = False
    for i in range(cells.shape[0]):
        row, column = divmod(cells[i], GRID_CELLS)
        captured[i] = fields[1 - teams[i], row, column] >= np.float32(threshold)
        found |= captured[i]
    return found
