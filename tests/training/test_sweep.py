"""Several seeds of one run: any pool of workers trains the same policies, and none is trained twice."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from swarm_pz.errors import CheckpointError, ConfigError, Stopped
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.training import sweep as sweeps
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.ppo import Training
from swarm_pz.training.sweep import sweep
from tests.elsewhere import Elsewhere
from tests.training.runs import LEARNER, assert_same_weights, have_same_weights, quiet

RUN = LEARNER.replace(total_steps=64)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return sweep(RUN, (3, 5), tmp_path_factory.mktemp("alone"), SerialExecutor(), say=quiet)


def assert_same(policies, others):
    for one, other in zip(policies, others, strict=True):
        assert TrainConfig.from_dict(one.card["training"]) == TrainConfig.from_dict(other.card["training"])
        assert_same_weights(one, other)


def test_every_seed_is_the_run_that_trains_it_alone(alone, tmp_path):
    run = Training(RUN.replace(seed=5), tmp_path, say=quiet)
    assert_same_weights(run.untrained(), run.policy())
    assert_same([alone[1]], [run.run()])
    assert not have_same_weights(*alone)


def test_whoever_trains_them_they_are_the_same(alone, tmp_path):
    lines, shown = [], []
    with ThreadPoolExecutor(1) as pool:
        show = {"say": lines.append, "show": lambda *steps: shown.append(steps)}
        assert_same(alone, sweep(RUN, (3, 5), tmp_path / "here", pool, **show))
    assert f"{tmp_path}/here/seed-5: trained" in lines
    assert shown[-1] == (128, 128)
    (tmp_path / "there").mkdir()
    pool = Elsewhere(tmp_path / "there")
    assert_same(alone, sweep(RUN, (3, 5), tmp_path / "far", pool, say=quiet))
    assert pool.submitted == ["train_one", "train_one"] and not list((tmp_path / "there").iterdir())


def test_what_was_stopped_goes_on_and_what_is_trained_stays(alone, tmp_path, monkeypatch):
    looks = iter([False, True])
    with pytest.raises(Stopped):
        sweep(RUN, (3, 5), tmp_path, SerialExecutor(), should_stop=lambda: next(looks), say=quiet)
    resumed, train_one = [], sweeps.train_one

    def train(config, *given):
        resumed.append(config.seed)
        return train_one(config, *given)

    monkeypatch.setattr(sweeps, "train_one", train)
    policies = sweep(RUN, (3, 5), tmp_path, SerialExecutor(), say=quiet)
    assert [policy.card["steps"] for policy in policies] == [64, 64]
    assert_same([alone[1]], [policies[1]])
    assert_same(policies, sweep(RUN, (3, 5), tmp_path, SerialExecutor(), say=quiet))
    assert resumed == [3, 5]
    with pytest.raises(CheckpointError, match="seed-3 holds a policy that was trained otherwise"):
        sweep(RUN.replace(gamma=0.5), (3,), tmp_path, SerialExecutor(), say=quiet)


def test_what_other_machines_cannot_have_and_seeds_that_are_the_same_are_refused(tmp_path):
    (tmp_path / "mine").mkdir()
    config = RUN.replace(opponents=("uniform", str(tmp_path / "mine")))
    with pytest.raises(ConfigError, match="must be installed there, got the folder"):
        sweep(config, (0,), tmp_path / "out", Elsewhere(tmp_path))
    for seeds in ((), (1, 1)):
        with pytest.raises(ConfigError, match="seeds must be different"):
            sweep(RUN, seeds, tmp_path / "out", SerialExecutor())
    assert not (tmp_path / "out").exists()
