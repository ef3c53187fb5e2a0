from __future__ import annotations

import json
import pickle
import subprocess
import sys

import numpy as np
import pytest

from swarm_pz import (
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
from swarm_pz.parameters import rule_parameters


def test_defaults_are_the_preset_paper():
    assert GameConfig.preset("paper") == GameConfig()


def test_unknown_preset_names_the_nearest():
    with pytest.raises(ConfigError, match="did you mean 'paper'"):
        GameConfig.preset("papr")


def test_unknown_field_names_the_nearest():
    with pytest.raises(ConfigError, match="drones_per_team"):
        GameConfig(drone_per_team=3)
    with pytest.raises(ConfigError, match="did you mean 'threshold'"):
        GameConfig.from_dict({"capture": {"treshold": 0.5}})


def test_positional_arguments_are_refused():
    with pytest.raises(TypeError):
        GameConfig(10)


def test_configurations_are_frozen():
    with pytest.raises(AttributeError):
        GameConfig().time_limit = 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GameConfig(drones_per_team=0), r"drones_per_team must be a whole number in \[1, 10000\], got 0"),
        (lambda: GameConfig(drones_per_team=2.5), "drones_per_team"),
        (lambda: GameConfig(drones_per_team=(1, 2, 3)), "drones_per_team"),
        (lambda: GameConfig(drones_per_team="ten"), "drones_per_team"),
        (lambda: GameConfig(time_limit=0.0), "time_limit"),
        (lambda: GameConfig(time_limit=float("nan")), "time_limit"),
        (lambda: GameConfig(command_period=0.25), "whole number of control periods"),
        (lambda: GameConfig(command_cells=1), "command_cells"),
        (lambda: GameConfig(capture=0.5), "capture must be a CaptureConfig"),
        (lambda: GameConfig(observation="grids"), "observation must be an ObservationConfig or a pair"),
        (lambda: CaptureConfig(threshold=0.0), "capture.threshold"),
        (lambda: CaptureConfig(threshold=1.0), "strictly between 0 and 1, got 1.0"),
        (lambda: CaptureConfig(enabled=1), "capture.enabled must be True or False, got 1"),
        (lambda: ObservationConfig(grid=20), "a divisor of 50, got 20"),
        (lambda: ObservationConfig(kind="pixels"), "observation.kind"),
        (lambda: ObservationConfig(channels=()), "observation.channels"),
        (lambda: ObservationConfig(channels="own_share"), "observation.channels"),
        (lambda: ObservationConfig(channels=("own_share", "own_share")), "different ones of own_positions"),
        (lambda: MemoryConfig(trail=0.05), "memory.trail"),
        (lambda: MemoryConfig(controller=0.0), "memory.controller"),
        (lambda: ControllerConfig(modes=17), "controller.modes"),
        (lambda: ControllerConfig(horizon=1), "controller.horizon"),
        (lambda: ControllerConfig(control_weight=-1.0), "controller.control_weight"),
        (lambda: SpawnConfig(radius=0.2), "spawn.radius"),
        (lambda: RewardConfig(outcome=float("inf")), "reward.outcome"),
        (lambda: GameConfig.from_dict([]), "mapping"),
    ],
)
def test_values_out_of_range_name_field_value_and_range(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


def test_one_team_may_be_empty_only_without_captures():
    assert GameConfig(drones_per_team=(3, 0), capture=CaptureConfig(enabled=False)).team_sizes == (3, 0)
    with pytest.raises(ConfigError, match="drones_per_team"):
        GameConfig(drones_per_team=(3, 0))


@pytest.mark.parametrize(
    "config",
    [
        GameConfig(),
        GameConfig(drones_per_team=(1, 19), capture=CaptureConfig(threshold=0.6)),
        GameConfig(observation=(ObservationConfig(grid=10), ObservationConfig(kind="entities"))),
        GameConfig(observation=ObservationConfig(channels=("time_left", "own_positions"))),
    ],
)
def test_dict_json_and_pickle_round_trips(config):
    assert GameConfig.from_dict(json.loads(json.dumps(config.to_dict()))) == config
    assert pickle.loads(pickle.dumps(config)) == config  # noqa: S301


def test_hash_differs_between_rules_and_not_between_processes():
    config = GameConfig(time_limit=60)
    assert config.hash == GameConfig(time_limit=60.0).hash != GameConfig().hash
    code = "from swarm_pz import GameConfig; print(GameConfig(time_limit=60).hash)"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert printed.stdout.strip() == config.hash


def test_replace_checks_what_it_is_given():
    assert GameConfig().replace(drones_per_team=3).team_sizes == (3, 3)
    with pytest.raises(ConfigError, match="no field"):
        GameConfig().replace(drones=3)


OPTIONS = [
    GameConfig.preset("released"),
    GameConfig(controllers="flocking"),
    GameConfig(controllers=("ergodic", "flocking"), flocking=FlockingConfig(migration=(1, 2))),
    GameConfig(memory=MemoryConfig(trail=None, controller=None, trail_forgotten_on=("command",))),
    GameConfig(controller=ControllerConfig(spectrum="exponential", communication_radius=0.2, message_loss=0.1)),
    GameConfig(dynamics=DynamicsConfig(speed_factor=0.5, failure_rate=0.1, repair_rate=0.2)),
    GameConfig(spawn=SpawnConfig(layout="squares", side=0.3), drones_per_team=(1, 19)),
]


@pytest.mark.parametrize("config", OPTIONS)
def test_options_come_back_from_json(config):
    again = GameConfig.from_dict(json.loads(json.dumps(config.to_dict())))
    assert again == config and again.hash == config.hash


def test_options_at_rest_leave_the_hash_alone():
    assert GameConfig().hash == "6c87a3d2c1f6ff12"  # of files that were written before there were options
    assert len({config.hash for config in [GameConfig(), *OPTIONS]}) == 1 + len(OPTIONS)


def test_what_is_compiled_for_endless_trails_does_not_depend_on_sizes():
    released = GameConfig.preset("released")
    rooms = [released.replace(drones_per_team=size, time_limit=limit) for size, limit in ((1, 60.0), (20, 1e6))]
    assert {rule_parameters(room).ring_weights.dtype for room in rooms} == {np.dtype(np.int64)}
