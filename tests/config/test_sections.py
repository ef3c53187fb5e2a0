"""Every number of every section: the range that it may take, told once more, and what it is at rest."""

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
    ObservationConfig,
    RewardConfig,
    SpawnConfig,
)
from swarm_pz.errors import ConfigError

COUNTS = [
    (ControllerConfig, "controller.modes", 2, 16),
    (ControllerConfig, "controller.horizon", 2, 100),
    (ObservationConfig, "observation.grid", 1, 50),
    (GameConfig, "command_cells", 2, 50),
    (GameConfig, "drones_per_team", 1, 10_000),
]
NUMBERS = [
    (SpawnConfig, "spawn.radius", 0.0, 0.1),
    (SpawnConfig, "spawn.side", 0.0, 0.9),
    (SpawnConfig, "spawn.speed", 0.0, 10.0),
    (MemoryConfig, "memory.trail", 1 / 30, 600.0),
    (MemoryConfig, "memory.controller", 0.01, 1e6),
    (CaptureConfig, "capture.threshold", 0.001, 0.999),
    (ControllerConfig, "controller.ergodic_weight", 0.0, 1e6),
    (ControllerConfig, "controller.control_weight", 1e-4, 1e6),
    (ControllerConfig, "controller.wall_weight", 0.0, 1e6),
    (ControllerConfig, "controller.wall_margin", 0.0, 0.5),
    (ControllerConfig, "controller.max_acceleration", 1e-9, 100.0),
    (ControllerConfig, "controller.communication_radius", 0.0, 2.0),
    (ControllerConfig, "controller.message_loss", 0.0, 1.0),
    (ControllerConfig, "controller.target_mass", 1e-3, 1e3),
    (FlockingConfig, "flocking.alignment", 0.0, 1e6),
    (FlockingConfig, "flocking.cohesion", 0.0, 1e6),
    (FlockingConfig, "flocking.separation", 0.0, 1e6),
    (FlockingConfig, "flocking.communication_radius", 0.0, 2.0),
    (FlockingConfig, "flocking.separation_radius", 0.0, 2.0),
    (FlockingConfig, "flocking.max_turn", 1e-3, math.pi),
    (FlockingConfig, "flocking.speed", 1e-3, 10.0),
    (FlockingConfig, "flocking.dwell", 0.1, 1e6),
    (DynamicsConfig, "dynamics.speed_factor", 1e-3, 10.0),
    (DynamicsConfig, "dynamics.failure_rate", 0.0, 1e3),
    (DynamicsConfig, "dynamics.repair_rate", 0.0, 1e3),
    (RewardConfig, "reward.size_change", -1e6, 1e6),
    (RewardConfig, "reward.outcome", -1e6, 1e6),
    (GameConfig, "time_limit", 0.1, 1e6),
    (GameConfig, "command_period", 0.1, 1e6),
]


@pytest.mark.parametrize(("section", "name", "low", "high"), COUNTS)
def test_counts_are_taken_up_to_the_ends_of_their_range_and_no_further(section, name, low, high):
    field = name.rpartition(".")[2]
    for count in (low, high):
        assert getattr(section(**{field: count}), field) == count
    for count in (low - 1, high + 1, float(low), True):
        with pytest.raises(ConfigError, match=rf"^{name} must be a whole number in \[{low}, {high}\], got"):
            section(**{field: count})


@pytest.mark.parametrize(("section", "name", "low", "high"), NUMBERS)
def test_numbers_are_taken_up_to_the_ends_of_their_range_and_no_further(section, name, low, high):
    field = name.rpartition(".")[2]
    for number in (low, high):
        assert getattr(section(**{field: number}), field) == number
    for number in (float(np.nextafter(low, -math.inf)), float(np.nextafter(high, math.inf)), math.nan, "1", True):
        with pytest.raises(ConfigError, match=rf"^{name} must be .*, got"):
            section(**{field: number})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SpawnConfig(inset=-0.01, radius=0.0), r"spawn.inset must be a number in \[0, 0.5\]"),
        (lambda: SpawnConfig(inset=0.51), r"spawn.inset must be a number in \[0, 0.5\]"),
        (lambda: SpawnConfig(inset=0.05, radius=0.06), r"spawn.radius must be a number in \[0, 0.05\]"),
        (lambda: SpawnConfig(layout="rings"), "spawn.layout must be 'corners' or 'squares'"),
        (lambda: SpawnConfig(layout="squares", inset=0.3, side=0.71), r"spawn.side must be a number in \[0, 0.7\]"),
        (lambda: SpawnConfig(layout="squares", radius=0.51), r"spawn.radius must be a number in \[0, 0.5\]"),
        (lambda: MemoryConfig(trail=1.01), "memory.trail must be a whole number of ticks"),
        (lambda: MemoryConfig(trail_forgotten_on=("noon",)), "memory.trail_forgotten_on must be a tuple of any of"),
        (lambda: MemoryConfig(controller_forgotten_on="capture"), "memory.controller_forgotten_on must be a tuple"),
        (lambda: CaptureConfig(field="trails"), "capture.field must be 'occupancy' or 'reconstruction'"),
        (lambda: ControllerConfig(relay=1), "controller.relay must be True or False, got 1"),
        (lambda: ControllerConfig(spectrum="flat"), "controller.spectrum must be 'sobolev' or 'exponential'"),
        (lambda: FlockingConfig(migration=5.0), "flocking.migration must be a pair"),
        (lambda: FlockingConfig(migration=(1.0, 2.0, 3.0)), "flocking.migration must be a pair"),
        (lambda: FlockingConfig(migration=(-1.0, 2.0)), r"flocking.migration\[0\] must be"),
        (lambda: FlockingConfig(migration=(3.0, 2.0)), r"flocking.migration\[1\] must be a number in \[3, 1e\+06\]"),
        (lambda: FlockingConfig(migration=(3.0, 1.1e6)), r"flocking.migration\[1\] must be"),
        (lambda: ObservationConfig(channels=("own_share", "weather")), "observation.channels must be different ones"),
        (lambda: GameConfig(time_limit=0.25), "time_limit must be a whole number of control periods"),
        (lambda: GameConfig(observation=(ObservationConfig(),) * 3), "observation must be an ObservationConfig or"),
        (
            lambda: GameConfig(observation=(ObservationConfig(grid=10), 5)),
            "observation must be an ObservationConfig or",
        ),
        (lambda: GameConfig(controllers="herding"), "there is no control system 'herding'; did you mean"),
        (lambda: GameConfig(controllers=("ergodic", "herding")), "there is no control system 'herding'"),
        (lambda: GameConfig(drones_per_team=(3, 10_001)), r"drones_per_team must be a whole number in \[1, 10000\]"),
        (lambda: GameConfig(drones_per_team=0, capture=CaptureConfig(enabled=False)), "at least one drone in all"),
        (lambda: GameConfig(drones_per_team=(-1, 2), capture=CaptureConfig(enabled=False)), r"in \[0, 10000\], got -1"),
    ],
)
def test_what_no_range_can_tell_is_refused_by_name(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


@pytest.mark.parametrize("name", ["spawn", "memory", "capture", "controller", "reward", "flocking", "dynamics"])
def test_a_section_is_not_taken_for_another_one(name):
    kind = type(getattr(GameConfig(), name))
    other = {"memory": SpawnConfig()}.get(name, MemoryConfig())
    for wrong in (other, None, {}):
        with pytest.raises(ConfigError, match=f"^{name} must be a {kind.__name__}, got"):
            GameConfig(**{name: wrong})


def test_corner_points_may_lie_in_the_corners_and_in_the_centre():
    assert SpawnConfig(inset=0.0, radius=0.0).inset == 0.0
    assert SpawnConfig(inset=0.5, radius=0.5, side=0.5).radius == 0.5


def test_squares_have_no_corner_points_that_a_radius_could_leave():
    assert SpawnConfig(layout="squares", inset=0.1, radius=0.3).radius == 0.3
    assert SpawnConfig(layout="squares", inset=0.4, side=0.6).side == 0.6


def test_occasions_are_a_set():
    both = MemoryConfig(trail_forgotten_on=("command", "capture", "command"), controller_forgotten_on=["command"])
    assert (both.trail_forgotten_on, both.controller_forgotten_on) == (("capture", "command"), ("command",))


@pytest.mark.parametrize(
    ("changes", "trail", "step", "limit"),
    [
        ({}, 150, 30, 9000),
        ({"time_limit": 60.0, "command_period": 0.7}, 150, 21, 1800),
        ({"memory": MemoryConfig(trail=4.1)}, 123, 30, 9000),
        ({"memory": MemoryConfig(trail=None), "time_limit": 4.1}, 123, 30, 123),
        ({"memory": MemoryConfig(trail=None), "time_limit": 1000.0}, 18_000, 30, 30_000),
    ],
)
def test_times_are_told_in_ticks(changes, trail, step, limit):
    config = GameConfig(**changes)
    assert (config.trail_ticks, config.step_ticks, config.limit_ticks) == (trail, step, limit)


def test_options_are_off_at_rest():
    # No hash of the default game would tell: it leaves out what came later.
    rest = GameConfig().to_dict()
    spawn = {name: rest["spawn"][name] for name in ("layout", "side", "speed")}
    assert spawn == {"layout": "corners", "side": 0.1, "speed": 0.0}
    assert rest["memory"]["trail_forgotten_on"] == () and rest["memory"]["controller_forgotten_on"] == ("capture",)
    assert rest["capture"]["field"] == "occupancy"
    later = ("spectrum", "communication_radius", "message_loss", "relay", "target_mass")
    assert [rest["controller"][name] for name in later] == ["sobolev", None, 0.0, False, 1.0]
    assert rest["controllers"] == "ergodic"
    assert rest["dynamics"] == {"speed_factor": 1.0, "failure_rate": 0.0, "repair_rate": 0.0}
    assert rest["flocking"] == {
        "alignment": 0.1,
        "cohesion": 0.1,
        "separation": 0.15,
        "migration": (50.0, 100.0),
        "communication_radius": 0.15,
        "separation_radius": 0.05,
        "max_turn": math.pi / 10,
        "speed": 0.25,
        "dwell": 5.0,
    }
