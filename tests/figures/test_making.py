"""Figures are registered, made by the command, and hold what they promise."""

from __future__ import annotations

import importlib
import json
import pkgutil

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

import swarm_pz
from swarm_pz.cli import evidence, main, report
from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, Stopped
from swarm_pz.figures import FIGURES, Made, claims, make_all, making
from swarm_pz.figures.page import to_dict, to_markdown
from swarm_pz.figures.style import RC

FIELDS = {
    "name", "title", "claim", "paper", "rule", "revised", "statistic", "interval", "supported", "caption",
    "config_hash", "rules", "rules_hash", "versions", "command", "seed", "seeds", "swarm_pz", "series",
}  # fmt: skip
SMALL = {
    "adversary": {"GAMES": 2, "scripts": lambda: ["noise", "ring"]},
    "comebacks": {"GAMES": 2, "PLAYERS": ("ring",)},
    "communication": {"SEEDS": 3, "RADII": (1.5, 0.4, 0.0), "LOSSES": (0.0, 1.0)},
    "compactness": {"GAMES": 2, "PLAYERS": ("centre", "uniform", "ring")},
    "dropout": {"SEEDS": 2},
    "ensemble_tactic": {"GAMES": 4},
    "flocking_comparison": {"SEEDS": 2},
    "permutation_invariance": {"SEEDS": 2},
    "scale_invariance": {"SEEDS": 2},
    "team_sizes": {"GAMES": 3},
}
"""What makes each figure quick."""


def test_every_module_with_a_figure_is_registered():
    modules = [
        importlib.import_module(f"swarm_pz.figures.claims.{found.name}")
        for found in pkgutil.iter_modules(claims.__path__)
    ]
    made = {module.__name__.rpartition(".")[2]: module.FIGURE for module in modules if hasattr(module, "FIGURE")}
    assert made == FIGURES
    assert all(figure.name == name for name, figure in FIGURES.items())


def check_record(record):
    assert set(record) == FIELDS
    assert record["swarm_pz"] == swarm_pz.__version__
    assert isinstance(record["supported"], bool)
    assert all(
        record[name] for name in ("title", "claim", "paper", "rule", "caption", "statistic", "config_hash", "series")
    )
    hashes = {name: GameConfig.from_dict(rules).rules_hash for name, rules in record["rules"].items()}
    assert hashes == record["rules_hash"] and set(hashes) == set(record["config_hash"])
    assert record["versions"]["swarm-pz"] == swarm_pz.__version__
    assert record["caption"].startswith(record["paper"])
    interval = dict(record["interval"])
    assert interval.pop("level") == 0.95
    assert interval.pop("method")
    assert interval and set(interval) <= set(record["statistic"])
    for name, (low, high) in interval.items():
        value = record["statistic"][name]
        for below, above in ((low, value), (value, high)):
            assert above is None or below <= above + 1e-9
    assert all(isinstance(seed, int) for seed in record["seeds"])


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_measures_describes_and_draws_itself(name, monkeypatch):
    module = importlib.import_module(f"swarm_pz.figures.claims.{name}")
    for constant, value in SMALL.get(name, {}).items():
        monkeypatch.setattr(module, constant, value)
    record = to_dict(FIGURES[name], FIGURES[name].measure(0), 0)
    plain = json.loads(json.dumps(record, allow_nan=False))
    check_record(plain)
    with matplotlib.rc_context(RC):
        canvas = Canvas(figsize=FIGURES[name].size, layout="constrained")
        FIGURES[name].draw(canvas, plain["series"])
        canvas.draw_without_rendering()
    assert name in to_markdown([plain])


def test_the_command_writes_picture_numbers_and_page(tmp_path, capsys):
    main(["figures", "--only", "capture_geometry", "--processes", "1", "--out", str(tmp_path)])
    printed = capsys.readouterr().out
    assert "capture_geometry" in printed
    assert "1 of 1 claims hold" in printed
    check_record(json.loads((tmp_path / "capture_geometry.json").read_text()))
    width = np.frombuffer((tmp_path / "capture_geometry.png").read_bytes()[16:20], ">u4")[0]
    assert width == 150 * FIGURES["capture_geometry"].size[0]
    page = (tmp_path / "index.md").read_text()
    assert "![What standing drones capture](capture_geometry.png)" in page
    assert "**Holds**: yes" in page


def test_the_same_seed_writes_the_same_files_in_one_process_and_in_two(tmp_path, monkeypatch):
    names = ["capture_geometry", "permutation_invariance"]
    make_all(names, tmp_path / "one", processes=1)
    make_all(names, tmp_path / "two", processes=2)
    for name in [*(f"{name}.json" for name in names), *(f"{name}.png" for name in names), "index.md"]:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_an_unknown_figure_is_refused_with_the_nearest_name(tmp_path, capsys):
    with pytest.raises(CommandError, match="did you mean 'dropout'"):
        make_all(["dropuot"], tmp_path)
    with pytest.raises(SystemExit):
        main(["figures", "--only", "dropuot", "--out", str(tmp_path)])
    assert "did you mean 'dropout'" in capsys.readouterr().err


def test_a_page_says_no_where_a_claim_does_not_hold():
    finding = FIGURES["capture_geometry"].measure(0)
    record = to_dict(FIGURES["capture_geometry"], finding, 0) | {"supported": False}
    record["statistic"]["cells_that_differ"] = None
    page = to_markdown([record])
    assert "Of 1 claims 0 hold" in page
    assert "**Holds**: no" in page
    assert "| cells that differ | never |" in page


def test_figures_that_are_asked_to_stop_leave_what_is_made_on_the_page(tmp_path, monkeypatch):
    made = []
    for names in (["capture_geometry", "permutation_invariance"],):
        with pytest.raises(Stopped, match="1 of 2 figures are in"):
            make_all(names, tmp_path, processes=1, done=made.append, asked=lambda: bool(made))
    assert f"## {made[0].name}" in (tmp_path / "index.md").read_text()


def test_ctrl_c_names_the_line_that_makes_the_other_figures(tmp_path, capsys, monkeypatch):
    def interrupt(name, seed, out, command):
        if name != "dropout":  # the longest, so the first
            raise KeyboardInterrupt
        return Made(name, True, 0.1)

    monkeypatch.setattr(making, "make", interrupt)
    only = ["--only", "capture_geometry", "dropout", "team_sizes"]
    with pytest.raises(SystemExit, match="130"):
        main(["figures", "--seed", "3", *only, "--processes", "1", "--out", str(tmp_path)])
    line = f"swarm-pz figures --seed 3 --processes 1 --out {tmp_path} --only capture_geometry team_sizes"
    assert f"go on with: {line}\n" in capsys.readouterr().err


@pytest.mark.parametrize("given", [["--only", "a", "b", "--seed", "3"], ["--seed", "3", "--only=a"], ["--seed", "3"]])
def test_the_line_that_goes_on_asks_for_what_is_missing(given):
    token = report.arguments.set(["figures", *given])
    try:
        assert evidence._making(["b"]) == "swarm-pz figures --seed 3 --only b"
    finally:
        report.arguments.reset(token)


def test_help_lists_the_figures(capsys):
    with pytest.raises(SystemExit):
        main(["figures", "--help"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in FIGURES)
