"""The ergodic controller, compared with its slow reference."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import DynamicsConfig, GameConfig, MemoryConfig
from tests.kernels.states import SOFT, assert_mirrored, random_state, solved
from tests.reference import ControllerReference

MIRRORS = {
    "free": ({"controller": SOFT}, {}),
    "exponential": ({"controller": SOFT.replace(spectrum="exponential")}, {"spectrum": "exponential"}),
    "fast": ({"controller": SOFT, "dynamics": DynamicsConfig(speed_factor=1.7)}, {"speed_factor": 1.7}),
    "for ever": ({"controller": SOFT, "memory": MemoryConfig(controller=None)}, {"tau": None}),
    "other weights": (
        {"controller": SOFT.replace(ergodic_weight=50.0, wall_weight=30.0, wall_margin=0.2)},
        {"q": 50.0, "wall_weight": 30.0, "wall_margin": 0.2},
    ),
    "published gains": (
        {"controller": GameConfig.preset("released").controller.replace(warm_start=False, target_mass=1.0)},
        {"q": 1.0, "r": 1.0, "spectrum": "exponential", "wall_margin": 0.01},
    ),
}


@pytest.mark.parametrize("name", MIRRORS)
def test_it_does_what_its_slow_mirror_does(name):
    options, numbers = MIRRORS[name]
    generator = np.random.default_rng(0)
    for _ in range(8):
        state = random_state(generator, int(generator.integers(1, 31)), spread=float(generator.choice([0.05, 0.3, 1])))
        state.velocities[: generator.integers(3)] = 0.0
        assert_mirrored(solved(state, **options), state, ControllerReference(**{"r": 20.0, **numbers}))
