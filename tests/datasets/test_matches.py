"""Games of a match as a Minari dataset: what Minari reads is what the environment gives."""

import minari
import numpy as np
import pytest
from minari.dataset.minari_storage import MinariStorage

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.datasets import record_match
from swarm_pz.errors import ConfigError, OutputError, PolicyError
from swarm_pz.policy import load

SHORT = GameConfig(drones_per_team=4, time_limit=6.0, observation=ObservationConfig(grid=10))


def same(one, other):
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    return np.asarray(one).dtype == np.asarray(other).dtype and bool((np.asarray(one) == np.asarray(other)).all())


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
    player = "chase" if not rules.get("controllers") else "pounce"
    folder = record_match(player, ["uniform"], root=tmp_path, games=3, seed=5, config=config, **options)
    dataset = minari.MinariDataset(folder / "data")
    env = dataset.recover_environment()
    assert env.unwrapped.duel.config == config
    assert dataset.observation_space == env.observation_space and dataset.action_space == env.action_space
    assert dataset.total_episodes == 3
    for episode, about in zip(dataset, dataset.storage.get_episode_metadata(range(3)), strict=True):
        given = [env.reset(seed=about["seed"])]
        given = [(given[0][0], None, None, None, given[0][1])]
        for action in episode.actions:
            assert dataset.action_space.contains(action if action.shape else np.int64(action))
            given.append(env.step(action))
        observations, rewards, terminations, truncations, infos = zip(*given, strict=True)
        for place, seen in enumerate(observations):
            kept = episode.observations
            assert same({k: v[place] for k, v in kept.items()} if isinstance(kept, dict) else kept[place], seen)
        assert episode.rewards.tolist() == list(rewards[1:])
        assert episode.terminations.tolist() == list(terminations[1:])
        assert episode.truncations.tolist() == list(truncations[1:])
        assert {key: values.tolist() for key, values in episode.infos.items()} == {
            key: [info[key] for info in infos] for key in infos[0]
        }
        assert about["side"] == ("red", "blue")[infos[0]["side"]]
    env.close()


def test_opponents_are_dealt_in_turn_whatever_is_played_beside(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.datasets.matches._BATCH", 2)
    few = record_match("noise", ["ring", "uniform"], root=tmp_path / "few", games=5, config=SHORT)
    monkeypatch.setattr("swarm_pz.datasets.matches._BATCH", 16)
    many = record_match("noise", ["ring", "uniform"], root=tmp_path / "many", games=5, config=SHORT, threads=2)
    one, other = (minari.MinariDataset(folder / "data") for folder in (few, many))
    for dataset in (one, other):
        about = list(dataset.storage.get_episode_metadata(range(5)))
        assert [told["opponent"] for told in about] == ["ring", "uniform", "ring", "uniform", "ring"]
        assert [told["seed"] for told in about] == [0, 1, 2, 3, 4]
        assert {told["outcome"] for told in about} <= {"win", "draw", "loss"}
    for left, right in zip(one, other, strict=True):
        assert same(left.observations, right.observations) and same(left.infos, right.infos)


def test_minari_finds_the_dataset_in_its_own_folder_and_knows_where_it_is_from(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    record_match("ring", ["uniform"], name="mine/ring-v3", games=1, config=SHORT, command="swarm-pz dataset")
    dataset = minari.load_dataset("mine/ring-v3")
    assert dataset.total_steps == 6 and list(minari.list_local_datasets()) == ["mine/ring-v3"]
    told = MinariStorage.read_raw_metadata(tmp_path / "mine/ring-v3/data")
    assert told["rules_hash"] == SHORT.rules_hash and told["versions"]["swarm-pz"] and told["seeds"] == [0, 0]
    assert (told["player"], told["opponents"], told["command"]) == ("ring", ["uniform"], "swarm-pz dataset")


def test_games_are_of_the_side_and_the_seeds_that_were_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.datasets.matches._BATCH", 2)
    tmp_path.chmod(0o755)  # as folders are that others may read
    shown = []
    folder = record_match(
        "champion",
        ["uniform", "ring"],
        root=tmp_path,
        games=3,
        seed=5,
        side="blue",
        config=SHORT,
        progress=lambda *done: shown.append(done),
    )
    dataset = minari.MinariDataset(folder / "data")
    told = MinariStorage.read_raw_metadata(folder / "data")
    assert told["seeds"] == [5, 7] and told["side"] == "blue" and shown[-1] == (3, 3)
    assert told["player_digest"] == load("champion", SHORT).digest and not told["privileged"]
    about = list(dataset.storage.get_episode_metadata(range(3)))
    assert [(one["seed"], one["side"]) for one in about] == [(5, "blue"), (6, "blue"), (7, "blue")]
    ends = {"win": 1, "draw": 0, "loss": -1}
    assert [ends[one["outcome"]] for one in about] == [int(episode.infos["outcome"][-1]) for episode in dataset]
    env = dataset.recover_environment()
    assert [env.reset(seed=number)[1]["side"] for number in range(5, 13)] == [1] * 8
    assert folder.stat().st_mode & 0o777 == 0o755


def test_a_player_draws_by_the_games_seed(tmp_path):
    folders = [
        record_match("noise", ["uniform"], root=tmp_path / str(seed), games=1, seed=seed, config=SHORT)
        for seed in (0, 1)
    ]
    (one,), (other,) = (minari.MinariDataset(folder / "data") for folder in folders)
    assert (one.actions[0] != other.actions[0]).any()


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"player": "nobody"}, PolicyError, "there is no policy 'nobody'"),
        ({"opponents": ["nobody"]}, PolicyError, "there is no policy 'nobody'"),
        ({"opponents": []}, ConfigError, "opponents must be at least one policy's name"),
        ({"name": "../ring-v0"}, ConfigError, "name must be letters"),
        ({"name": "ring"}, ConfigError, "end with a version"),
        ({"games": 0}, ConfigError, "games"),
        ({"action_cells": 99}, ConfigError, "action_cells"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(change, error, message, tmp_path):
    given = {"player": "ring", "opponents": ["uniform"], "root": tmp_path, "games": 1, "config": SHORT} | change
    with pytest.raises(error, match=message):
        record_match(given.pop("player"), given.pop("opponents"), **given)
    assert list(tmp_path.iterdir()) == []


def test_a_player_that_fails_leaves_nothing(tmp_path):
    class Failing:
        observation = ObservationConfig(grid=10)
        name = "failing"

        def reset(self, seeds, rows):
            pass

        def act(self, observations, rows):
            raise ArithmeticError("no")

    with pytest.raises(PolicyError, match="policy failing raised ArithmeticError"):
        record_match(Failing(), ["uniform"], root=tmp_path, games=1, config=SHORT)
    assert list(tmp_path.iterdir()) == []


def test_a_dataset_that_is_there_is_not_written_over(tmp_path):
    record_match("ring", ["uniform"], root=tmp_path, games=1, config=SHORT)
    before = (tmp_path / "swarm-ring-v0/data/main_data.hdf5").read_bytes()
    with pytest.raises(OutputError, match="is there already"):
        record_match("ring", ["uniform"], root=tmp_path, games=1, config=SHORT)
    assert (tmp_path / "swarm-ring-v0/data/main_data.hdf5").read_bytes() == before
