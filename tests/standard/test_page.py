from __future__ import annotations

import json
import re

from swarm_pz.standard.page import render
from swarm_pz.standard.report import PAGE, REPORT


def test_the_page_is_the_same_for_the_same_report(reported):
    assert (reported / PAGE).read_text() == render(json.loads((reported / REPORT).read_text()))


def test_the_page_fetches_nothing(reported):
    text = (reported / PAGE).read_text()
    assert re.findall(r"(?:src|href|url)\s*[=(]|@import|<script|https?:", text) == []


def test_names_are_no_markup(reported):
    report = json.loads((reported / REPORT).read_text())
    report["name"] = "<script>alert(1)</script>"
    report["policies"][0]["name"] = "<b>"
    report["cost"]["processes"] = "<script>"
    page = render(report)
    assert "<script>" not in page and "<b>" not in page


def test_a_try_is_said_to_be_one(reported):
    report = json.loads((reported / REPORT).read_text())
    assert "cannot be sent in" not in render(report)
    report["protocol"]["version"] = "1-quick"
    assert "cannot be sent in" in render(report)
