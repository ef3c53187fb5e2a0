"""Linear assignment by shortest augmenting paths.

After Crouse, "On implementing 2D rectangular assignment algorithms" (IEEE Transactions on Aerospace and Electronic
Systems 52, 2016), in the order of `scipy.optimize.linear_sum_assignment`, so that ties are broken alike.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import exact
from swarm_pz.kernels.arrays import Float64s, Int64s


@exact
def assign(costs: Float64s, columns: Int64s) -> None:
    """Write the column of each row into `columns` (n,), each taken once, so that the sum of costs (n, n) is least."""
    count = len(costs)
    row_prices, column_prices, shortest = np.empty(count), np.empty(count), np.empty(count)
    rows, path, left = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    seen_rows, seen_columns = np.empty(count, np.bool_), np.empty(count, np.bool_)
    for i in range(count):  # one by one: filling whole arrays takes seconds to compile
        row_prices[i], column_prices[i], rows[i], path[i], columns[i] = 0.0, 0.0, -1, -1, -1
    for first in range(count):
        for i in range(count):
            left[i] = count - 1 - i  # so that equal costs leave row i column i
            seen_rows[i], seen_columns[i], shortest[i] = False, False, np.inf
        row, sink, length, remaining = first, -1, 0.0, count
        while sink < 0:
            seen_rows[row] = True
            lowest, best = np.inf, -1
            for place in range(remaining):
                column = left[place]
                through = length + costs[row, column] - row_prices[row] - column_prices[column]
                if through < shortest[column]:
                    path[column], shortest[column] = row, through
                if shortest[column] < lowest or (shortest[column] == lowest and rows[column] < 0):
                    lowest, best = shortest[column], place
            length, column = lowest, left[best]
            if rows[column] < 0:
                sink = column
            else:
                row = rows[column]
            seen_columns[column] = True
            remaining -= 1
            left[best] = left[remaining]
        row_prices[first] += length
        for row in range(count):
            if seen_rows[row] and row != first:
                row_prices[row] += length - shortest[columns[row]]
        for column in range(count):
            if seen_columns[column]:
                column_prices[column] -= length - shortest[column]
        column = sink
        while column >= 0:  # the path back to the first row, which had no column
            row = path[column]
            rows[column] = row
            columns[row], column = column, columns[row]
