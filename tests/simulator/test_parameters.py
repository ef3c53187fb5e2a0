from __future__ import annotations

import math

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
from swarm_pz.kernels.game import ERGODIC, GIVEN
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.parameters import rule_parameters, rule_variants


def test_rules_are_told_in_ticks():
    rules = rule_parameters(GameConfig(dynamics=DynamicsConfig(speed_factor=0.6), capture=CaptureConfig(threshold=0.5)))
    assert (rules.tick, rules.drift) == (np.float32(1 / 30), np.float32(0.02))
    assert (rules.ticks_per_control_period, rules.ticks_per_second) == (3, 30)
    assert (rules.capture_enabled, rules.capture_threshold) == (True, 0.5)
    assert not rule_parameters(GameConfig(capture=CaptureConfig(enabled=False))).capture_enabled


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


VARIANTS = {
    "reconstructs": {"capture": CaptureConfig(field="reconstruction")},
    "trails forgotten on capture": {"memory": MemoryConfig(trail_forgotten_on=("capture",))},
    "trails forgotten on command": {"memory": MemoryConfig(trail_forgotten_on=("command",))},
    "memory forgotten on command": {"memory": MemoryConfig(controller_forgotten_on=("capture", "command"))},
    "memory never forgotten": {"memory": MemoryConfig(controller_forgotten_on=())},
    "failures": {"dynamics": DynamicsConfig(failure_rate=0.5)},
    "radius": {"controller": ControllerConfig(communication_radius=2.0)},
    "loss": {"controller": ControllerConfig(message_loss=0.5)},
    "relays": {"controller": ControllerConfig(message_loss=0.5, relay=True)},
    "red flocks": {"controllers": ("flocking", "ergodic")},
    "blue flocks": {"controllers": ("ergodic", "flocking")},
}


def test_games_of_the_kind_of_the_preset_paper_have_no_variants():
    for changes in (
        {"dynamics": DynamicsConfig(speed_factor=0.5, repair_rate=1.0)},
        {"controller": ControllerConfig(spectrum="exponential", horizon=3, relay=True)},
        {"memory": MemoryConfig(trail=None, controller=None), "reward": RewardConfig(outcome=2.0)},
        {"flocking": FlockingConfig(speed=0.1), "capture": CaptureConfig(enabled=False)},
    ):
        assert rule_variants(GameConfig(**changes)) is None


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_told_and_no_other(name):
    variants = rule_variants(GameConfig(**VARIANTS[name]))
    assert variants.reconstructs == (name == "reconstructs")
    assert variants.capture_forgets == (name == "trails forgotten on capture", name != "memory never forgotten")
    assert variants.command_forgets == (name == "trails forgotten on command", name == "memory forgotten on command")
    assert variants.can_fail == (name == "failures")
    assert variants.communication.is_local == (name in ("failures", "radius", "loss", "relays"))
    assert variants.communication.radius == (2.0 if name == "radius" else math.inf)
    assert variants.communication.loss == (0.5 if name in ("loss", "relays") else 0.0)
    assert variants.communication.relays == (name == "relays")
    assert variants.is_given == name.endswith("flocks") and variants.is_ergodic
    numbers = {"red flocks": [GIVEN, ERGODIC], "blue flocks": [ERGODIC, GIVEN + 1]}.get(name, [ERGODIC] * 2)
    assert Simulator(GameConfig(**VARIANTS[name])).games.flown_by[0].tolist() == numbers


@pytest.mark.filterwarnings("ignore:overflow")
def test_numbers_that_are_not_finite_for_the_kernels_are_refused():
    """Drones would fly to NaN, should a range allow it."""
    config = GameConfig()
    object.__setattr__(config.controller, "control_weight", 1e-40)
    with pytest.raises(ConfigError, match="inverse_control_weight must be finite for the kernels, got inf"):
        Simulator(config)
