"""Figures are registered, made by the command, and stand on their page."""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
import sys

import numpy as np
import pytest

from benchmarks.paper import claims, making
from benchmarks.paper.__main__ import main
from benchmarks.paper.claims import capture_geometry
from benchmarks.paper.figure import Finding, Part, Setting, verdict
from benchmarks.paper.making import Made, make_all
from benchmarks.paper.page import tables, to_dict, write, write_page
from swarm_pz.config import GameConfig
from swarm_pz.errors import Stopped


def test_every_module_with_a_figure_is_registered_and_quotes_the_paper():
    modules = [
        importlib.import_module(f"{claims.__name__}.{one.name}") for one in pkgutil.iter_modules(claims.__path__)
    ]
    assert {module.__name__.rpartition(".")[2]: module.FIGURE for module in modules} == claims.FIGURES
    for name, figure in claims.FIGURES.items():
        assert figure.name == name and 20 < len(figure.quote) <= 200
        assert re.fullmatch(r"(I|II|III|IV|V)(-[A-C])?", figure.section)


def test_the_same_seed_writes_the_same_files_and_figures_that_are_stopped_leave_what_is_made(
    tmp_path, capsys, monkeypatch
):
    field = np.arange(2500.0).reshape(50, 50) / 2499, np.zeros((50, 50), bool)
    monkeypatch.setattr(capture_geometry, "probe", lambda drones, rules: field)
    one, two, made = tmp_path / "one", tmp_path / "two", []
    options = ["--only", "capture_geometry", "--presets", "paper", "--out", str(one)]
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", *options])
    main()
    assert re.search(r"^capture_geometry +paper +partly (.*\n)+1 figures; ", capsys.readouterr().out, re.M)
    command = json.loads((one / "capture_geometry_paper.json").read_text())["command"]
    names, how = ["permutation_invariance", "capture_geometry"], {"processes": 1, "command": command}
    with pytest.raises(Stopped, match="1 of 2 figures are in"):  # the longest first
        make_all(names, two, presets=("paper",), done=made.append, should_stop=lambda: bool(made), **how)
    pictures = [f"capture_geometry_paper_{columns}col.{kind}" for columns in (1, 2) for kind in ("pdf", "svg")]
    for name in ("capture_geometry_paper.json", "capture_geometry_paper.png", "figures.md", *pictures):
        assert (one / name).read_bytes() == (two / name).read_bytes(), name
    assert "## capture_geometry" in (two / "figures.md").read_text()
    points = [
        re.search(rb'width="([0-9.]+)pt"', (one / name).read_bytes()) for name in pictures if name.endswith("svg")
    ]
    assert [float(found[1]) / 72 for found in points] == pytest.approx([3.5, 7.16])


def record_of(name, parts, preset="paper", size=1.0):
    """A figure's record as its file would hold it, but for games that were not played."""
    finding = Finding(parts=parts, method="Wilson", configs={"rules": GameConfig()}, seeds=[0], series={})
    return to_dict(claims.FIGURES[name], finding, Setting(preset, 0, size))


def test_pages_and_tables_tell_each_verdict_and_its_parts_and_which_are_ours_and_a_trial_says_so(tmp_path):
    won = Part("won, below half", 0.4, (0.3, 0.45), True)
    late = Part("seconds", np.inf, None, None, ours=True)
    more = Part("won, below a tenth", 0.4, (0.3, 0.45), False, ours=True)
    records = [
        record_of("adversary", [won, more, late]),
        record_of("adversary", [won._replace(holds=False), late], "released"),
    ]
    for record in records:
        write(record, tmp_path)
    write_page(tmp_path)
    page = (tmp_path / "figures.md").read_text()
    figure = claims.FIGURES["adversary"]
    assert f"|[adversary](#adversary): {figure.claim}|reproduced|not reproduced|" in page
    assert "`paper`: 1 reproduced; `released`: 1 not reproduced" in page and figure.note in page
    assert "|won, below half|yes: 0.4 (0.3..0.45)|no: 0.4 (0.3..0.45)|" in page
    assert "|*ours:* seconds|never|never|" in page and "](adversary_released.png)" in page
    assert "trial" not in page and all((tmp_path / f"figures_{name}.csv").is_file() for name in ("claims", "parts"))
    write(record_of("comebacks", [won], size=0.1), tmp_path)
    write_page(tmp_path)
    assert "A trial: 10 %" in (tmp_path / "figures.md").read_text()
    found = tables([{record["preset"]: record} for record in records])
    told = (figure.section, figure.quote, figure.claim, figure.revised)
    assert found["claims"][1] == ("adversary", *told, "paper", "reproduced")
    assert found["parts"][2][:6] == ("adversary", "paper", "firm", "ours", "won, below a tenth", "no")
    assert found["parts"][3][5:] == ("", "never", "", "", "exact") and found["parts"][4][2] == "paper"


def test_a_verdict_counts_the_papers_parts_alone():
    yes, no = (Part("", 0.0, None, holds) for holds in (True, False))
    mine = no._replace(ours=True)
    assert [verdict(parts) for parts in ([yes, mine], [yes, no], [no])] == ["reproduced", "partly", "not reproduced"]


def test_ctrl_c_names_the_line_that_makes_the_other_figures_and_a_wrong_name_the_nearest(tmp_path, capsys, monkeypatch):
    def interrupt(name, setting, out, command):
        if name != "flocking_comparison":  # the longest, so the first
            raise KeyboardInterrupt
        return Made(name, setting.preset, "reproduced", 0.1)

    monkeypatch.setattr(making, "make", interrupt)
    options = [
        "--seed",
        "3",
        "--processes",
        "1",
        "--out",
        str(tmp_path),
        "--only",
        "capture_geometry",
        "flocking_comparison",
    ]
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", *options])
    with pytest.raises(SystemExit, match="130"):
        main()
    how = "--seed 3 --processes 1 --size 1 --presets paper released"
    line = f"python -m benchmarks.paper --out {tmp_path} {how} --only capture_geometry"
    assert f"go on with: {line}\n" in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", "--only", "flocking_comparisno", "--out", str(tmp_path)])
    with pytest.raises(SystemExit, match="did you mean 'flocking_comparison'"):
        main()
