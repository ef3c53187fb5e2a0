"""Games of a match as a Minari dataset: what Minari reads is what the environment gives."""

import minari
import numpy as np
import pytest
from minari.dataset.minari_storage import MinariStorage

from swarm_pz.config import CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.datasets import record_match
from swarm_pz.errors import ConfigError, PolicyError
from swarm_pz.policy import load

SHORT = GameConfig(drones_per_team=4, time_limit=6.0, observation=ObservationConfig(grid=10))


def same(one, other):
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return np.asarray(one).dtype == np.asarray(other).dtype and np.array_equal(one, other)


@pytest.mark.parametrize(
    ("options", "rules"),
    [
        ({}, {}),
        ({"action_cells": 5, "flatten_actions": True, "observation_dtype": "float32", "channels_last": True}, {}),
        ({"action": "command"}, {"observation": ObservationConfig(kind="entities")}),
        ({"action": "discrete"}, {"observation": ObservationConfig(grid=50)}),
        ({}, {"controllers": ("flocking", "ergodic"), "observation": ObservationConfig(kind="drones")}),
    ],
)
def test_an_episode_is_what_the_environment_gives_when_its_actions_are_played_again(options, rules, tmp_path):
    config = SHORT.replace(**rules)
    player = "pounce" if "controllers" in rules else "chase"
    folder = record_match(player, ["uniform"], root=tmp_path, games=2, seed=5, config=config, **options)
    dataset = minari.MinariDataset(folder / "data")
    env = dataset.recover_environment()
    assert env.unwrapped.duel.config == config and dataset.total_episodes == 2
    assert dataset.observation_space == env.observation_space and dataset.action_space == env.action_space
    for episode, about in zip(dataset, dataset.storage.get_episode_metadata(range(2)), strict=True):
        first, info = env.reset(seed=about["seed"])
        given = [(first, None, None, None, info)]
        for action in episode.actions:
            assert dataset.action_space.contains(action if action.shape else np.int64(action))
            given.append(env.step(action))
        observations, rewards, terminations, truncations, infos = zip(*given, strict=True)
        kept = episode.observations
        for place, seen in enumerate(observations):
            assert same({k: v[place] for k, v in kept.items()} if isinstance(kept, dict) else kept[place], seen)
        assert (episode.rewards.tolist(), episode.terminations.tolist()) == (list(rewards[1:]), list(terminations[1:]))
        assert episode.truncations.tolist() == list(truncations[1:])
        assert {key: values.tolist() for key, values in episode.infos.items()} == {
            key: [info[key] for info in infos] for key in infos[0]
        }
        assert about["side"] == ("red", "blue")[infos[0]["side"]]
    env.close()


def test_opponents_are_dealt_in_turn_whatever_is_played_beside(tmp_path, monkeypatch):
    made = []
    for size, threads in ((2, 1), (16, 2)):
        monkeypatch.setattr("swarm_pz.datasets.matches._BATCH", size)
        root = tmp_path / str(size)
        folder = record_match("noise", ["ring", "uniform"], root=root, games=5, config=SHORT, threads=threads)
        made.append(minari.MinariDataset(folder / "data"))
        about = list(made[-1].storage.get_episode_metadata(range(5)))
        assert [told["opponent"] for told in about] == ["ring", "uniform", "ring", "uniform", "ring"]
        assert [told["seed"] for told in about] == [0, 1, 2, 3, 4]
    for left, right in zip(*made, strict=True):
        assert same(left.observations, right.observations) and same(left.infos, right.infos)
    assert (made[0][0].actions[0] != made[0][2].actions[0]).any(), "a player draws by the game's seed"


def test_games_are_of_the_side_and_the_seeds_that_were_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.datasets.matches._BATCH", 2)
    tmp_path.chmod(0o755)  # as folders are that others may read
    lost = SHORT.replace(drones_per_team=(19, 1), time_limit=60.0, capture=CaptureConfig(threshold=0.5))
    shown, rules = [], {"games": 3, "seed": 5, "side": "blue", "config": lost}
    opponents = ["uniform", "ring"]
    folder = record_match("champion", opponents, root=tmp_path, progress=lambda *done: shown.append(done), **rules)
    dataset, told = minari.MinariDataset(folder / "data"), MinariStorage.read_raw_metadata(folder / "data")
    assert told["seeds"] == [5, 7] and told["side"] == "blue" and shown[-1] == (3, 3)
    assert told["player_digest"] == load("champion", lost).digest and not told["privileged"]
    about = list(dataset.storage.get_episode_metadata(range(3)))
    assert [(one["seed"], one["side"]) for one in about] == [(5, "blue"), (6, "blue"), (7, "blue")]
    ends = {"win": 1, "draw": 0, "loss": -1}
    assert {one["outcome"] for one in about} != {"draw"}, "who has fewer drones still plays to the end"
    assert [ends[one["outcome"]] for one in about] == [int(episode.infos["outcome"][-1]) for episode in dataset]
    env = dataset.recover_environment()
    assert [env.reset(seed=number)[1]["side"] for number in range(5, 13)] == [1] * 8
    assert folder.stat().st_mode & 0o777 == 0o755


class Failing:
    observation = ObservationConfig(grid=10)
    name = "failing"

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        raise ArithmeticError("no")


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"player": Failing()}, PolicyError, "policy failing raised ArithmeticError"),
        ({"opponents": ["nobody"]}, PolicyError, "there is no policy 'nobody'"),
        ({"opponents": []}, ConfigError, "opponents must be"),
        ({"name": "../ring-v0"}, ConfigError, "name must be letters"),
        ({"action_cells": 99}, ConfigError, "action_cells"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(change, error, message, tmp_path):
    given = {"player": "ring", "opponents": ["uniform"], "root": tmp_path, "games": 1, "config": SHORT} | change
    with pytest.raises(error, match=message):
        record_match(given.pop("player"), given.pop("opponents"), **given)
    assert list(tmp_path.iterdir()) == []
