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


def test_no_word_of_a_report_is_markup(reported):
    def spoilt(value):
        if isinstance(value, dict):
            return {name: spoilt(part) for name, part in value.items()}
        if isinstance(value, list):
            return [spoilt(part) for part in value]
        return f"<i>{value}" if isinstance(value, str) else value

    report = json.loads((reported / REPORT).read_text())
    report["figures"]["improvement"] = {"over": "other", "probability": 0.5, "ci95": [0.25, 0.75]}
    report["figures"]["tracks"] = {f"<i>{name}": track for name, track in report["figures"]["tracks"].items()}
    page = render(spoilt(report))
    assert "<i>" not in page and page.count("&lt;i&gt;") > 20


def test_the_page_shows_each_figure_where_it_belongs(reported):
    report = json.loads((reported / REPORT).read_text())
    said = report["figures"]
    said["score"], said["score_ci95"] = 0.625, [0.5, 0.75]
    said["tracks"]["robust"] |= {"score": 0.125, "score_ci95": [0.0625, 0.1875]}
    said["tracks"]["uniform"]["opponents"][0] |= {
        "wins": 91,
        "draws": 92,
        "losses": 93,
        "points": [0.25],
        "mean_share": 0.5,
    }
    said["uniform"]["curve"] = {"seconds": [0.0, 30.0, 60.0], "not_won": [1.0, 0.5, 0.25]}
    said["profile"] |= {"score_above": [0.0, 0.5], "share": [1.0, 0.5], "low": [0.75, 0.25], "high": [1.0, 0.75]}
    said["improvement"] = {"over": "other", "probability": 0.7, "ci95": [0.6, 0.8]}
    page = render(report)
    assert '<p class="score">0.625</p>' in page and "interval 0.500 to 0.750, over training seeds" in page
    assert "<td>0.125</td><td>0.062 to 0.188</td><td>worse of two attacks</td>" in page
    assert "<td>91</td><td>92</td><td>93</td><td>0.25</td><td>0.50</td>" in page
    assert '<polyline points="42.0,10.0 192.0,10.0 192.0,95.0 342.0,95.0 342.0,137.5"' in page
    assert '<polygon points="42.0,52.5 192.0,137.5 192.0,52.5 42.0,10.0"' in page
    assert "over opponents: 0.700 (0.600 to 0.800)" in page


def test_who_sees_the_simulator_itself_is_said_to(reported):
    report = json.loads((reported / REPORT).read_text())
    assert "sees the simulator itself" not in render(report)
    report["policies"][1]["privileged"] = True
    assert "sees the simulator itself" in render(report)


def test_forfeits_are_said_to_be_and_why(reported):
    report = json.loads((reported / REPORT).read_text())
    assert "forfeits" not in render(report)
    first = report["figures"]["tracks"]["uniform"]["opponents"][0]
    first |= {"forfeits": 7, "first_forfeit": "entry 1: policy <b> raised"}
    assert "7 of " in (page := render(report)) and "the first since entry 1: policy &lt;b&gt; raised" in page


def test_words_and_numbers_of_a_table_are_not_broken(reported):
    page = (reported / PAGE).read_text()
    assert re.search(r"th, td \{[^}]*white-space: nowrap", page) and re.search(r"\.wide \{[^}]*overflow-x: auto", page)


def test_plots_have_a_mark_in_the_middle(reported):
    page = (reported / PAGE).read_text()
    assert page.count(">0.5</text>") == 3, "both ordinates, and the scores"
    assert ">1.5 s</text>" in page or ">2 s</text>" in page, "half of the time"


def test_a_try_is_said_to_be_one(reported):
    report = json.loads((reported / REPORT).read_text())
    assert "cannot be sent in" not in render(report)
    report["protocol"]["version"] = "1-quick"
    assert "cannot be sent in" in render(report)
