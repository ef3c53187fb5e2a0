"""Named variants of the rules: the sections in which each differs from the defaults."""

from __future__ import annotations

from typing import Any

from swarm_pz.config.sections import CaptureConfig, ControllerConfig, DynamicsConfig, MemoryConfig, SpawnConfig

PRESETS: dict[str, dict[str, Any]] = {
    "paper": {},
    # Drones that must keep flying: nobody can park, as docs/parking.md measures.
    "fixed_wing": {"dynamics": DynamicsConfig(min_speed=0.3)},
    # The authors' published variant. Left out are red's flocking, which controllers=("flocking", "ergodic") adds,
    # messages up to 0.1 s old, x and y swapped in the field, and the rest of docs/tables/released_left_out.csv.
    "released": {
        "spawn": SpawnConfig(layout="squares", speed=0.2),
        "memory": MemoryConfig(
            trail=None,
            controller=None,
            trail_forgotten_on=("capture", "command"),
            controller_forgotten_on=("capture", "sending"),
        ),
        "capture": CaptureConfig(field="reconstruction"),
        "controller": ControllerConfig(
            spectrum="exponential",
            ergodic_weight=1.0,
            control_weight=1.0,
            wall_margin=0.01,
            target_mass=10.0,
            warm_start=True,
        ),
        "dynamics": DynamicsConfig(speed_factor=0.8),
    },
}
"""Fields of a `GameConfig` by the preset's name; `GameConfig.preset` makes one."""
