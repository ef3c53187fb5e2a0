"""The examples run as they are, and what sets them up names files that are there."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def test_the_notebook_runs_as_it_is_without_a_warning(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONWARNINGS", "ignore")  # what the notebook's own machinery says is not ours
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    notebook = nbformat.read(EXAMPLES / "first_steps.ipynb", as_version=4)
    nbformat.validate(notebook)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert cells and all(not cell.outputs and cell.execution_count is None for cell in cells)
    loud = nbformat.v4.new_code_cell("import warnings; warnings.simplefilter('error')")
    notebook.cells.insert(0, loud)
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    printed = [output for cell in cells for output in cell.outputs]
    assert not [output for output in printed if output.output_type in ("error", "stream")]


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


def test_behaviour_cloning_makes_a_policy_that_training_starts_from(tmp_path):
    rules = ["--game.time-limit", "4", "--game.drones-per-team", "3", "--game.observation.grid", "10"]
    cli = "from swarm_pz.cli import main; main()"
    words = ["dataset", "ring", "uniform", "--games", "4", "--out", "data", "--action-cells", "5", *rules]
    few = ["--epochs", "2", "--games", "2"]
    script = str(EXAMPLES / "behaviour_cloning.py")
    train = ["train", "--start-from", "runs/cloned", "--total-steps", "32", "--num-envs", "4", "--rollout", "8"]
    train += ["--evaluation-games", "2", "--games", "2", "--out", "runs/after", *rules[:4]]
    for call in (["-c", cli, *words], [script, "data/swarm-ring-v0/data", *few], ["-c", cli, *train]):
        env = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
        whole = [sys.executable, *call]
        done = subprocess.run(whole, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)  # noqa: S603
        assert done.returncode == 0, done.stderr
    figures = json.loads((tmp_path / "runs/cloned/figures.json").read_text())
    assert len(figures["losses"]) == 2
    assert all(set(figures[stage]) == {"uniform", "noise"} for stage in ("untrained", "cloned"))
    assert (tmp_path / "runs/cloned/cloning.png").stat().st_size > 0
    assert (tmp_path / "runs/after/policy.json").is_file()
