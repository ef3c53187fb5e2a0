"""The paper for the Journal of Open Source Software: its form, its references, and where its figures stand."""

from __future__ import annotations

import re
from datetime import datetime
from itertools import pairwise
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
_, HEAD, BODY = (ROOT / "docs/joss/paper.md").read_text().split("---\n", 2)
REQUIRED = ["Summary", "Statement of need", "State of the field", "Software design", "Research impact statement"]
REQUIRED += ["AI usage disclosure", "Acknowledgements", "References"]


def test_the_paper_has_the_form_that_the_journal_asks_for():
    head = yaml.safe_load(HEAD)
    assert head["title"] == yaml.safe_load((ROOT / "CITATION.cff").read_text())["title"] and head["tags"]
    assert {author["affiliation"] for author in head["authors"]} == {one["index"] for one in head["affiliations"]}
    assert datetime.strptime(head["date"], "%d %B %Y") and (ROOT / "docs/joss" / head["bibliography"]).is_file()
    assert [title for title in re.findall(r"^# (.+)", BODY, re.M) if title != "Limitations"] == REQUIRED
    assert 750 <= len(re.sub(r"<!--.*?-->", "", BODY).split()) <= 1750


def test_what_is_cited_is_in_the_bibliography_and_the_other_way_round():
    entries = re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", (ROOT / "docs/joss/paper.bib").read_text(), re.M | re.DOTALL)
    assert sorted(key for key, _ in entries) == sorted(set(re.findall(r"@(\w+)", BODY)))
    for key, fields in entries:
        assert {"author", "title", "year"} <= set(re.findall(r"^  (\w+) += \{.+\},?$", fields, re.M)), key
        assert re.search(r"^  (doi|url) ", fields, re.M), key


def test_figures_stand_in_the_files_that_the_comment_after_their_paragraph_names():
    for paragraph, after in pairwise(re.sub(r"@\w+", "", BODY).split("\n\n")):
        figures = re.findall(r"\d[\d.,]*\d", "" if paragraph.startswith("<!--") else paragraph)
        names = re.findall(r"\S+\.\w+", after) if after.startswith("<!--") else []
        said = "\n".join((ROOT / name).read_text() for name in names)
        assert [one for one in figures if not re.search(rf"(?<![\d.,]){re.escape(one)}(?!\d)", said)] == []
