"""The page of a report shows its figures in their places, fetches nothing, and no text in it is markup."""

import json
import re

import pytest

from swarm_pz.standard.page import KINDS, render
from swarm_pz.standard.report import PAGE, REPORT


@pytest.fixture
def report(reported):
    return json.loads((reported / REPORT).read_text())


def test_the_page_is_the_same_for_the_same_report_and_fetches_nothing(reported, report):
    page = (reported / PAGE).read_text()
    assert page == render(report)
    assert re.findall(r"(?:src|href|url)\s*[=(]|@import|<script|https?:", page) == []


def test_no_text_of_a_report_is_markup(report):
    def spoilt(value):
        if isinstance(value, dict):
            return {name: spoilt(part) for name, part in value.items()}
        if isinstance(value, list):
            return [spoilt(part) for part in value]
        return f"<i>{value}" if isinstance(value, str) and value not in KINDS else value

    report["figures"]["tracks"] = {f"<i>{name}": track for name, track in report["figures"]["tracks"].items()}
    report["figures"]["tracks"]["<i>uniform"]["opponents"][0] |= {"forfeits": 7, "first_forfeit": "broke"}
    report["cost"]["processes"] = "several"
    page = render(spoilt(report))
    assert "<i>" not in page and page.count("&lt;i&gt;") > 20
