"""Figures are registered, made by the command, and hold what they promise."""

from __future__ import annotations

import importlib
import json
import pkgutil
import re

import matplotlib
import pytest
from matplotlib.figure import Figure as Canvas

import swarm_pz
from benchmarks.paper import EVERY, FIGURES, OURS, Finding, claims, make_all, ours
from benchmarks.paper.page import tables, to_dict, to_markdown, write
from benchmarks.paper.style import RC
from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, Stopped

FIELDS = {
    "name", "title", "claim", "section", "quote", "paper", "rule", "revised", "statistic", "interval", "supported",
    "parts", "caption", "config_hash", "rules", "rules_hash", "versions", "command", "seed", "seeds", "swarm_pz",
    "series",
}  # fmt: skip
FOLDERS = (claims, ours)


def in_folder(name):
    """Return the name of the folder that a figure's module stands in: claims or ours."""
    return "claims" if name in claims.FIGURES else "ours"


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.__name__.rpartition(".")[2])
def test_every_module_with_a_figure_is_registered(folder):
    modules = [
        importlib.import_module(f"{folder.__name__}.{found.name}") for found in pkgutil.iter_modules(folder.__path__)
    ]
    made = {module.__name__.rpartition(".")[2]: module.FIGURE for module in modules if hasattr(module, "FIGURE")}
    assert made == folder.FIGURES
    assert all(figure.name == name for name, figure in folder.FIGURES.items())


def test_no_figure_is_of_both_pages():
    assert [*FIGURES, *OURS] == [*EVERY]
    assert FIGURES is claims.FIGURES and OURS is ours.FIGURES


@pytest.mark.parametrize("figure", FIGURES.values())
def test_a_claim_of_the_paper_stands_with_its_section_and_few_of_its_words(figure):
    assert re.fullmatch(r"(I|II|III|IV|V)(-[A-C])?", figure.section)
    assert 20 < len(figure.quote) <= 200


@pytest.mark.parametrize("figure", OURS.values())
def test_what_is_ours_is_not_put_into_the_papers_mouth(figure):
    assert figure.section == figure.quote == ""


def check_record(record):
    assert set(record) == FIELDS
    assert record["swarm_pz"] == swarm_pz.__version__
    assert isinstance(record["supported"], bool)
    assert not record["parts"] or record["supported"] == all(record["parts"].values())
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


@pytest.mark.parametrize("name", EVERY)
def test_a_figure_measures_describes_and_draws_itself(name, monkeypatch):
    module = importlib.import_module(f"benchmarks.paper.{in_folder(name)}.{name}")
    small = importlib.import_module(f"tests.benchmarks.paper.{in_folder(name)}.test_{name}").SMALL
    for constant, value in small.items():
        monkeypatch.setattr(module, constant, value)
    figure = EVERY[name]
    record = to_dict(figure, figure.measure(0), 0)
    plain = json.loads(json.dumps(record, allow_nan=False))
    check_record(plain)
    with matplotlib.rc_context(RC):
        canvas = Canvas(figsize=figure.size, layout="constrained")
        figure.draw(canvas, plain["series"])
        canvas.draw_without_rendering()
    assert name in to_markdown(claims.PAGE, [plain])


def test_the_same_seed_writes_the_same_files_in_one_process_and_in_two(tmp_path, monkeypatch):
    names = ["capture_geometry", "permutation_invariance"]
    make_all(names, tmp_path / "one", processes=1)
    make_all(names, tmp_path / "two", processes=2)
    files = [f"{name}.{kind}" for name in names for kind in ("json", "png")]
    for name in [*files, "figures.md", "robustness.md"]:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name


def test_an_unknown_figure_is_refused_with_the_nearest_name(tmp_path, capsys):
    with pytest.raises(CommandError, match="did you mean 'dropout'"):
        make_all(["dropuot"], tmp_path)


def test_a_page_says_no_where_a_claim_does_not_hold():
    finding = FIGURES["capture_geometry"].measure(0)
    record = to_dict(FIGURES["capture_geometry"], finding, 0) | {"supported": False}
    record["statistic"]["cells_that_differ"] = None
    page = to_markdown(claims.PAGE, [record])
    assert "Of 1 claims 0 hold" in page and f"| {FIGURES['capture_geometry'].claim} | **no** |" in page
    _, row = tables([record])["numbers"]
    assert row[:3] == ("capture_geometry", "cells that differ", "never")


def record_of(name, **changed):
    """A figure's record as its file would hold it, but for games that were played."""
    finding = Finding(
        statistic={"share": 0.5}, interval={"share": (0.4, 0.6)}, method="Wilson", supported=True, seen="Half.",
        configs={"paper": GameConfig()}, seeds=[0], series={},
    )  # fmt: skip
    return to_dict(EVERY[name], finding, 0) | changed


def test_tables_hold_claims_with_their_rules_and_numbers_with_their_intervals():
    parts = {"paper, every second": True, "paper, every 3 s": False}
    records = [record_of("adversary", supported=False, parts=parts), record_of("bunching_up"), record_of("dropout")]
    found = tables(records)
    assert found["numbers"][1] == ("adversary", "share", "0.5", "0.4", "0.6", "Wilson")
    rows = [dict(zip(found["claims"][0], row, strict=True)) for row in found["claims"][1:]]
    for row, record in zip(rows, records, strict=True):
        figure = EVERY[row["figure"]]
        assert (row["claim"], row["rule"], row["section"], row["the paper"]) == (
            figure.claim, figure.rule, figure.section, figure.quote,
        )  # fmt: skip
        assert row["changed after the first look"] == figure.revised
        assert row["holds"] == ("yes" if record["supported"] else "no")
    assert rows[0]["parts"] == "paper, every second: yes; paper, every 3 s: no" and not rows[2]["section"]
    assert record_of("adversary")["config_hash"] == {"paper": GameConfig().hash}


def test_pages_hold_the_figures_of_a_folder_with_what_is_seen(tmp_path):
    for name in ("comebacks", "dropout"):
        write(record_of(name), tmp_path)
    make_all(["capture_geometry"], tmp_path, processes=1)
    paper, own = ((tmp_path / name).read_text() for name in ("figures.md", "robustness.md"))
    assert re.findall("^## (.*)", paper, re.MULTILINE) == ["capture_geometry", "comebacks"]
    assert re.findall("^## (.*)", own, re.MULTILINE) == ["dropout"]
    for page, other in ((paper, "robustness.md"), (own, "figures.md")):
        assert f"({other})" in page and f"seed 0, swarm-pz {swarm_pz.__version__}" in page
        assert page.count("\nHalf.\n") == page.count("![") - ("capture_geometry" in page)
    assert all((tmp_path / name).is_file() for name in ("figures_claims.csv", "robustness_numbers.csv"))


def test_a_figure_that_an_older_version_left_in_the_folder_stands_on_the_page(tmp_path):
    old = record_of("comebacks")
    for name in ("section", "quote", "parts"):
        del old[name]
    assert "| yes |" in to_markdown(claims.PAGE, [old]) and tables([old])["claims"][1][-2:] == ("yes", "")


def test_figures_that_are_asked_to_stop_leave_what_is_made_on_the_page(tmp_path, monkeypatch):
    made = []
    for names in (["capture_geometry", "permutation_invariance"],):
        with pytest.raises(Stopped, match="1 of 2 figures are in"):
            make_all(names, tmp_path, processes=1, done=made.append, should_stop=lambda: bool(made))
    assert f"## {made[0].name}" in (tmp_path / "figures.md").read_text()
