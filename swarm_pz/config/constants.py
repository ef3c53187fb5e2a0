"""Constants of the rules: the tick, the control period, the grid and the two teams."""

from __future__ import annotations

TICKS_PER_SECOND = 30
TICKS_PER_CONTROL_PERIOD = 3
CONTROL_PERIOD = TICKS_PER_CONTROL_PERIOD / TICKS_PER_SECOND
"""Seconds between two solves of the controller."""
GRID_CELLS = 50
"""Cells a side of the occupancy grid and the capture field."""
MAX_MODES = 16
"""Fourier modes a side that the kernels have room for."""
CHANNELS = (
    "own_positions",
    "opposing_positions",
    "own_trail_age",
    "opposing_trail_age",
    "own_capture_field",
    "opposing_capture_field",
    "own_target",
    "own_share",
    "time_left",
)
"""Default channels of grid observations; see `swarm_pz.spaces.observation`."""
MOTION_CHANNELS = ("own_now", "opposing_now", "own_soon", "opposing_soon")
"""Further channels: positions to a fraction of a cell, now and soon."""
SOON = 0.5
"""Seconds that the channels of predicted positions look ahead, at constant velocity."""
LONGEST_TRAIL = 600.0
"""Seconds of the longest trail that there is room for."""
RED, BLUE = 0, 1
AGENTS = ("red_0", "blue_0")
TEAM_NAMES = ("red", "blue")
