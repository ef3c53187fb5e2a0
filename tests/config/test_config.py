"""Rules of several fields, spellings of values, plain values, and hashes."""

from __future__ import annotations

import json
import pickle

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
from swarm_pz.config.base import digest
from swarm_pz.errors import ConfigError
from swarm_pz.systems.formation import Formation
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

OPTIONS = [
    GameConfig.preset("released"),
    GameConfig(controllers=("ergodic", "flocking"), flocking=FlockingConfig(migration=(1, 2))),
    GameConfig(memory=MemoryConfig(trail=None, controller=None, trail_forgotten_on=("command",))),
    GameConfig(controller=ControllerConfig(spectrum="exponential", communication_radius=0.2)),
    GameConfig(dynamics=DynamicsConfig(speed_factor=0.5, failure_rate=0.1, repair_rate=0.2)),
    GameConfig(spawn=SpawnConfig(layout="squares", side=0.3), drones_per_team=(1, 19)),
    GameConfig(time_limit=60),
    GameConfig(capture=CaptureConfig(threshold=0.7)),
]
"""Each has rules of its own."""
SEAT = ObservationConfig(grid=10)


PEACE = CaptureConfig(enabled=False)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: SpawnConfig(inset=0.05, radius=0.06), "spawn.radius must be at most spawn.inset, 0.05, got 0.06"),
        (lambda: SpawnConfig(outset=1.0), "no field 'outset'; did you mean 'inset'"),
        (lambda: MemoryConfig(trail=1.01), "memory.trail .*ticks"),
        (lambda: FlockingConfig(migration=(3.0, 2.0)), "flocking.migration"),
        (lambda: DynamicsConfig(min_speed=0.1, failure_rate=0.1), "dynamics.failure_rate"),
        (lambda: ObservationConfig(grid=20), "observation.grid .*divisor of 50, got 20"),
        (lambda: ObservationConfig(channels=("own_share", "weather")), "observation.channels"),
        (lambda: GameConfig(time_limit=0.25), "time_limit .*control periods"),
        (lambda: GameConfig(controllers="herding"), "no control system 'herding'; did you mean"),
        (lambda: GameConfig(drones_per_team=(3, 0)), "drones_per_team"),
        (lambda: GameConfig(drones_per_team=0, capture=PEACE), "drones_per_team"),
        (lambda: GameConfig.preset("papr"), "did you mean 'paper'"),
        (lambda: GameConfig.from_dict({"capture": {"treshold": 0.5}}), "did you mean 'threshold'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, name):
    with pytest.raises(ConfigError, match=name):
        make()


def test_the_ends_of_ranges_that_depend_on_other_fields_are_taken():
    assert SpawnConfig(inset=0.5, radius=0.5, side=0.5).radius == 0.5
    assert SpawnConfig(layout="squares", inset=0.4, radius=0.3, side=0.6).side == 0.6
    assert GameConfig(drones_per_team=(3, 0), capture=PEACE).team_sizes == (3, 0)


@pytest.mark.parametrize(
    "config",
    [*OPTIONS, GameConfig(), GameConfig(observation=(SEAT, ObservationConfig(kind="entities")))],
)
def test_plain_values_and_pickles_come_back(config):
    again = GameConfig.from_dict(json.loads(json.dumps(config.to_dict())))
    assert again == config == pickle.loads(pickle.dumps(config))  # noqa: S301
    assert again.hash == config.hash


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (GameConfig(), GameConfig.preset("paper")),
        (GameConfig(), GameConfig(drones_per_team=(10, 10), controllers=("ergodic", "ergodic"))),
        (GameConfig(controllers="flocking"), GameConfig(controllers=["flocking", np.str_("flocking")])),
        (GameConfig(observation=SEAT), GameConfig(observation=(SEAT, SEAT))),
        (RewardConfig(outcome=0), RewardConfig(outcome=-0.0)),
        (ObservationConfig(channels=("time_left",)), ObservationConfig(grid=np.int8(50), channels=["time_left"])),
        (MemoryConfig(trail_forgotten_on=("capture", "command")),
         MemoryConfig(trail_forgotten_on=["command", "capture", "command"])),
        (LeagueConfig(), LeagueConfig(learner=RECIPES["long"].replace(game=GameConfig(observation=(SEAT, SEAT))))),
        (Formation(stiffness=9.0), Formation().replace(stiffness=9.0)),
    ],
)  # fmt: skip
def test_what_means_the_same_is_the_same(one, other):
    assert one == other and hash(one) == hash(other) and one.hash == other.hash
    assert json.loads(json.dumps(one.to_dict())) == json.loads(json.dumps(other.to_dict()))


def test_the_rules_are_all_but_what_a_seat_sees_and_is_rewarded_for():
    learners = GameConfig(observation=SEAT, reward=RewardConfig(outcome=3.0))
    assert learners.hash != GameConfig().hash
    assert learners.rules_hash == GameConfig().rules_hash == TrainConfig().game.rules_hash
    assert set(learners.to_dict()) - set(learners.rules) == {"observation", "reward"}
    assert GameConfig.from_dict(json.loads(json.dumps(learners.rules))) == GameConfig()
    for hashes in ({config.hash for config in OPTIONS}, {config.rules_hash for config in OPTIONS}):
        assert len(hashes | {GameConfig().hash, GameConfig().rules_hash}) == len(OPTIONS) + 2


def test_defaults_and_hashes_are_those_that_shipped_files_name():
    presets = [GameConfig.preset(name) for name in ("paper", "fixed_wing", "released")]
    assert presets[0] == GameConfig()
    assert [config.hash for config in presets] == ["6c87a3d2c1f6ff12", "692c22f28dd5a2ca", "1f461901b95918b8"]
    assert [config.rules_hash for config in presets] == ["bd58485b8294f145", "a2ae7bf79b10958f", "cdcb2ff7d9808fae"]
    assert digest(GameConfig().to_dict()) == "71970c921238f3ef"  # includes fields that hashes leave out


def test_of_options_that_are_gone_stored_rules_may_name_those_that_were_off():
    stored = GameConfig().to_dict()
    stored["controller"] |= {"message_loss": 0.0, "relay": False}
    assert GameConfig.from_dict(stored) == GameConfig()
    with pytest.raises(ConfigError, match="no field 'message_loss'"):
        GameConfig.from_dict(stored | {"controller": {"message_loss": 0.1}})


@pytest.mark.parametrize("name", ["trail", "time_limit", "command_period"])
def test_times_count_as_the_nearest_ticks_not_as_those_that_are_over(name):
    hashes = set()
    for count in range(2, 130, 8):
        seconds = count / 30 if name == "trail" else count / 10
        around = [float(np.nextafter(seconds, to)) for to in (0.0, seconds, np.inf)]
        configs = [GameConfig(**({"memory": MemoryConfig(trail=x)} if name == "trail" else {name: x})) for x in around]
        alike = {config.rules_hash for config in configs}
        assert len(alike) == 1, seconds
        hashes |= alike
    assert len(hashes) == 16


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


def test_only_some_rules_tell_a_command_that_is_sent_again_from_one_that_is_held():
    assert GameConfig.preset("released").tells_sending
    assert GameConfig(controller=ControllerConfig(target_mass=2.0)).tells_sending
    for name in ("trail_forgotten_on", "controller_forgotten_on"):
        assert GameConfig(memory=MemoryConfig(**{name: ("sending",)})).tells_sending
        assert not GameConfig(memory=MemoryConfig(**{name: ("capture", "command")})).tells_sending
