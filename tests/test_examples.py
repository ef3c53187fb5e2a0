"""The notebook runs unchanged, and the examples learn and play in a short form."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import pytest
import sb3_contrib
import stable_baselines3
import torch

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"


def test_the_notebook_runs_as_it_is_without_a_warning(tmp_path, capsys):
    cells = json.loads((EXAMPLES / "first_steps.ipynb").read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert code and all(not cell["outputs"] and cell["execution_count"] is None for cell in code)
    names = {"__name__": "__main__"}
    for cell in code:
        exec(compile("".join(cell["source"]), "first_steps.ipynb", "exec"), names)  # noqa: S102  (our own)
    names["plt"].close("all")
    assert capsys.readouterr().err == ""


def shorter(algorithm, **settings):
    return lambda *given, **named: algorithm(*given, **named | settings)


@pytest.mark.parametrize("name", ["sb3_ppo", "sb3_contrib_recurrent_ppo", "cleanrl_ppo"])
def test_an_example_learns_and_plays_in_its_short_form(name, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(torch, "set_num_threads", lambda count: None)  # it would last beyond this test
    monkeypatch.setattr(stable_baselines3, "PPO", shorter(stable_baselines3.PPO, n_steps=32))
    monkeypatch.setattr(sb3_contrib, "RecurrentPPO", shorter(sb3_contrib.RecurrentPPO, n_steps=8, n_epochs=1))
    monkeypatch.setattr(sys, "argv", [name, "--steps", "128", "--games", "2", "--out", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
    rollout = {"sb3_ppo": 4 * 32, "sb3_contrib_recurrent_ppo": 64 * 8}.get(name, 64 * 64)  # at least one whole rollout
    assert f"commands seen: {rollout}\n" in capsys.readouterr().out
    for opponent in ("noise", "uniform"):
        figures = json.loads((tmp_path / f"{opponent}.json").read_text())
        low, high = figures["mean_share_ci95"]
        assert figures["opponent"] == opponent
        assert 0.0 <= low <= figures["mean_share"] <= high <= 1.0
