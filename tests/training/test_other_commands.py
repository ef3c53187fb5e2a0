"""Training where commands are no densities: the same recipe, another network."""

from __future__ import annotations

import json

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import KindError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policy import load
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.ppo import Training

RULES = GameConfig(drones_per_team=2, time_limit=3.0, controllers=("direct", "ergodic"))
CONFIG = TrainConfig(
    game=RULES,
    opponents=("uniform",),
    total_steps=32,
    num_envs=2,
    rollout=8,
    batch_size=8,
    evaluation_games=2,
    width=8,
    threads=1,
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("other") / "run"
    Training(CONFIG, folder, say=lambda _: None).run()
    return folder


def test_the_learner_sees_drones_whatever_was_asked_for():
    assert CONFIG.game.observation == ObservationConfig(kind="drones")
    assert TrainConfig.from_dict(CONFIG.to_dict()) == CONFIG


def test_what_was_trained_is_a_folder_that_plays_its_kind_of_commands(trained):
    card = json.loads((trained / "policy.json").read_text())
    assert (card["answers"], card["shape"], card["head"]) == ("accelerations", [4, 2], "drones")
    policy = load(trained, RULES)
    assert policy.answers == "accelerations"
    assert len(play_match(policy, "uniform", games=2, config=RULES).games) == 2


def test_it_is_refused_for_other_systems_and_for_other_shapes(trained):
    with pytest.raises(KindError, match=r"answers commands of kind 'accelerations', but the control system ergodic"):
        load(trained, RULES.replace(controllers="ergodic"))
    with pytest.raises(KindError, match=r"actions of shape \(4, 2\), but direct takes those of shape \(6, 2\)"):
        load(trained, RULES.replace(drones_per_team=3))


def test_its_answers_do_not_depend_on_the_batch(trained):
    policy = load(trained, RULES)
    seen = np.random.default_rng(0).random((40, 4, 5)).astype(np.float32)
    rows = np.arange(40)
    alone = np.concatenate([policy.act(seen[row : row + 1], rows[row : row + 1]) for row in rows])
    np.testing.assert_array_equal(policy.act(seen, rows), alone)


def test_a_run_can_be_taken_up(trained, tmp_path):
    half = CONFIG.replace(total_steps=16)
    Training(half, tmp_path / "run", say=lambda _: None).run()
    resumed = Training(CONFIG, tmp_path / "run", resume=True, say=lambda _: None).run()
    assert resumed.answers == "accelerations" and resumed.card["steps"] == 32
