import json
import os

import numpy as np
import pytest

from benchmarks.algorithms import __main__ as command
from benchmarks.algorithms import methods, page, runs
from benchmarks.algorithms.methods import METHODS, RECIPE
from benchmarks.algorithms.runs import SCRIPTS, UPDATE, Budget, Run
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.policies import load
from swarm_pz.systems.ergodic import Ergodic

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


def line(method, seed, score, digests=None):
    scores = dict.fromkeys(("uniform", *SCRIPTS), score)
    return {
        "method": method, "seed": seed, "commands": 122_880, "seconds": 200.0, "processor_seconds": 100.0,
        "weights": 1234, "processor": "any",
        "curve": [{"commands": stop, "scores": scores} for stop in Budget().stops()],
        "final": {name: FINAL | {"score": score} for name in scores},
        "versions": {"torch": "2"}, "sha256": digests or {"policy.onnx": "ab" * 32},
    }  # fmt: skip


@pytest.mark.parametrize("method", [name for name, one in METHODS.items() if not one.meets_itself])  # as the next test
def test_a_method_learns_and_what_it_learned_is_a_player(method, small, played, tmp_path, monkeypatch):
    if method in ("recurrent-ppo", "ppo-mlp"):  # an example, and tests of exporting, export such networks
        monkeypatch.setattr(runs, "export_model", lambda *given: load("champion", GameConfig()).write(given[3]))
    budget = Budget(commands=64, points=1, games=50)
    run = Run(method, 0, budget, tmp_path / "player")
    if method == "dqn":
        run.model.learning_starts = 32
    before = [values.clone() for values in run.model.policy.parameters()]
    found = run.learn()
    after = list(run.model.policy.parameters())
    assert any(not np.array_equal(a.detach(), b.detach()) for a, b in zip(before, after, strict=True))
    assert [point["commands"] for point in found["curve"]] == budget.stops() == [64]
    assert found["method"] == method and found["weights"] > 1000
    assert found["sha256"] == runs.digests(tmp_path / "player") != {}
    player = load(str(tmp_path / "player"), GameConfig(), Ergodic())
    assert player.answers == "density"


def test_to_look_changes_nothing_and_selfplay_meets_its_own_past_and_nobody_else(small, played, tmp_path):
    weights = []
    for points in (1, 3):
        run = Run("ppo-selfplay", 5, Budget(commands=96, points=points, games=50), tmp_path / str(points))
        before = len(run.env.opponent_names)
        run.learn()
        assert run.env.opponent_names[before:] == ["self-0", "self-1", "self-2"]
        assert all(info["opponent"] >= before for info in run.env.reset_infos)
        weights.append(np.concatenate([values.detach().numpy().ravel() for values in run.model.policy.parameters()]))
    assert np.array_equal(*weights)


def test_an_evaluation_plays_uniform_and_the_scripts(monkeypatch, tmp_path):
    monkeypatch.setattr(runs, "GameConfig", lambda: GameConfig(time_limit=2.0, drones_per_team=3))
    found = runs.evaluate("noise", 20)
    assert {name: one["games"] for name, one in found.items()} == {"uniform": 20} | dict.fromkeys(SCRIPTS, 4)
    assert all(0.0 <= one["score"] <= 1.0 for one in found.values())


def test_a_budget_that_cannot_be_is_refused():
    with pytest.raises(ConfigError, match=f"commands must be a multiple of {UPDATE}"):
        Budget(commands=5000)
    with pytest.raises(ConfigError, match="games must be a multiple of 50"):
        Budget(games=110)
    assert Budget(commands=2 * UPDATE, points=2).stops() == [UPDATE, 2 * UPDATE]


def did(method, seed, budget, folder):
    """Leave what a run leaves."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "policy.json").write_text(f"{method} {seed}")
    return line(method, seed, 0.5, runs.digests(folder))


def test_what_was_killed_begins_anew_and_what_had_ended_is_kept(tmp_path, monkeypatch):
    done = []

    def dies(*task):
        if len(done) == 4:
            raise KeyboardInterrupt
        done.append(task[:2])
        return did(*task)

    monkeypatch.setattr(command, "run", dies)
    with pytest.raises(KeyboardInterrupt):
        command.compare(tmp_path, Budget(), 1, 1)
    (tmp_path / "release" / "ppo-0" / "policy.json").write_text("changed")
    monkeypatch.setattr(command, "run", lambda *task: done.append(task[:2]) or did(*task))
    lines = command.compare(tmp_path, Budget(), 1, 1)
    assert done == [*((name, 0) for name in list(METHODS)[:4]), ("ppo", 0), *((name, 0) for name in list(METHODS)[4:])]
    assert sorted(one["method"] for one in lines) == sorted(METHODS)
    assert [json.loads(one) for one in (tmp_path / command.LINES).read_text().splitlines()] == lines
    sums = (tmp_path / "release" / "SHA256SUMS").read_text().splitlines()
    assert len(sums) == len(METHODS) and all(len(one.split("  ")[0]) == 64 for one in sums)
    command.compare(tmp_path, Budget(), 2, 1)
    assert done[-6:] == [(name, 1) for name in METHODS]
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
    assert first.startswith("ppo,0.92 (") and first.endswith(",60 %,200,100,1229,1234,0.50")
    assert "`ppo` takes the most points" in text and "but the interval of `dqn` overlaps its own" in text
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
