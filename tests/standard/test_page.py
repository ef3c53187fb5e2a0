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

    report["figures"]["improvement"] = {"over": "other", "probability": 0.5, "ci95": [0.25, 0.75]}
    report["figures"]["tracks"] = {f"<i>{name}": track for name, track in report["figures"]["tracks"].items()}
    report["figures"]["tracks"]["<i>uniform"]["opponents"][0] |= {"forfeits": 7, "first_forfeit": "broke"}
    report["cost"]["processes"] = "several"
    page = render(spoilt(report))
    assert "<i>" not in page and page.count("&lt;i&gt;") > 20


def test_the_page_shows_each_figure_where_it_belongs(report):
    said = report["figures"]
    plain = render(report)
    said["score"], said["score_ci95"] = 0.625, [0.5, 0.75]
    said["tracks"]["robust"] |= {"score": 0.125, "score_ci95": [0.0625, 0.1875], "cvar": 0.0625}
    said["tracks"]["robust"]["worst"] = {"opponent": "siege", "score": 0.03}
    said["tracks"]["field"]["open_loop"]["gain"] = -0.12
    counts = {"wins": 91, "draws": 92, "losses": 93, "scores": [0.25, None], "mean_share": 0.5}
    said["tracks"]["uniform"]["opponents"][0] |= counts | {"forfeits": 7, "first_forfeit": "entry 1: policy raised"}
    said["uniform"] |= {"curve": {"seconds": [0.0, 30.0, 60.0], "not_won": [1.0, 0.5, 0.25]}, "median_seconds": None}
    said["improvement"] = {"over": "other", "probability": 0.7, "ci95": [0.6, 0.8]}
    report["cost"]["policies"][0].update(commands=1234567, seconds=None, at_least=["commands"])
    report["cost"].update(processes=None)
    report["policies"][1].update(kind="planned")
    report["protocol"].update(version="1-quick")
    page = render(report)
    for shown in (
        '<p class="score">0.625</p>',
        "interval 0.500 to 0.750, over training seeds",
        "<td>0.125</td><td>0.062 to 0.188</td><td>0.030 (siege)</td><td>0.062</td>",
        "<td>0.500 (0.400 to 0.600)</td><td>0.250 (0.150 to 0.350)</td><td>-0.120</td>",
        "<td>91</td><td>92</td><td>93</td><td>0.25, itself</td><td>0.50</td>",
        '<polyline points="42.0,10.0 192.0,10.0 192.0,95.0 342.0,95.0 342.0,137.5"',
        ">30 s</text>",  # in the middle of the curve
        "over opponents: 0.700 (0.600 to 0.800)",
        "<td>at least 1,234,567</td><td>not said</td>",
        "Kind: learned, planned (sees the simulator).",
        "cannot be sent in",
        "the first since entry 1: policy raised",
        "the median never",
        "a cluster",
    ):
        assert shown in page and (shown not in plain or "median" in shown), shown
    assert "ring does not meet itself: ring of track field is left out." in page
