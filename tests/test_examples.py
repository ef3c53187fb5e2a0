"""The examples run as they are, and what sets them up names files that are there."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import sb3_contrib
import stable_baselines3
import torch

from benchmarks import examples
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.datasets import record_match
from swarm_pz.policy import load
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.ppo import Training

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
ROW = {
    "digest": "", "versions": {"sb3_contrib": "2.9.2"}, "lines": 60, "commands": 4096, "minutes": 2.0,
    "processor_minutes": 2.5, "shares": {"noise": [0.75, 0.7, 0.8], "uniform": [0.52, 0.47, 0.57]},
}  # fmt: skip


def test_the_notebook_runs_as_it_is_without_a_warning(tmp_path, capsys):
    cells = json.loads((EXAMPLES / "first_steps.ipynb").read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code and all(not cell["outputs"] and cell["execution_count"] is None for cell in code)
    names = {"__name__": "__main__"}
    for cell in code:
        exec(compile("".join(cell["source"]), "first_steps.ipynb", "exec"), names)  # noqa: S102  (our own)
    names["plt"].close("all")
    assert capsys.readouterr().err == ""


def test_the_container_copies_and_runs_files_that_are_there_and_is_not_root():
    lines = [line.split() for line in (ROOT / "Dockerfile").read_text().splitlines() if line and line[0] != "#"]
    steps = [(word, rest) for word, *rest in lines]
    assert [rest for word, rest in steps if word == "FROM"] == [["python:3.11-slim"]]
    order = [word for word, _ in steps]
    assert order.index("USER") < order.index("COPY") and dict(steps)["USER"] != ["root"]
    for word, rest in steps:
        if word == "COPY":
            assert all((ROOT / source).exists() for source in rest if not source.startswith("--"))
    called = re.findall(r"scripts/\w+", (ROOT / "Dockerfile").read_text())
    assert {"scripts/setup", "scripts/train", "scripts/test"} <= set(called)
    assert all((ROOT / name).stat().st_mode & 0o100 for name in called)


def test_behaviour_cloning_makes_a_policy_that_training_starts_from(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    game = GameConfig(drones_per_team=3, time_limit=4.0, observation=ObservationConfig(grid=10))
    folder = record_match("ring", ["uniform"], games=4, root=tmp_path, config=game, action_cells=5)
    options = ["--epochs", "2", "--games", "2", "--out", "cloned"]
    monkeypatch.setattr(sys, "argv", ["behaviour_cloning.py", str(folder / "data"), *options])
    runpy.run_path(str(EXAMPLES / "behaviour_cloning.py"), run_name="__main__")
    assert "policy: cloned" in capsys.readouterr().out
    example = runpy.run_path(str(EXAMPLES / "behaviour_cloning.py"))
    episodes = [SimpleNamespace(observations=np.arange(n, n + 4), actions=np.arange(n, n + 3)) for n in (0, 10)]
    seen, done = example["steps_of"](episodes)
    assert seen.tolist() == done.tolist() == [0, 1, 2, 10, 11, 12], "what was done then, not after"
    figures = json.loads(Path("cloned/figures.json").read_text())
    first, last = figures["losses"]
    assert last["trained"] < first["trained"]
    assert all(set(figures[stage]) == {"uniform", "noise"} for stage in ("untrained", "cloned"))
    assert Path("cloned/cloning.png").stat().st_size > 0
    few = {"total_steps": 8, "num_envs": 2, "rollout": 4, "batch_size": 8, "evaluation_games": 2, "threads": 1}
    config = TrainConfig(game=game, opponents=("uniform",), start_from="cloned", **few)
    run = Training(config, tmp_path / "after", say=lambda _: None)
    weights = load("cloned", game).weights()
    assert all((values == weights[key]).all() for key, values in run.policy().weights().items())
    run.run()
    assert Path("after/policy.json").is_file()


def shorter(algorithm, **settings):
    return lambda *given, **named: algorithm(*given, **named | settings)


@pytest.mark.parametrize("name", [name for name, one in examples.EXAMPLES.items() if "compat" in one.environment])
def test_an_example_learns_and_plays_in_its_short_form(name, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(torch, "set_num_threads", lambda count: None)  # other tests have their own
    monkeypatch.setattr(stable_baselines3, "PPO", shorter(stable_baselines3.PPO, n_steps=32))
    monkeypatch.setattr(sb3_contrib, "RecurrentPPO", shorter(sb3_contrib.RecurrentPPO, n_steps=8, n_epochs=1))
    monkeypatch.setattr(sys, "argv", [name, "--steps", "128", "--games", "2", "--out", str(tmp_path)])
    runpy.run_path(str(examples.path_of(name)), run_name="__main__")
    rollout = {"sb3_ppo": 4 * 32, "sb3_contrib_recurrent_ppo": 64 * 8}.get(name, 64 * 64)  # a whole one at least
    assert examples.commands_in(capsys.readouterr().out) == rollout
    for opponent in examples.OPPONENTS:
        figures = json.loads((tmp_path / f"{opponent}.json").read_text())
        low, high = figures["mean_share_ci95"]
        assert figures["opponent"] == opponent
        assert 0.0 <= low <= figures["mean_share"] <= high <= 1.0


def test_every_example_of_a_library_is_run_by_the_script():
    others = {"behaviour_cloning"}
    assert {path.stem for path in EXAMPLES.glob("*.py")} - others == set(examples.EXAMPLES)


def test_the_table_of_the_examples_shows_the_rows_that_are_kept():
    rows = json.loads(examples.ROWS.read_text())
    assert set(rows) <= set(examples.EXAMPLES)
    assert examples.TABLE.read_text() == examples.table(rows)
    shown = examples.table({"sb3_contrib_recurrent_ppo": ROW})
    assert '60,"4,096",2.0 (2.5),"0.75 [0.70, 0.80]","0.52 [0.47, 0.57]",sb3_contrib 2.9.2\n' in shown


def test_a_run_of_the_examples_that_was_stopped_goes_on_with_those_without_a_row(tmp_path, monkeypatch, capsys):
    names, ran, failing = list(examples.EXAMPLES), [], {"cleanrl_ppo"}
    monkeypatch.setattr(examples, "ROOT", tmp_path)
    monkeypatch.setattr(examples, "ROWS", tmp_path / "examples.json")
    monkeypatch.setattr(examples, "TABLE", tmp_path / "examples.csv")
    monkeypatch.setattr(examples, "digest_of", lambda name: name)

    def run(name, options):
        ran.append(name)
        if name in failing:
            raise subprocess.CalledProcessError(1, name)
        return ROW | {"digest": name}

    def asked(*words):
        ran.clear()
        monkeypatch.setattr(sys, "argv", ["examples", *words])
        examples.main()
        return list(ran)

    monkeypatch.setattr(examples, "run", run)
    with pytest.raises(SystemExit, match="no rows came of cleanrl_ppo"):
        asked()
    assert ran == names
    assert list(json.loads(examples.ROWS.read_text())) == [name for name in names if name != "cleanrl_ppo"]
    failing.clear()
    assert (asked(), asked(), asked("sb3_ppo")) == (["cleanrl_ppo"], [], ["sb3_ppo"])
    monkeypatch.setattr(examples, "digest_of", lambda name: name.replace("rllib", "changed"))
    assert asked() == ["rllib_selfplay"]
    with pytest.raises(SystemExit):
        asked("sb3_pop")
    assert "invalid choice: 'sb3_pop'" in capsys.readouterr().err
