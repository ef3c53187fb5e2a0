"""A player without packages: a ring around the middle of the opposing drones. docs/bots.md has the protocol.

swarm-pz evaluate "exec:python3 examples/bots/ring.py" --opponent noise
"""

import json
import math
import sys


def middle(image):
    """Return the mean position of an image's brightness, in map widths."""
    cells = len(image)
    total = sum(map(sum, image))
    if total == 0:
        return 0.5, 0.5
    x = sum(value * (column + 0.5) for row in image for column, value in enumerate(row))
    y = sum(value * (place + 0.5) for place, row in enumerate(image) for value in row)
    return x / total / cells, y / total / cells


def ring(x, y, cells):
    """Return a density, row by row from the bottom up: a ring around a point."""
    along = [(cell + 0.5) / cells for cell in range(cells)]
    return [[math.exp(-(((math.hypot(a - x, b - y) - 0.25) / 0.1) ** 2)) for a in along] for b in along]


cells = 10
for line in sys.stdin:
    message = json.loads(line)
    if "swarm_pz" in message:
        cells = message["rules"]["command_cells"]
        sees = {"kind": "grids", "grid": 10, "channels": ["opposing_positions"]}
        print(json.dumps({"swarm_pz": 1, "observation": sees}), flush=True)
    elif "see" in message:
        density = ring(*middle(message["see"][0]), cells)
        print(json.dumps({"turn": message["turn"], "density": density}), flush=True)
