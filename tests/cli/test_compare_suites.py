"""What ``evaluate --held-out`` and ``evaluate --exploit`` pass on, print and write."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.cli import compare, main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.workers import Alone
from swarm_pz.policies.held_out import Generalisation

RULES = GameConfig(drones_per_team=3, time_limit=7.0)
SHORT = ["--game.drones-per-team", "3", "--game.time-limit", "7"]


def match(opponent, score):
    return SimpleNamespace(
        opponent=opponent, score=lambda: score, summary=lambda: {"opponent": opponent, "score": score}
    )


@pytest.fixture
def tables(monkeypatch):
    """Note tables instead of printing them."""
    shown = []

    def note(matches, title):
        shown.append((title, [one.opponent for one in matches]))

    monkeypatch.setattr(compare.tables, "print_opponents", note)
    return shown


@pytest.mark.parametrize("options", [{}, {"games": 6, "seed": 7, "threads": 3}])
def test_held_out_plays_the_suites_as_it_was_asked_and_writes_what_came_out(options, tables, monkeypatch, capsys):
    asked, pools = [], []

    def play_suites(policy, config, *, progress, pool, **given):
        pools.append(pool)
        asked.append((policy, config, given))
        progress(1, 2)
        return Generalisation([match("ring", 0.75), match("halo", 0.25)], [match("drifting", 0.875)])

    monkeypatch.setattr("swarm_pz.policies.held_out.play_suites", play_suites)
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    main(["evaluate", "lasso", "--held-out", "--json", "e.json", *words, *SHORT])
    assert asked == [("lasso", RULES, {"games": 200, "seed": 0, "threads": 2} | options)]
    assert isinstance(pools[0], Alone)
    assert tables == [
        ("lasso against the scripts: score 0.500", ["ring", "halo"]),
        ("lasso against the held-out suite: score 0.875", ["drifting"]),
    ]
    assert "generalisation (held-out score less in-suite score): +0.375\n" in capsys.readouterr().out
    figures = json.loads(Path("e.json").read_text())
    assert (figures["in_suite_score"], figures["held_out_score"], figures["generalisation"]) == (0.5, 0.875, 0.375)
    assert [entry["opponent"] for entry in figures["in_suite"]] == ["ring", "halo"]
    assert [entry["opponent"] for entry in figures["held_out"]] == ["drifting"]
    assert figures["rules_hash"] == RULES.rules_hash
    assert figures["command"].startswith("swarm-pz evaluate lasso --held-out --json e.json")


@pytest.mark.parametrize(
    ("options", "more"),
    [
        ({}, []),
        ({"games": 6, "seed": 7, "threads": 3, "exploit-steps": 640}, ["--out", "runs/mine", "--resume"]),
        ({"seed": 8}, ["--out", "runs/mine", "--overwrite"]),
    ],
)
def test_exploit_trains_and_plays_as_it_was_asked_and_writes_what_came_out(options, more, tables, monkeypatch, capsys):
    asked, stops = [], []

    def make_exploiter(*args, say, **given):
        assert say.func is print
        asked.append((args, given))
        return SimpleNamespace(run=lambda asked: stops.append(asked()), config=SimpleNamespace(game=GameConfig()))

    def play_exploiter(run, target, *, games):
        asked.append((target, games))
        return [match(target, 0.75), match("uniform", 0.5)]

    monkeypatch.setattr("swarm_pz.training.exploit.make_exploiter", make_exploiter)
    monkeypatch.setattr("swarm_pz.training.exploit.play_exploiter", play_exploiter)
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    main(["evaluate", "lasso", "--exploit", "--json", "e.json", *words, *more, *SHORT])
    given = {"games": 200, "seed": 0, "threads": 2, "exploit-steps": 1_000_000} | options
    (args, settings), then = asked
    command = " ".join(["swarm-pz evaluate lasso --exploit --json e.json", *words, *more, *SHORT])
    assert args == ("lasso", Path("runs/mine" if more else "runs/exploiter"))
    assert settings == {
        "steps": given["exploit-steps"],
        "rules": RULES,
        "seed": given["seed"],
        "threads": given["threads"],
        "resume": "--resume" in more,
        "overwrite": "--overwrite" in more,
        "command": command,
    }
    assert stops == [False] and then == ("lasso", given["games"])
    title = f"an exploiter of lasso, trained for {given['exploit-steps']:,} steps"
    assert tables == [(title, ["lasso", "uniform"])]
    figures = json.loads(Path("e.json").read_text())
    assert (figures["target"], figures["steps"]) == ("lasso", given["exploit-steps"])
    assert [entry["score"] for entry in figures["matches"]] == [0.75, 0.5]
    assert (figures["rules_hash"], figures["command"]) == (RULES.rules_hash, command)
    assert f"rules: {RULES.rules_hash}\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--exploit", "--opponent", "halo"], "opponent must be left out, since held_out and exploit choose their own"),
        (["--resume"], "resume and overwrite must be left out without exploit, got (True, False)"),
        (["--held-out", "--overwrite"], "resume and overwrite must be left out without exploit, got (False, True)"),
        (["--exploit", "--resume", "--overwrite"], "give one of them"),
        (["--exploit", "--overwrite"], "overwrite must say which run to replace"),
        (["--held-out", "--json", "/"], "expected the name of a file to write"),
        (["--exploit", "--json", "/"], "expected the name of a file to write"),
    ],
)
def test_what_does_not_go_together_is_refused_before_anything_is_played(words, message, capsys, monkeypatch):
    def play(*_, **__):
        raise AssertionError("played")

    for begin in ("training.exploit.make_exploiter", "policies.held_out.play_suites", "evaluation.match.play_match"):
        monkeypatch.setattr(f"swarm_pz.{begin}", play)
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "ring", *words])
    assert message in capsys.readouterr().err
    assert not Path("runs").exists()
