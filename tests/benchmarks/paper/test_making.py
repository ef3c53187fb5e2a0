"""Figures are registered, made by the command, and stand on their page."""

from __future__ import annotations

import importlib
import pkgutil
import re

import numpy as np
import pytest

from benchmarks.paper import claims
from benchmarks.paper.__main__ import main
from benchmarks.paper.claims import capture_geometry
from benchmarks.paper.figure import Part, verdict


def test_every_module_with_a_figure_is_registered_and_quotes_the_paper():
    modules = [
        importlib.import_module(f"{claims.__name__}.{one.name}") for one in pkgutil.iter_modules(claims.__path__)
    ]
    assert {module.__name__.rpartition(".")[2]: module.FIGURE for module in modules} == claims.FIGURES
    for name, figure in claims.FIGURES.items():
        assert figure.name == name and 20 < len(figure.quote) <= 200
        assert re.fullmatch(r"(I|II|III|IV|V)(-[A-C])?", figure.section)


def test_the_same_seed_writes_the_same_files(tmp_path, capsys, monkeypatch):
    field = np.arange(2500.0).reshape(50, 50) / 2499, np.zeros((50, 50), bool)
    monkeypatch.setattr(capture_geometry, "probe", lambda drones, rules: field)
    monkeypatch.chdir(tmp_path)
    kept = []
    for _ in range(2):
        main(["--only", "capture_geometry", "--presets", "paper", "--out", "one", "--processes", "1"])
        kept.append({path.name: path.read_bytes() for path in (tmp_path / "one").iterdir()})
    assert kept[0] == kept[1]
    assert re.search(r"^capture_geometry +paper +partly ", capsys.readouterr().out, re.M)
    assert "## capture_geometry" in kept[0]["figures.md"].decode()
    names = [f"capture_geometry_paper_{columns}col.svg" for columns in (1, 2)]
    points = [float(re.search(rb'width="([0-9.]+)pt"', kept[0][name])[1]) for name in names]
    assert [one / 72 for one in points] == pytest.approx([3.5, 7.16])


def test_a_verdict_counts_the_papers_parts_alone():
    yes, no = (Part("", 0.0, None, holds) for holds in (True, False))
    mine = no._replace(ours=True)
    assert [verdict(parts) for parts in ([yes, mine], [yes, no], [no])] == ["reproduced", "partly", "not reproduced"]
