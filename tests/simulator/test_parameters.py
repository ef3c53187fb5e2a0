from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import (
    CaptureConfig,
    ControllerConfig,
    DynamicsConfig,
    FlockingConfig,
    GameConfig,
    MemoryConfig,
    RewardConfig,
)
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.parameters import rule_parameters, rule_variants


@pytest.mark.parametrize(
    ("config", "dtype"),
    [
        (GameConfig(), np.int32),
        (GameConfig(drones_per_team=600), np.int32),
        (GameConfig(drones_per_team=700), np.int64),
        (GameConfig(memory=MemoryConfig(trail=600.0)), np.int64),
        (GameConfig(memory=MemoryConfig(trail=None), time_limit=1.0), np.int64),
    ],
)
def test_fields_have_room_for_all_trails_in_one_cell(config, dtype):
    weights = rule_parameters(config).ring_weights
    assert weights.dtype == dtype
    if config.memory.trail is not None:
        assert config.num_drones * config.trail_ticks * int(weights.max()) <= np.iinfo(dtype).max


def test_games_of_the_kind_of_the_preset_paper_have_no_variants():
    for changes in (
        {"dynamics": DynamicsConfig(speed_factor=0.5, repair_rate=1.0)},
        {"controller": ControllerConfig(spectrum="exponential", horizon=3, relay=True)},
        {"memory": MemoryConfig(trail=None, controller=None), "reward": RewardConfig(outcome=2.0)},
        {"flocking": FlockingConfig(speed=0.1), "capture": CaptureConfig(enabled=False)},
    ):
        assert rule_variants(GameConfig(**changes)) is None


@pytest.mark.filterwarnings("ignore:overflow")
def test_numbers_that_are_not_finite_for_the_kernels_are_refused():
    """Drones would fly to NaN, should a range allow it."""
    config = GameConfig()
    object.__setattr__(config.controller, "control_weight", 1e-40)
    with pytest.raises(ConfigError, match="inverse_control_weight must be finite for the kernels, got inf"):
        Simulator(config)
