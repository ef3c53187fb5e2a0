from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binomtest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import KindError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import zoo
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policy import about, load
from swarm_pz.training.config import TrainConfig

FOLDER = Path(zoo.__file__).parent
AS_SHIPPED = {
    "champion": [[0.000, 0.003, 0.004, 0.000], [0.003, 1.000, 1.000, 0.003], [0.008, 1.000, 1.000, 0.004]],
    "finisher": [[0.000, 0.010, 0.006, 0.000], [0.008, 1.000, 1.000, 0.025], [0.020, 1.000, 1.000, 0.032]],
    "hunter": [[0.000, 0.010, 0.016, 0.000], [0.018, 1.000, 1.000, 0.019], [0.020, 0.948, 0.948, 0.044]],
    "marshal": [[0.001, 0.001, 0.001, 0.001], [0.001, 0.047, 0.062, 0.001], [0.001, 0.032, 0.067, 0.001]],
    "scholar": [[0.040, 0.054, 0.141, 0.017], [0.082, 0.220, 0.613, 0.143], [0.159, 0.177, 0.309, 0.105]],
    "selfplay": [[0.001, 0.005, 0.007, 0.001], [0.003, 0.176, 0.394, 0.004], [0.005, 0.117, 0.194, 0.005]],
    "veteran": [[0.001, 0.007, 0.004, 0.001], [0.004, 0.792, 1.000, 0.004], [0.013, 0.465, 0.601, 0.009]],
    "warden": [[0.0, 0.001, 0.001, 0.0], [0.001, 0.465, 0.703, 0.001], [0.002, 0.428, 0.454, 0.001]],
}
"""Every third cell of each tactic's density for one observation."""


@pytest.mark.parametrize("name", AS_SHIPPED)
def test_a_tactic_answers_as_it_did_when_it_was_trained_and_its_card_says_how(name):
    policy = policies.load(name)
    assert isinstance(policy, LearnedPolicy)
    shape = (1, len(policy.observation.channels), policy.observation.grid, policy.observation.grid)
    board = (np.arange(np.prod(shape)) * 37 % 256).reshape(shape).astype(np.uint8)
    np.testing.assert_allclose(policy.act(board, np.zeros(1, int))[0, :9:3, ::3], AS_SHIPPED[name], atol=2e-3)
    card = json.loads((FOLDER / name / "policy.json").read_text())
    assert about(name) == zoo._ABOUT.get(name, card["about"].splitlines()[0]) and about(name).endswith(".")
    assert card["command"].startswith(("swarm-pz ", "python examples/")) and card["steps"] > 0 and card["seconds"] > 0
    TrainConfig.from_dict(card["training"])
    assert card["results"]["against"]["uniform"]["games"] >= 100


def test_a_tactic_wins_what_its_card_says():
    """Else the game or its observations are no longer those that the tactics were trained on."""
    card = json.loads((FOLDER / "champion" / "policy.json").read_text())
    won = play_match("champion", "uniform", games=10, seed=11).count("win")
    # Games differ on another processor: fewer wins than on the card are a fault only if chance cannot explain them.
    rate = card["results"]["against"]["uniform"]["win_rate_ci95"][0]
    assert binomtest(won, 10, rate, alternative="less").pvalue > 1e-4


def test_a_tactic_plays_at_any_size_by_its_folder_and_a_game_depends_on_no_other():
    config = GameConfig(drones_per_team=(1, 19), time_limit=5.0, command_cells=6)
    assert play_match(str(FOLDER / "champion"), "ring", games=2, config=config).summary()["games"] == 2
    policy, rows = policies.load("champion"), np.arange(70)
    images = np.random.default_rng(0).integers(0, 256, (70, 9, 10, 10)).astype(np.uint8)
    policy.noise = 0.3
    policy.reset(rows.tolist(), rows)
    answers = policy.act(images, rows)
    policy.reset(rows.tolist(), rows)
    for row in (0, 1, 31, 32, 63, 64, 69):
        np.testing.assert_array_equal(policy.act(images[row : row + 1], rows[row : row + 1])[0], answers[row])


def test_all_that_is_shipped_is_tested():
    assert sorted(path.parent.name for path in FOLDER.glob("*/policy.json")) == sorted(AS_SHIPPED)
    with pytest.raises(AttributeError, match="no tactic 'nobody'"):
        zoo.nobody  # noqa: B018


def test_trained_is_the_policy_that_was_trained_for_the_system_that_flies_its_team():
    policy = load("trained", GameConfig(controllers=("direct", "ergodic")))
    assert policy.answers == "accelerations" and policy.card["system"] == "direct"
    winged = load("trained", GameConfig.preset("fixed_wing").replace(controllers="flocking"))
    assert winged.card["training"]["game"]["dynamics"]["min_speed"] == 0.3
    with pytest.raises(KindError, match=r"no hovering policy was trained for nobody; there are some for: .*direct"):
        zoo.trained(GameConfig()).for_system(SimpleNamespace(name="nobody"))
    with pytest.raises(KindError, match="load it by `load`"):
        zoo.trained(GameConfig()).act(None, None)
