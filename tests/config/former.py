"""The preset `released` as it was first, written out as files of then hold it."""

from __future__ import annotations

from typing import Any

_CHANNELS = [
    "own_positions",
    "opposing_positions",
    "own_trail_age",
    "opposing_trail_age",
    "own_capture_field",
    "opposing_capture_field",
    "own_target",
    "own_share",
    "time_left",
]
RELEASED_1: dict[str, Any] = {
    "drones_per_team": 10,
    "time_limit": 300.0,
    "command_period": 1.0,
    "command_cells": 10,
    "spawn": {"inset": 0.1, "radius": 0.08, "layout": "squares", "side": 0.1},
    "memory": {
        "trail": None,
        "controller": None,
        "trail_forgotten_on": ["capture", "command"],
        "controller_forgotten_on": ["capture", "command"],
    },
    "capture": {"enabled": True, "threshold": 0.75, "field": "reconstruction"},
    "controller": {
        "modes": 10,
        "horizon": 10,
        "ergodic_weight": 1.0,
        "control_weight": 1.0,
        "wall_weight": 100.0,
        "wall_margin": 0.05,
        "max_acceleration": 1.0,
        "spectrum": "exponential",
        "communication_radius": None,
        "message_loss": 0.0,
    },
    "observation": {"kind": "grids", "grid": 50, "channels": _CHANNELS},
    "reward": {"size_change": 1.0, "outcome": 1.0},
    "controllers": "ergodic",
    "flocking": {
        "alignment": 0.1,
        "cohesion": 0.1,
        "separation": 0.15,
        "migration": [50.0, 100.0],
        "communication_radius": 0.15,
        "separation_radius": 0.05,
        "max_turn": 0.3141592653589793,
        "speed": 0.25,
    },
    "dynamics": {"speed_factor": 0.8, "failure_rate": 0.0, "repair_rate": 0.0},
}
CONFIG_HASH, RULES_HASH = "54939ef13faa7792", "40d557c188646960"
