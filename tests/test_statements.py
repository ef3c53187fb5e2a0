"""The table of the paper's statements: every row says where it stands, and what it points to is there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/statements.md"
VERDICTS = {"as said", "differs", "ours", "not shown", "about people or other work"}
SECTIONS = {"abstract", "I", "II", "II-A", "II-B", "II-C", "III-A", "III-B", "III-C", "IV-A", "IV-B", "IV-C", "V"}
FIGURES = {f"Fig. {number}" for number in range(1, 9)}
ROW = re.compile(r"^\| ([^|]*) \| ([^|]+) \| \*\*([^*|]+)\*\*([^|]*) \|$", re.M)
LINK = re.compile(r"\[([^]]+)\]\(([^)#]+)(?:#([^)]*))?\)")


def rows():
    """Return section, statement, verdict and what is here of every row."""
    page = PAGE.read_text()
    found = ROW.findall(page)
    assert len(found) == len(re.findall(r"^\| .*\*\*", page, re.M)), "a row is not as the others are"
    return found


def test_every_row_has_its_section_and_one_of_the_verdicts_and_no_section_is_left_out():
    named = [set(section.split(", ")) for section, *_ in rows()]
    assert all(one and one <= SECTIONS | FIGURES for one in named)
    assert set().union(*named) == SECTIONS | FIGURES
    assert {verdict for _, _, verdict, _ in rows()} == VERDICTS
    assert sum(verdict != "ours" for _, _, verdict, _ in rows()) >= 65


def test_what_is_as_said_is_shown_by_a_test_or_a_figure_and_what_differs_says_why():
    for _, statement, verdict, here in rows():
        if verdict == "as said":
            _, shown = here.split("Shown by: ")
            assert LINK.findall(shown), statement
            assert all("::" in name or name.startswith("figure ") for name, _, _ in LINK.findall(shown)), statement
        elif verdict == "differs":
            assert here.startswith(", because "), statement


def test_files_tests_and_figures_that_rows_name_are_there():
    linked = [(statement, *found) for _, statement, _, here in rows() for found in LINK.findall(here)]
    assert linked
    for statement, name, target, heading in linked:
        path = (PAGE.parent / target).resolve()
        assert path.is_file(), f"{statement}: {target}"
        if "::" in name:  # a test's name, in words
            file, words = name.split("::")
            begins = f'test("{words}' if path.suffix == ".js" else f"def test_{words.replace(' ', '_')}("
            assert file == path.stem and begins in path.read_text(), f"{statement}: {name}"
        elif path.is_relative_to(ROOT / "tests"):
            raise AssertionError(f"{statement}: of {target} no test is named")
        if name.startswith("figure "):
            assert name == f"figure {heading.replace('_', ' ')}", f"{statement}: {name}"
            assert f"\n## {heading}\n" in path.read_text(), f"{statement}: {name}"
