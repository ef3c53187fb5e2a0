"""A study's plan names the tests that decide, its report shows them apart, and simulations give the power."""

import hashlib

import pytest

from swarm_pz.errors import ConfigError
from swarm_pz.play.studies.planning import plan_of, power
from swarm_pz.play.studies.reading import read_study
from swarm_pz.play.studies.report import write_report
from tests.play.studies.playing import PLAIN, begun, walk, written

CROSSED = """
title = "Two by two"
participants = 8
games = 4
order = [["a", "b", "c", "d"]]

[[conditions]]
title = "a"

[[conditions]]
title = "b"
hide = ["opponents"]

[[conditions]]
title = "c"
command_delay_ms = 300

[[conditions]]
title = "d"
command_delay_ms = 300
hide = ["opponents"]
"""
PLAN = """
[plan]
hypotheses = ["A *delay* costs games."]
tests = ["win_rate: drawing less late", "sus: drawing less late"]
stopping = "After four."
"""


def test_a_plan_is_of_tests_that_there_are_and_is_shown_beside_the_data(tmp_path):
    with begun(tmp_path, PLAIN.replace("[practice]", f"{PLAN}\n[practice]")) as folder:
        walk(folder, 0)
    file = tmp_path / "data" / "study" / "study.toml"
    text = plan_of(folder.study, file)
    for part in ("A *delay* costs", "sus: drawing less late", "After four.", "command_delay_ms, within people: 0, 300"):
        assert part in text
    assert hashlib.sha256((tmp_path / "plan" / "study.toml").read_bytes()).hexdigest() in text, "of the file as it was"
    tests = write_report(read_study(tmp_path / "data"), tmp_path)
    assert [(one.measure, one.planned) for one in tests if one.kind == "pair"] == [
        ("win_rate", True),
        ("restricted_mean_s", False),
        ("sus", True),
    ]
    planned = (tmp_path / "report.md").read_text().split("## The plan")[1].split("\n## ")[0]
    assert r"A \*delay\* costs games" in planned and "share won" in planned and "mean length" not in planned
    for wrong in ("win_rat: drawing less late", "win_rate: late less drawing"):
        with pytest.raises(ConfigError, match=r"plan\.tests"):
            written(tmp_path / "plan", PLAIN + PLAN.replace("sus: drawing less late", wrong))


def test_power_is_how_often_simulated_studies_find_an_effect(tmp_path):
    study = written(tmp_path, CROSSED)
    rows = power(study, 8, difference=0.4, share=0.5, spread=0.1, runs=12)
    assert [row.effect for row in rows] == ["command_delay_ms", "hide", "command_delay_ms x hide"]
    for row in rows[:2]:
        assert row.power > 0.85 > 0.25 > row.false_alarms and row.pairs < row.power
    assert rows[2].power < 0.6, "an interaction takes more"
    between = study.replace(order=(("a", "b"), ("c", "d")))
    delay, hidden, _ = power(between, 8, difference=0.4, share=0.5, spread=0.1, runs=12)
    assert delay.power < hidden.power and delay.false_alarms < 0.25, "groups differ by their people, too"
    three = study.replace(conditions=study.conditions[:3], order=(("a", "b", "c"),))
    with pytest.raises(ConfigError, match="no factorial design"):
        power(three, 8, difference=0.4, share=0.5, spread=0.1, runs=1)
