"""Figures are registered, made by the command, and shown on their page."""

from __future__ import annotations

import importlib
import pkgutil
import re

import numpy as np

from benchmarks.paper import claims
from benchmarks.paper.__main__ import main
from benchmarks.paper.claims import capture_geometry
from benchmarks.paper.figure import Finding, Part, Setting, above, asked, below, seen, verdict, within
from benchmarks.paper.page import tables, to_dict, write, write_page
from swarm_pz.config import GameConfig


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
    runs = []
    for _ in range(2):
        main(["--only", "capture_geometry", "--presets", "paper", "--out", "one", "--processes", "1"])
        runs.append({path.name: path.read_bytes() for path in (tmp_path / "one").iterdir()})
    assert runs[0] == runs[1]
    assert re.search(r"^capture_geometry +paper +partly ", capsys.readouterr().out, re.M)
    assert "## capture_geometry" in runs[0]["figures.md"].decode()


def record_of(name, parts, preset="paper", size=1.0):
    """Return a figure's record as in its file, of games that were not played."""
    finding = Finding(parts=parts, method="Wilson", configs={"rules": GameConfig()}, seeds=[0], series={})
    return to_dict(claims.FIGURES[name], finding, Setting(preset, 0, size))


def test_pages_and_tables_tell_each_verdict_and_its_parts_and_which_are_ours_and_a_trial_says_so(tmp_path):
    won = Part("won, below half", 0.4, (0.3, 0.45), "yes")
    late = Part("seconds", np.inf, None, "", ours=True)
    more = Part("won, below a tenth", 0.4, (0.3, 0.45), "no", ours=True)
    records = [
        record_of("adversary", [won, more, late]),
        record_of("adversary", [won._replace(answer="no"), late], "released"),
    ]
    for record in records:
        write(record, tmp_path)
    write_page(tmp_path)
    page = (tmp_path / "figures.md").read_text()
    figure = claims.FIGURES["adversary"]
    assert f"|[adversary](#adversary): {figure.claim}|did not hold|reproduced|not reproduced|" in page
    assert figure.note in page and "](adversary_released.png)" in page
    assert "trial" not in page and all((tmp_path / f"figures_{name}.csv").is_file() for name in ("claims", "parts"))
    write(record_of("comebacks", [won], size=0.1), tmp_path)
    write_page(tmp_path)
    assert "A trial: 10 %" in (tmp_path / "figures.md").read_text()
    rows = tables([{record["preset"]: record} for record in records])
    cells = (figure.section, figure.quote, figure.claim, figure.first, "no", figure.revised)
    assert rows["claims"][1] == ("adversary", *cells, "paper", "won, below half", "reproduced")
    assert rows["parts"][2][:6] == ("adversary", "paper", "firm", "ours", "won, below a tenth", "no")
    assert rows["parts"][1][5:9] == ("yes", "0.4", "0.3", "0.45")
    assert rows["parts"][3][5:] == ("", "never", "", "", "exact") and rows["parts"][4][2] == "paper"


def test_an_answer_needs_the_whole_interval_and_a_verdict_counts_the_papers_parts_alone():
    tests = (
        below(0.5),
        below(0.51),
        below(0.3),
        above(0.3),
        above(0.29),
        above(0.5),
        within(0.5),
        within(0.4),
        within(0.2),
        None,
    )
    expected = ["undecided", "yes", "no", "undecided", "yes", "no", "yes", "undecided", "no", ""]
    assert [asked("", (0.4, (0.3, 0.5)), test).answer for test in tests] == expected
    yes, no, open_ = (Part("", 0.0, None, answer) for answer in ("yes", "no", "undecided"))
    often, once, never = (seen("", games) for games in ([True] * 4, [False, True, False, False], [False] * 4))
    verdicts = {
        "reproduced": ([yes, no._replace(ours=True)], [yes, once]),
        "partly": ([yes, no], [yes, open_], [once, never], [yes, never]),
        "not reproduced": ([no], [no, never]),
        "undecided": ([open_], [open_, no]),
        "seen at least once (1 of 4)": ([often, once],),
        "never seen (0 of 4)": ([never],),
    }
    for expected_verdict, cases in verdicts.items():
        assert {verdict(parts) for parts in cases} == {expected_verdict}
