"""Figures are registered, made by the command, and stand on their pages."""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
import sys

import numpy as np
import pytest

from benchmarks.paper import claims, making, ours
from benchmarks.paper.__main__ import main
from benchmarks.paper.claims import capture_geometry
from benchmarks.paper.figure import Finding
from benchmarks.paper.making import EVERY, Made, make_all
from benchmarks.paper.page import tables, to_dict, write, write_page
from swarm_pz.config import GameConfig
from swarm_pz.errors import Stopped


@pytest.mark.parametrize("folder", [claims, ours])
def test_every_module_with_a_figure_is_registered_and_quotes_the_paper_if_it_is_the_papers(folder):
    modules = [
        importlib.import_module(f"{folder.__name__}.{one.name}") for one in pkgutil.iter_modules(folder.__path__)
    ]
    made = {module.__name__.rpartition(".")[2]: module.FIGURE for module in modules if hasattr(module, "FIGURE")}
    assert made == folder.FIGURES
    for name, figure in made.items():
        assert figure.name == name
        assert bool(re.fullmatch(r"(I|II|III|IV|V)(-[A-C])?", figure.section)) == (folder is claims)
        assert (20 < len(figure.quote) <= 200) == (folder is claims)


def test_the_same_seed_writes_the_same_files_and_figures_that_are_stopped_leave_what_is_made(
    tmp_path, capsys, monkeypatch
):
    for scene in list(capture_geometry.SCENES)[2:]:
        monkeypatch.delitem(capture_geometry.SCENES, scene)
    one, two, made = tmp_path / "one", tmp_path / "two", []
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", "--only", "capture_geometry", "--out", str(one)])
    main()
    assert re.search(r"^capture_geometry +holds (.*\n)+1 of 1 claims hold; ", capsys.readouterr().out, re.M)
    command = json.loads((one / "capture_geometry.json").read_text())["command"]
    names, how = ["permutation_invariance", "capture_geometry"], {"processes": 1, "command": command}
    with pytest.raises(Stopped, match="1 of 2 figures are in"):  # the longest first
        make_all(names, two, done=made.append, should_stop=lambda: bool(made), **how)
    for name in ("capture_geometry.json", "capture_geometry.png", "figures.md", "robustness.md"):
        assert (one / name).read_bytes() == (two / name).read_bytes(), name
    assert "## capture_geometry" in (two / "figures.md").read_text()
    width = np.frombuffer((one / "capture_geometry.png").read_bytes()[16:20], ">u4")[0]
    assert width == 150 * EVERY["capture_geometry"].size[0]


def record_of(name, holds=True):
    """A figure's record as its file would hold it, but for games that were played."""
    finding = Finding(
        numbers={"share": (0.5, (0.4, 0.6)), "seconds": (np.inf, None)}, method="Wilson", holds=holds, seen="Half.",
        configs={"paper": GameConfig()}, seeds=[0], series={},
    )  # fmt: skip
    return to_dict(EVERY[name], finding, 0)


def test_pages_and_tables_tell_of_each_figure_its_claim_its_rule_its_numbers_and_each_part_of_its_verdict(tmp_path):
    parts = {"paper, every second": True, "paper, every 3 s": False}
    records = [record_of("adversary", parts), record_of("bunching_up"), record_of("dropout")]
    for record in records:
        write(record, tmp_path)
    for one in (claims, ours):
        write_page(one.PAGE, one.FIGURES, tmp_path)
    page, own = ((tmp_path / f"{name}.md").read_text() for name in ("figures", "robustness"))
    figure = EVERY["adversary"]
    assert f"| [adversary](#adversary) | {figure.claim} | **no** |" in page and "Of 2 claims 1 hold" in page
    assert re.findall("^## (.*)", page, re.M) == ["adversary", "bunching_up"] and page.count("\nHalf.\n") == 2
    assert "(robustness.md)" in page and "(figures.md)" in own and "## dropout" in own
    assert all((tmp_path / name).is_file() for name in ("figures_claims.csv", "robustness_numbers.csv"))
    found = tables(records)
    assert found["numbers"][1] == ("adversary", "share", "0.5", "0.4", "0.6", "Wilson")
    assert found["numbers"][2] == ("adversary", "seconds", "never", "", "", "Wilson")
    for row, record in zip(found["claims"][1:], records, strict=True):
        figure = EVERY[row[0]]
        assert row[1:6] == (figure.section, figure.quote, figure.claim, figure.rule, figure.revised)
        assert row[6] == ("yes" if record["supported"] else "no")
    assert found["claims"][1][7] == "paper, every second: yes; paper, every 3 s: no"


def test_ctrl_c_names_the_line_that_makes_the_other_figures_and_a_wrong_name_the_nearest(tmp_path, capsys, monkeypatch):
    def interrupt(name, seed, out, command):
        if name != "dropout":  # the longest, so the first
            raise KeyboardInterrupt
        return Made(name, True, 0.1)

    monkeypatch.setattr(making, "make", interrupt)
    options = ["--seed", "3", "--processes", "1", "--out", str(tmp_path), "--only", "capture_geometry", "dropout"]
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", *options])
    with pytest.raises(SystemExit, match="130"):
        main()
    line = f"python -m benchmarks.paper --out {tmp_path} --seed 3 --processes 1 --only capture_geometry"
    assert f"go on with: {line}\n" in capsys.readouterr().err
    monkeypatch.setattr(sys, "argv", ["benchmarks.paper", "--only", "dropuot", "--out", str(tmp_path)])
    with pytest.raises(SystemExit, match="did you mean 'dropout'"):
        main()
