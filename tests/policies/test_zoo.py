from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binomtest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, KindError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import zoo
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policy import about, load
from swarm_pz.training.config import TrainConfig

FOLDER = Path(zoo.__file__).parent
NAMES = sorted(path.parent.name for path in FOLDER.glob("*/policy.json"))


@pytest.fixture
def copy(tmp_path):
    return Path(shutil.copytree(FOLDER / NAMES[0], tmp_path / "copy"))


@pytest.mark.parametrize("name", NAMES)
def test_every_tactic_has_a_name_and_a_card_and_wins_what_that_says(name):
    policy = policies.load(name)
    assert isinstance(policy, LearnedPolicy)
    assert {path.name for path in (FOLDER / name).iterdir()} == {"policy.json", "policy.safetensors"}
    card = json.loads((FOLDER / name / "policy.json").read_text())
    assert card["about"].endswith(".")
    assert about(name) == card["about"].splitlines()[0]
    assert card["command"].startswith("swarm-pz ")
    assert card["steps"] > 0
    assert card["seconds"] > 0
    assert card["results"]["against"]["uniform"]["games"] >= 100
    assert GameConfig.from_dict(card["training"]["game"]).hash == card["config_hash"]
    TrainConfig.from_dict(card["training"])
    lowest = card["results"]["against"]["uniform"]["win_rate_ci95"][0]
    won = play_match(name, "uniform", games=20, seed=11).count("win")
    # Another processor plays other games: fewer wins than the card says are no fault until they are beyond chance.
    assert binomtest(won, 20, lowest, alternative="less").pvalue > 1e-4


@pytest.mark.parametrize("name", NAMES)
def test_a_tactic_plays_at_any_size_whether_it_is_named_or_its_folder_is(name):
    config = GameConfig(drones_per_team=(1, 19), time_limit=5.0, command_cells=6)
    for found in (name, str(FOLDER / name)):
        assert play_match(found, "ring", games=2, config=config).summary()["games"] == 2


@pytest.mark.parametrize("name", NAMES)
def test_answers_do_not_depend_on_the_batch_bit_for_bit(name):
    policy, generator = policies.load(name), np.random.default_rng(0)
    grid = policy.observation.grid
    seen = generator.integers(0, 256, (70, len(policy.observation.channels), grid, grid)).astype(np.uint8)
    rows = np.arange(70)
    for noise in (0.0, 0.3):
        policy.noise = noise
        policy.reset(rows.tolist(), rows)
        answers = policy.act(seen, rows)
        policy.reset(rows.tolist(), rows)
        for row in (0, 1, 17, 31, 32, 63, 64, 69):
            np.testing.assert_array_equal(policy.act(seen[row : row + 1], rows[row : row + 1])[0], answers[row])


def test_an_unknown_tactic_is_no_attribute():
    with pytest.raises(AttributeError, match="no tactic 'nobody'"):
        zoo.nobody  # noqa: B018


def test_a_truncated_file_is_refused(copy):
    weights = copy / "policy.safetensors"
    weights.write_bytes(weights.read_bytes()[:-100])
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        LearnedPolicy.read(copy, GameConfig())


def test_a_changed_weight_is_refused(copy):
    weights = copy / "policy.safetensors"
    content = bytearray(weights.read_bytes())
    content[-3] ^= 1
    weights.write_bytes(content)
    with pytest.raises(CheckpointError, match="was changed after it was written"):
        LearnedPolicy.read(copy, GameConfig())


@pytest.mark.parametrize(
    "change", [{"about": "Best of all."}, {"command": "swarm-pz train"}, {"results": {}}, {"digest": "0"}]
)
def test_a_changed_card_is_refused(copy, change):
    card = json.loads((copy / "policy.json").read_text())
    (copy / "policy.json").write_text(json.dumps(card | change))
    with pytest.raises(CheckpointError, match="was changed after it was written"):
        LearnedPolicy.read(copy, GameConfig())


def test_a_card_whose_rules_do_not_have_its_hash_is_refused(copy):
    policy = LearnedPolicy.read(copy, GameConfig())
    other = {key: value for key, value in policy.card.items() if key != "digest"} | {"config_hash": "0" * 16}
    LearnedPolicy(other, policy.weights(), GameConfig(), "copy").write(copy)
    with pytest.raises(CheckpointError, match="config_hash"):
        LearnedPolicy.read(copy, GameConfig())


def test_a_pickle_in_place_of_weights_runs_no_code(copy, tmp_path):
    import pickle

    class Bomb:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "boom",))

    (copy / "policy.safetensors").write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        LearnedPolicy.read(copy, GameConfig())
    assert not (tmp_path / "boom").exists()


def test_writing_and_reading_change_nothing(copy):
    policy = LearnedPolicy.read(copy, GameConfig())
    policy.write(copy)
    again = LearnedPolicy.read(copy, GameConfig())
    assert again.digest == policy.digest
    for name, values in policy.weights().items():
        np.testing.assert_array_equal(values, again.weights()[name])


def test_trained_is_the_policy_that_was_trained_for_the_system_that_flies_its_team():
    policy = load("trained", GameConfig(controllers=("direct", "ergodic")))
    assert policy.answers == "accelerations" and policy.card["system"] == "direct"
    with pytest.raises(KindError, match=r"no policy was trained for nobody; there are some for: .*direct"):
        zoo.trained(GameConfig()).for_system(SimpleNamespace(name="nobody"))
    with pytest.raises(KindError, match="load it by `load`"):
        zoo.trained(GameConfig()).act(None, None)


@pytest.mark.parametrize("folder", sorted((FOLDER / "systems").glob("*")), ids=lambda one: one.name)
def test_every_policy_that_was_trained_for_a_system_says_how_and_is_small(folder):
    card = json.loads((folder / "policy.json").read_text())
    assert card["command"].startswith(f"swarm-pz train --game.controllers {folder.name} ergodic")
    assert card["seconds"] <= 1200
    assert (folder / "policy.safetensors").stat().st_size < 300_000
    assert card.get("system", "ergodic") == folder.name
