from __future__ import annotations

import importlib.metadata
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import GameConfig, ObservationConfig, policies
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policy import GROUP, about, load, load_players, name_of

SHIPPED = Path(policies.__file__).parent / "zoo" / "hunter"


def test_a_folder_that_training_wrote_is_an_opponent_and_names_come_before_folders(tmp_path):
    folder = tmp_path / "runs" / "first"
    LearnedPolicy.read(SHIPPED, GameConfig()).write(folder)
    for opponent in (folder, str(folder), "runs/first"):
        assert isinstance(load(opponent, GameConfig()), LearnedPolicy) and name_of(opponent) == str(opponent)
    assert DuelEnv(opponent="runs/first").opponent_names == ["runs/first"]
    (tmp_path / "ring").mkdir()
    assert load("ring", GameConfig()).name == "ring"


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("rign", PolicyError, "did you mean 'ring'"),
        ("runs/frist", PolicyError, "no folder 'runs/frist', nor a policy of that name; there are besiege"),
        ("empty", CheckpointError, r"expected policy\.json or policy\.onnx in it"),
        ("stopped", CheckpointError, "this one stopped before: run its command again"),
        ("league", CheckpointError, "this one stopped before: run its command again"),
    ],
)
def test_what_is_neither_name_nor_folder_is_said(name, error, message):
    for folder in ("empty", "stopped", "league"):
        Path(folder).mkdir()
    for file in ("file.json", "tactics.py", "stopped/checkpoint.safetensors", "league/league.json"):
        Path(file).touch()
    with pytest.raises(error, match=message):
        load(name, GameConfig())


class Told:
    """A policy that keeps what its factory was given."""

    observation = ObservationConfig(grid=10)

    def __init__(self, *arguments):
        self.arguments = arguments

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return np.ones((len(rows), 10, 10))


@pytest.fixture
def guest(monkeypatch):
    """An installed package with a policy."""
    module = types.SimpleNamespace(told=Told)
    monkeypatch.setitem(sys.modules, "guest_tactics", module)
    installed = importlib.metadata.entry_points
    point = importlib.metadata.EntryPoint("told", "guest_tactics:told", GROUP)

    def entry_points(**wanted):
        points = installed(**wanted)
        return (*points, point) if wanted.get("group") == GROUP else points

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    return module


def test_a_factory_is_given_the_game_and_all_that_stands_after_the_first_colon(guest):
    config = GameConfig(drones_per_team=3)
    for name, arguments in {"told": (), "told:planner:ring": ("planner:ring",), "told:": ("",)}.items():
        assert load(name, config).arguments == (config, *arguments)
        assert about(name) == "A policy that keeps what its factory was given."
    assert about("nobody") == about("nobody:told") == ""
    guest.told = lambda config: 42
    with pytest.raises(PolicyError, match="policy 'told' must have reset"):
        load("told", config)


def test_two_players_are_loaded_in_their_order_and_share_nothing(guest):
    config = GameConfig()
    first, second = load_players("told:first", "told:second", config)
    assert (first.arguments[1], second.arguments[1]) == ("first", "second")
    one = Told([])
    for players, same in (((one, one), True), ((one, Told([])), False)):
        mine, other = load_players(*players, config)
        assert mine is one and other is not one and (other is players[1]) != same
        assert other.arguments == ([],) and other.arguments[0] is not one.arguments[0]
