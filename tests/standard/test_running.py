from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from swarm_pz.errors import ConfigError, KindError, PolicyError, ResultsError, Stopped, WorkerError
from swarm_pz.standard import Entry, attacks, run
from swarm_pz.standard.report import COST, GAMES, read
from tests.elsewhere import Elsewhere


def test_a_report_holds_all_that_others_need(reported):
    report, lines = read(reported)
    assert [policy["kept"] for policy in report["policies"]] == ["policies/0", None]
    assert (reported / "policies" / "0" / "policy.safetensors").is_file()
    assert report["games"]["count"] == len(lines) == 2 * (3 + 2) * 4 + 2 * 4
    assert set(report["figures"]["tracks"]) == {"uniform", "field", "held-out", "systems", "robust"}
    assert report[COST]["policies"][0]["commands"] > 10**6 and report[COST]["policies"][0]["parameters"] > 1000
    assert report[COST]["policies"][1] == {"commands": None, "seconds": None, "processor": None, "parameters": None}
    assert str(reported) not in json.dumps({name: value for name, value in report.items() if name != COST})


def test_a_stopped_run_that_goes_on_is_the_run_that_never_stopped(reported, tiny, tmp_path):
    entry, asked, steps = Entry(policies=("champion", "ring"), name="two"), [], 3
    while steps < 200:
        asked.clear()

        def stop(limit=steps):
            asked.append(True)
            return len(asked) > limit

        try:
            run(entry, tmp_path, protocol=tiny, processes=1, should_stop=stop)
        except Stopped:
            steps += 7
        else:
            break
    again, once = read(tmp_path), read(reported)
    assert again[1] == once[1]
    assert again[0]["signature"] == once[0]["signature"]
    plain = [
        {name: value for name, value in report.items() if name not in (COST, "checksum")}
        for report in (again[0], once[0])
    ]
    assert plain[0] == plain[1]


def test_whoever_does_the_work_the_report_is_the_same_and_nothing_is_learned_twice(
    reported, tiny, tmp_path, monkeypatch
):
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    entry = Entry(policies=("champion", "ring"), name="two")
    run(entry, Path("there"), protocol=tiny, pool=(there := Elsewhere(tmp_path / "empty")))
    assert set(there.given) == {"learn", "play_block_elsewhere"} and there.given.count("learn") == 2
    assert (Path("there") / GAMES).read_bytes() == (reported / GAMES).read_bytes()
    again, once = read(Path("there"))[0], read(reported)[0]
    assert again["signature"] == once["signature"]
    assert not list((tmp_path / "empty").iterdir()) and not list(Path("there/work").glob("exploiter-*"))
    for place in ("policies/0", "exploiters/0", "exploiters/1"):
        for file in (reported / place).iterdir():
            assert (Path("there") / place / file.name).read_bytes() == file.read_bytes()
    run(entry, Path("there"), protocol=tiny, pool=(after := Elsewhere(tmp_path / "empty")))
    assert after.given == []


def test_a_worker_with_another_policy_of_the_name_learns_nothing(tiny):
    digest, bundle = "0" * 32, None
    with pytest.raises(WorkerError, match=r"champion is another on .*: expected digest 0{32}"):
        attacks.learn("champion", 0, tiny, None, lambda: False, print, digest, bundle)


def test_a_folder_of_another_entry_is_refused(reported, tiny):
    with pytest.raises(ResultsError, match="holds the report of other policies"):
        run(Entry(policies=("halo",), name="halo"), reported, protocol=tiny, processes=1)


def test_a_baseline_is_compared_with(reported, tiny):
    report = run(
        Entry(policies=("champion", "ring"), name="two"), reported, protocol=tiny, processes=1, baseline=reported
    )
    assert report["figures"]["improvement"]["over"] == "two"
    assert report["figures"]["improvement"]["probability"] == pytest.approx(0.5)
    run(Entry(policies=("champion", "ring"), name="two"), reported, protocol=tiny, processes=1)


def test_a_baseline_of_another_protocol_is_refused(reported, tiny, tmp_path):
    other = replace(tiny, plain=tiny.plain | {"version": "other"})
    with pytest.raises(ResultsError, match="only reports of the same protocol compare"):
        run(Entry(policies=("ring",), name="x"), tmp_path, protocol=other, baseline=reported)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"policies": ()}, "policies must be one to 100"),
        ({"policies": ("ring", "ring")}, "policies must be different ones"),
        ({"name": "two\nlines"}, "name must be 1 to 60 characters"),
        ({"name": ""}, "name must be 1 to 60 characters"),
    ],
)
def test_an_entry_that_cannot_be_is_refused(fields, message):
    with pytest.raises(ConfigError, match=message):
        Entry(**{"policies": ("ring",), "name": "ring"} | fields)


def test_a_policy_of_another_kind_is_refused(tiny, tmp_path):
    with pytest.raises(KindError, match="is for policies that answer densities"):
        run(Entry(policies=("prowl",), name="prowl"), tmp_path, protocol=tiny)


def test_an_unknown_policy_is_refused(tiny, tmp_path):
    with pytest.raises(PolicyError, match="there is no policy 'rong'"):
        run(Entry(policies=("rong",), name="rong"), tmp_path, protocol=tiny)
