"""The capture field, and who is captured.

The capture field at a cell is S / n: the team's occupancy summed over those of the 16 outer cells
of the 5x5 sub-grid around it that lie inside the square, over their number. A drone is captured
where the opposing value exceeds `threshold` times that field's maximum. Fractions are compared by
cross-multiplication, which is exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel
from swarm_pz.kernels.trails import cell_of


@kernel
def ring_count(row: int, column: int, cells: int) -> int:
    """Return the number n of cells on the ring around a cell that lie inside the square."""
    rows = min(row + 2, cells - 1) - max(row - 2, 0) + 1
    columns = min(column + 2, cells - 1) - max(column - 2, 0) + 1
    inner_rows = min(row + 1, cells - 1) - max(row - 1, 0) + 1
    inner_columns = min(column + 1, cells - 1) - max(column - 1, 0) + 1
    return rows * columns - inner_rows * inner_columns


@kernel
def field_maximum(ring_sums: NDArray[np.int32]) -> tuple[int, int]:
    """Return (S, n) of the cell where one team's capture field S / n is largest.

    Parameters
    ----------
    ring_sums : int32 array (cells, cells)
    """
    cells = ring_sums.shape[0]
    # Away from the walls every ring has 16 cells, so a plain maximum serves, which compilers turn
    # into vector instructions. Cells near a wall take part with a value that is too small.
    highest = np.int32(0)
    flat = ring_sums.ravel()
    for cell in range(flat.shape[0]):
        highest = flat[cell] if flat[cell] > highest else highest
    best_sum, best_count = int(highest), 16
    # Then the two lines of cells along each wall, by their true counts.
    for line in (0, 1, cells - 2, cells - 1):
        for along in range(cells):
            for row, column in ((line, along), (along, line)):
                ring_sum = int(ring_sums[row, column])
                if ring_sum * best_count > best_sum * 5:  # no ring has fewer than 5 cells inside
                    count = ring_count(row, column, cells)
                    if ring_sum * best_count > best_sum * count:
                        best_sum, best_count = ring_sum, count
    return best_sum, best_count


@kernel
def exceeds(ring_sum: int, count: int, maximum: tuple[int, int], threshold: float) -> bool:
    """Whether S / n > threshold * S_max / n_max; never for an empty field.

    The integer products are exact in float64; so is their product with a threshold of few bits.
    """
    return float(ring_sum * maximum[1]) > threshold * float(maximum[0] * count)


@kernel
def find_captured(
    positions: NDArray[np.float32],
    teams: NDArray[np.int8],
    ring_sums: NDArray[np.int32],
    threshold: float,
    captured: NDArray[np.bool_],
) -> None:
    """Test every drone of one game against the opposing capture field.

    Parameters
    ----------
    positions : float32 array (drones, 2)
    teams : int8 array (drones,)
    ring_sums : int32 array (2, cells, cells)
    threshold : float
    captured : bool array (drones,)
        Overwritten.
    """
    cells = ring_sums.shape[1]
    maxima = (field_maximum(ring_sums[0]), field_maximum(ring_sums[1]))
    for i in range(positions.shape[0]):
        opponent = 1 - teams[i]
        cell = cell_of(positions[i, 0], positions[i, 1], cells)
        row, column = cell // cells, cell % cells
        captured[i] = exceeds(
            ring_sums[opponent, row, column], ring_count(row, column, cells), maxima[opponent], threshold
        )
