"""Strokes of a round brush on an image, which `swarm_pz.play.strokes` turns into commands."""

from __future__ import annotations

from swarm_pz.kernels import entry_point
from swarm_pz.kernels.arrays import Float64s, Int8s


@entry_point
def paint(image: Int8s, points: Float64s, reach: float, value: int) -> None:
    """Give a value to the pixels whose centres lie within `reach` of a line.

    The image is `[row = y, column = x]`. The line's points (n, 2) are x, y in pixels, and may lie outside; one point is
    a dot.
    """
    side = image.shape[0]
    for k in range(len(points)):
        ax, ay = points[k]
        bx, by = points[min(k + 1, len(points) - 1)]
        dx, dy = bx - ax, by - ay
        length = dx * dx + dy * dy
        for row in range(max(0, int(min(ay, by) - reach)), min(side, int(max(ay, by) + reach) + 1)):
            # Only the part of the line that is within reach of a row can paint there, so the cost grows with the
            # painted area, not with the rectangle around the line. One more pixel on either side is for rounding.
            first, last = 0.0, 1.0
            if dy != 0.0:
                one, other = (row + 0.5 - reach - ay) / dy, (row + 0.5 + reach - ay) / dy
                first, last = max(first, min(one, other)), min(last, max(one, other))
            low, high = min(ax + first * dx, ax + last * dx) - reach, max(ax + first * dx, ax + last * dx) + reach
            for column in range(max(0, int(low) - 1), min(side, int(high) + 2)):
                if image[row, column] == value:
                    continue
                x, y = column + 0.5 - ax, row + 0.5 - ay
                share = min(max((x * dx + y * dy) / length, 0.0), 1.0) if length > 0.0 else 0.0
                x, y = x - share * dx, y - share * dy
                if x * x + y * y <= reach * reach:
                    image[row, column] = value
