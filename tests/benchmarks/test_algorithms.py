import os

import numpy as np
import pytest
import torch
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
from stable_baselines3 import DQN

from benchmarks.algorithms import __main__ as command
from benchmarks.algorithms import methods, page, runs
from benchmarks.algorithms.methods import METHODS, RECIPE
from benchmarks.algorithms.runs import SCRIPTS, UPDATE, Budget, Run
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.policies import load
from swarm_pz.systems.ergodic import Ergodic
from swarm_pz.training.vec_env import SwarmVecEnv

FINAL = {"games": 200, "wins": 120, "draws": 20, "losses": 60, "ms": 0.5}


@pytest.fixture
def small(monkeypatch):
    """Make an update of PPO 32 commands."""
    config = RECIPE.replace(num_envs=4, rollout=8, batch_size=16, epochs=1)
    for module in (runs, methods):
        monkeypatch.setattr(module, "RECIPE", config)
    monkeypatch.setattr(runs, "UPDATE", 32)


@pytest.fixture
def played(monkeypatch):
    """Take evaluations for played."""
    found = {name: FINAL | {"score": 0.65} for name in ("uniform", *SCRIPTS)}
    monkeypatch.setattr(runs, "evaluate", lambda player, games: found)


def line(method, seed, score):
    scores = dict.fromkeys(("uniform", *SCRIPTS), score)
    return {
        "method": method, "seed": seed, "seconds": 200.0, "processor_seconds": 100.0,
        "weights": 1234, "processor": "any", "versions": {"torch": "2"},
        "curve": [{"commands": stop, "scores": scores} for stop in Budget().stops()],
        "final": {name: FINAL | {"score": score} for name in scores},
    }  # fmt: skip


def learned(stage):
    return [values for values in stage.model.policy.parameters() if values.requires_grad]


@pytest.mark.parametrize("method", [name for name, one in METHODS.items() if not one.meets_itself])  # as the next test
def test_a_method_learns_and_what_it_learned_is_a_player(method, small, played, tmp_path, monkeypatch):
    if method in ("recurrent-ppo", "ppo-mlp"):  # an example, and tests of exporting, export such networks
        monkeypatch.setattr(runs, "export_model", lambda *given: load("champion", GameConfig()).write(given[3]))
    run = Run(method, 0, Budget(commands=64, points=2, games=50), tmp_path)
    stages, before = [], []

    class Watched(runs.Stage):
        def learn(self):
            if isinstance(self.model, DQN):
                self.model.learning_starts = 16
            stages.append(self)
            before.append([values.detach().clone() for values in learned(self)])
            return super().learn()

    monkeypatch.setattr(runs, "Stage", Watched)
    found = run.learn()
    first, second = stages
    after = learned(first)
    assert any(not torch.equal(a, b) for a, b in zip(before[0], after, strict=True))
    assert all(torch.equal(a, b) for a, b in zip(before[1], after, strict=True))
    assert [point["commands"] for point in found["curve"]] == [32, 64] and second.model.num_timesteps == 64
    if method == "dqn":
        assert second.model.replay_buffer.pos == 16 and np.array_equal(
            *(stage.model.replay_buffer.observations[:8] for stage in stages)
        )
    assert found["method"] == method and found["weights"] > 1000
    assert load(str(tmp_path / f"{method}-0"), GameConfig(), Ergodic()).answers == "density"
    assert [path.name for path in run.work.iterdir()] == [runs.LINE]


def test_a_run_that_was_killed_ends_as_one_that_was_not_and_selfplay_meets_its_own_past(small, monkeypatch, tmp_path):
    met = []
    deal = SwarmVecEnv.deal
    monkeypatch.setattr(SwarmVecEnv, "deal", lambda self, given, names: met.append(names) or deal(self, given, names))
    ended = []
    for out, killed_at in ((tmp_path / "whole", None), (tmp_path / "killed", 2)):
        looked = []

        def look(player, games, looked=looked, killed_at=killed_at):
            looked.append(player)
            if len(looked) == killed_at:
                raise KeyboardInterrupt
            return {name: FINAL | {"score": 0.65} for name in ("uniform", *SCRIPTS)}

        monkeypatch.setattr(runs, "evaluate", look)
        task = ("ppo-selfplay", 5, Budget(commands=96, points=3, games=50), out)
        if killed_at:
            with pytest.raises(KeyboardInterrupt):
                runs.run(*task)
        ended.append(runs.run(*task))
        assert len(looked) == (5 if killed_at else 4)
    assert met[:3] == [["self-0"], ["self-0", "self-1"], ["self-0", "self-1", "self-2"]]
    assert ended[0]["curve"] == ended[1]["curve"]
    whole, killed = (
        load(str(tmp_path / name / "ppo-selfplay-5"), GameConfig()).weights() for name in ("whole", "killed")
    )
    assert all(torch.equal(values, killed[name]) for name, values in whole.items())
    monkeypatch.setattr(runs, "evaluate", None)
    assert runs.run(*task) == ended[1]


def test_sequences_at_once_are_those_step_by_step(small):
    model = METHODS["recurrent-ppo"].learner(METHODS["recurrent-ppo"].games(0), 0)
    lstm, generator = model.policy.lstm_actor, torch.Generator().manual_seed(0)
    features = torch.rand(3 * 5, lstm.input_size, generator=generator)
    states = tuple(torch.rand(1, 3, lstm.hidden_size, generator=generator) for _ in range(2))
    starts = torch.zeros(3, 5)
    starts[1, 0] = 1.0
    found, expected = (
        policy._process_sequence(features, states, starts.flatten(), lstm)
        for policy in (model.policy, RecurrentActorCriticPolicy)
    )
    torch.testing.assert_close(found, expected)


def test_an_evaluation_plays_uniform_and_the_scripts(monkeypatch, tmp_path):
    monkeypatch.setattr(runs, "GameConfig", lambda: GameConfig(time_limit=2.0, drones_per_team=3))
    found = runs.evaluate("noise", 20)
    assert {name: one["games"] for name, one in found.items()} == {"uniform": 20} | dict.fromkeys(SCRIPTS, 4)
    assert all(0.0 <= one["score"] <= 1.0 for one in found.values())


def test_a_budget_that_cannot_be_is_refused():
    with pytest.raises(ConfigError, match=f"commands must be a multiple of {UPDATE}"):
        Budget(commands=UPDATE + 32)
    with pytest.raises(ConfigError, match="games must be a multiple of 50"):
        Budget(games=110)
    assert Budget(commands=2 * UPDATE, points=2).stops() == [UPDATE, 2 * UPDATE]


def test_runs_of_other_settings_are_not_taken_for_these(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "run", lambda method, seed, *_: line(method, seed, 0.5))
    lines = command.compare(tmp_path, Budget(), 2, 1)
    assert [(one["method"], one["seed"]) for one in lines] == [(name, seed) for name in METHODS for seed in (0, 1)]
    with pytest.raises(ResultsError, match=r"do not compare.*or another --out"):
        command.compare(tmp_path, Budget(commands=2 * UPDATE, points=2), 1, 1)


def test_the_page_says_what_the_runs_say(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.standard.aggregate.RESAMPLES", 250)  # no case here is near its bound
    planted = {"ppo": (0.9, 0.92, 0.94), "dqn": (0.5, 0.91, 0.93), "ppo-mlp": (0.1, 0.2, 0.3)}
    lines = [line(method, seed, score) for method, scores in planted.items() for seed, score in enumerate(scores)]
    path = page.write_page(lines, Budget(), tmp_path)
    text = path.read_text()
    assert (tmp_path / page.PICTURE).stat().st_size > 10_000
    _, first, *_ = (tmp_path / page.TABLE).read_text().splitlines()
    assert first.startswith("ppo,0.92 (") and first.endswith(f",200,100,{Budget().commands // 100},1234,0.50")
    assert "`ppo` wins most games" in text and "but the interval of `dqn` overlaps its own" in text
    assert "| `ppo` | " in text and page.TABLE in text
    sure = [line(method, seed, score) for method, score in (("ppo", 0.9), ("dqn", 0.4)) for seed in range(3)]
    assert page.verdict(page.rows_of(sure)).endswith("and no other interval overlaps its own.")
    assert "Few commands" not in text and os.fspath(tmp_path) not in text


def test_an_estimate_is_the_middle_half_over_seeds_and_opponents(monkeypatch):
    monkeypatch.setattr("swarm_pz.standard.aggregate.RESAMPLES", 250)
    scores = np.arange(12.0).reshape(2, 6)
    estimate = page.Estimate.of(scores)
    assert estimate.value == np.arange(3.0, 9.0).mean()
    assert estimate.low < estimate.value < estimate.high
