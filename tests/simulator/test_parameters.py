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
from swarm_pz.kernels.controllers.ergodic import ergodic_parameters
from swarm_pz.kernels.controllers.flocking import flocking_parameters
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


def test_chances_are_those_of_a_control_period():
    variants = rule_variants(GameConfig(dynamics=DynamicsConfig(failure_rate=2.0, repair_rate=5.0)))
    assert variants.failure_chance == pytest.approx(1 - math.exp(-0.2))
    assert variants.repair_chance == pytest.approx(1 - math.exp(-0.5))


def test_every_number_of_a_flock_is_passed_on():
    numbers = {
        "alignment": 1.0, "cohesion": 2.0, "separation": 3.0, "communication_radius": 0.5, "separation_radius": 0.25,
        "max_turn": 1.5, "speed": 0.125,
    }  # fmt: skip
    told = flocking_parameters(GameConfig(flocking=FlockingConfig(**numbers)))
    assert {name: getattr(told, name) for name in numbers} == numbers
    assert told.period == 0.1


def test_every_number_of_the_ergodic_controller_is_passed_on():
    numbers = {"modes": 4, "horizon": 3, "ergodic_weight": 5.0, "control_weight": 0.25, "wall_weight": 7.0}
    numbers |= {"wall_margin": 0.125, "max_acceleration": 3.0}
    for tau, decay in ((2.0, math.exp(-0.05)), (None, 1.0)):
        told = ergodic_parameters(
            GameConfig(
                controller=ControllerConfig(**numbers),
                memory=MemoryConfig(controller=tau),
                dynamics=DynamicsConfig(speed_factor=0.5),
            )
        )
        assert told.decay == np.float32(decay)
        assert told.modes == (0, 1, 2, 3)
        np.testing.assert_allclose(told.times, [0.0, 0.05, 0.1, 0.15], rtol=1e-6)
        assert told.spectrum[1, 2] == np.float32(5.0 * 6**-1.5)
        assert (told.wall_weight, told.wall_margin, told.max_acceleration) == (7.0, 0.125, 3.0)
        assert told.inverse_control_weight == np.float32(8.0)


@pytest.mark.filterwarnings("ignore:overflow")
def test_numbers_that_are_not_finite_for_the_kernels_are_refused():
    """Drones would fly to NaN, should a range allow it."""
    config = GameConfig()
    object.__setattr__(config.controller, "control_weight", 1e-40)
    with pytest.raises(ConfigError, match="inverse_control_weight must be finite for the kernels, got inf"):
        Simulator(config)
