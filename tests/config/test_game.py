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
from swarm_pz.errors import ConfigError, UnknownNameError
from swarm_pz.play.game import TableConfig
from swarm_pz.simulator.parameters import rule_parameters
from swarm_pz.systems.formation import Formation
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig


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
        (lambda: CaptureConfig(threshold=1.0), "in \\[0.001, 0.999\\], got 1.0"),
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
        (lambda: GameConfig(time_limit=10**400), r"time_limit must be .*, got a whole number of 1329 bits"),
        (lambda: GameConfig(drones_per_team=-(10**5000)), "drones_per_team must be .*, got a whole number of"),
        (lambda: RewardConfig(outcome=10**400), "reward.outcome"),
        (lambda: GameConfig(time_limit=True), "time_limit must be a number .*, got True"),
        (lambda: GameConfig(time_limit=np.True_), "time_limit must be a number .*, got True"),
        (lambda: GameConfig(drones_per_team=(1, True)), "drones_per_team must be a whole number .*, got True"),
        (lambda: GameConfig(drones_per_team=10.0), "drones_per_team must be a whole number .*, got 10.0"),
        (lambda: GameConfig(drones_per_team=(10, 10.0)), "drones_per_team must be a whole number .*, got 10.0"),
        (lambda: GameConfig(drones_per_team=np.array([5, 5])), "drones_per_team must be a whole number"),
        (lambda: GameConfig(drones_per_team=(np.array([5, 5]),) * 2), "drones_per_team must be a whole number"),
        (lambda: GameConfig(controllers=("ergodic", "ergodic", "ergodic")), "controllers must be"),
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
    GameConfig(
        controller=ControllerConfig(spectrum="exponential", communication_radius=0.2, message_loss=0.1, relay=True)
    ),
    GameConfig(dynamics=DynamicsConfig(speed_factor=0.5, failure_rate=0.1, repair_rate=0.2)),
    GameConfig(spawn=SpawnConfig(layout="squares", side=0.3), drones_per_team=(1, 19)),
    GameConfig(spawn=SpawnConfig(speed=0.2)),
    GameConfig(controller=ControllerConfig(target_mass=10.0)),
    GameConfig(memory=MemoryConfig(controller_forgotten_on=("capture", "sending"))),
]


@pytest.mark.parametrize("config", OPTIONS)
def test_options_come_back_from_json(config):
    again = GameConfig.from_dict(json.loads(json.dumps(config.to_dict())))
    assert again == config and again.hash == config.hash


SEAT = ObservationConfig(grid=10)
SAME = [
    # One configuration in two spellings.
    (GameConfig(), GameConfig(drones_per_team=(10, 10))),
    (GameConfig(), GameConfig(controllers=("ergodic", "ergodic"))),
    (GameConfig(controllers="flocking"), GameConfig(controllers=["flocking", "flocking"])),
    (GameConfig(observation=SEAT), GameConfig(observation=(SEAT, SEAT))),
    (GameConfig(drones_per_team=(3, 7)), GameConfig(drones_per_team=[3, 7], controllers=("ergodic", "ergodic"))),
    (TableConfig(), TableConfig(game=GameConfig(drones_per_team=(10, 10)))),
    (RECIPES["long"], RECIPES["long"].replace(game=GameConfig(drones_per_team=(10, 10), observation=SEAT))),
    (
        LeagueConfig(),
        LeagueConfig(
            learner=RECIPES["long"].replace(game=GameConfig(drones_per_team=(10, 10), observation=(SEAT, SEAT)))
        ),
    ),
]


@pytest.mark.parametrize(("one", "pair"), SAME)
def test_an_equal_pair_is_the_same_as_one_value(one, pair):
    assert one == pair and hash(one) == hash(pair)
    assert one.hash == pair.hash
    assert one.to_dict() == pair.to_dict()


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ({"time_limit": np.float32(300)}, {"time_limit": 300.0}),
        ({"time_limit": np.int64(60)}, {"time_limit": 60}),
        ({"drones_per_team": np.int64(5)}, {"drones_per_team": 5}),
        ({"drones_per_team": [np.int32(5), 7]}, {"drones_per_team": (5, 7)}),
        ({"capture": CaptureConfig(enabled=np.False_)}, {"capture": CaptureConfig(enabled=False)}),
        ({"controllers": np.str_("flocking")}, {"controllers": "flocking"}),
        ({"reward": RewardConfig(outcome=-0.0)}, {"reward": RewardConfig(outcome=0)}),
        (
            {"flocking": FlockingConfig(migration=[1, np.float64(2)])},
            {"flocking": FlockingConfig(migration=(1.0, 2.0))},
        ),
        (
            {"observation": ObservationConfig(grid=np.int8(10), channels=["time_left"])},
            {"observation": ObservationConfig(grid=10, channels=("time_left",))},
        ),
    ],
)
def test_what_means_the_same_is_the_same(given, kept):
    one, two = GameConfig(**given), GameConfig(**kept)
    assert one == two and hash(one) == hash(two) and one.hash == two.hash
    assert json.loads(json.dumps(one.to_dict())) == json.loads(json.dumps(two.to_dict()))


def test_the_rules_are_all_but_what_a_seat_sees_and_is_rewarded_for():
    learners = GameConfig(observation=SEAT, reward=RewardConfig(outcome=3.0))
    assert learners.hash != GameConfig().hash
    assert learners.rules_hash == GameConfig().rules_hash == TrainConfig().game.rules_hash == "bd58485b8294f145"
    assert set(learners.to_dict()) - set(learners.rules) == {"observation", "reward"}
    assert GameConfig.from_dict(json.loads(json.dumps(learners.rules))) == GameConfig()


def test_every_other_option_is_a_rule():
    rules = [
        *OPTIONS,
        GameConfig(time_limit=60),
        GameConfig(command_period=2.0),
        GameConfig(command_cells=5),
        GameConfig(capture=CaptureConfig(threshold=0.7)),
    ]
    assert len({config.rules_hash for config in [GameConfig(), *rules]}) == 1 + len(rules)


def test_times_that_are_the_same_ticks_are_the_same_rules():
    sum_of_tenths = 0.1 + 0.2
    assert sum_of_tenths != 0.3
    rules = GameConfig(time_limit=sum_of_tenths, command_period=sum_of_tenths, memory=MemoryConfig(trail=sum_of_tenths))
    assert rules.rules_hash == GameConfig(time_limit=0.3, command_period=0.3, memory=MemoryConfig(trail=0.3)).rules_hash


@pytest.mark.parametrize(
    ("ticks", "setting"),
    [
        (1, lambda seconds: GameConfig(memory=MemoryConfig(trail=seconds))),
        (3, lambda seconds: GameConfig(time_limit=seconds)),
        (3, lambda seconds: GameConfig(command_period=seconds)),
    ],
)
def test_times_count_as_the_nearest_ticks_not_as_those_that_are_over(ticks, setting):
    hashes = set()
    for count in range(2, 130):
        seconds = count * ticks / 30
        around = {setting(float(np.nextafter(seconds, to))).rules_hash for to in (0.0, seconds, np.inf)}
        assert len(around) == 1, seconds
        hashes |= around
    assert len(hashes) == 128


def test_options_at_rest_leave_the_hash_alone():
    assert GameConfig().hash == "6c87a3d2c1f6ff12"  # as shipped policies' cards name it
    assert len({config.hash for config in [GameConfig(), *OPTIONS]}) == 1 + len(OPTIONS)


def test_what_is_compiled_for_endless_trails_does_not_depend_on_sizes():
    released = GameConfig.preset("released")
    rooms = [released.replace(drones_per_team=size, time_limit=limit) for size, limit in ((1, 60.0), (20, 1e6))]
    assert {rule_parameters(room).ring_weights.dtype for room in rooms} == {np.dtype(np.int64)}


def test_only_some_rules_tell_a_command_that_is_sent_again_from_one_that_is_held():
    assert GameConfig.preset("released").tells_sending
    assert GameConfig(controller=ControllerConfig(target_mass=2.0)).tells_sending
    for name in ("trail_forgotten_on", "controller_forgotten_on"):
        assert GameConfig(memory=MemoryConfig(**{name: ("sending",)})).tells_sending
        assert not GameConfig(memory=MemoryConfig(**{name: ("capture", "command")})).tells_sending
    assert not GameConfig().tells_sending


def test_a_control_system_can_be_replaced_and_has_no_fields_but_its_numbers():
    faster = Formation().replace(stiffness=9.0)
    assert faster == Formation(stiffness=9.0) and faster.damping == Formation().damping
    with pytest.raises(UnknownNameError, match=r"Formation has no field 'takes'; .*Known: damping, margin, stiffness"):
        Formation(takes="density")
