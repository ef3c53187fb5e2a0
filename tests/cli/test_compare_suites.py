"""What ``evaluate --held-out`` and ``evaluate --exploit`` pass on, print and write."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.cli import compare, main
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.workers import Processes, SerialExecutor
from swarm_pz.policies.held_out import Generalisation
from swarm_pz.standard import exploitability

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
    assert isinstance(pools[0], SerialExecutor)
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
        (
            {"games": 6, "seed": 7, "threads": 3, "exploit-steps": 640, "exploiters": 2, "processes": 1},
            ["--out", "runs/mine", "--resume"],
        ),
        ({"seed": 8}, ["--out", "runs/mine", "--overwrite"]),
    ],
)
def test_exploit_searches_and_plays_as_it_was_asked_and_writes_what_came_out(options, more, monkeypatch, capsys):
    seen, pools, shown = [], [], []

    def attack(*args, say, show, should_stop, pool, **given):
        assert say.func is print and not should_stop()
        show(1, 2)
        pools.append(pool)
        seen.append((args, given))
        return "attackers"

    monkeypatch.setattr(exploitability, "attack", attack)
    monkeypatch.setattr(exploitability, "measure", lambda *args, show, **given: seen.append((args, given)) or "found")
    monkeypatch.setattr(exploitability, "figures", lambda *args: seen.append(args) or {"best": "seed-1"})
    monkeypatch.setattr(compare.tables, "print_exploitability", lambda *args: shown.append(args))
    out = Path("runs/mine" if more else "runs/exploiter")
    out.mkdir(parents=True)
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    main(["evaluate", "lasso", "--exploit", "--json", "e.json", *words, *more, *SHORT])
    command = " ".join(["swarm-pz evaluate lasso --exploit --json e.json", *words, *more, *SHORT])
    config = exploitability.SearchConfig(
        steps=options.get("exploit-steps", 3_000_000),
        exploiters=options.get("exploiters", 3),
        games=options.get("games", 1000),
        seed=options.get("seed", 0),
    )
    how = {"resume": "--resume" in more, "overwrite": "--overwrite" in more, "command": command}
    assert seen == [
        (("lasso", out, config, RULES), how),
        (("lasso", "attackers", config, RULES), {"threads": options.get("threads", 2)}),
        ("lasso", "attackers", "found", config, RULES),
    ]
    assert shown == [("found", "lasso", config.steps)]
    assert isinstance(pools[0], SerialExecutor if options.get("processes") == 1 else Processes)
    for place in (out / "exploitability.json", Path("e.json")):
        figures = json.loads(place.read_text())
        assert (figures["best"], figures["rules_hash"], figures["command"]) == ("seed-1", RULES.rules_hash, command)
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
        (["--exploit", "--games", "7"], "games must be even, half for each side, got 7"),
        (["--exploit", "--exploiters", "0"], "exploiters must be a whole number in [1, 100], got 0"),
        (["--exploit", "--exploit-steps", "0"], "steps must be a whole number in"),
        (["--exploit", "--ray", "auto"], "ray must be left out without held_out"),
        (["--processes", "2"], "processes must be left out without held_out or exploit, got 2"),
    ],
)
def test_what_does_not_go_together_is_refused_before_anything_is_played(words, message, capsys, monkeypatch):
    def play(*_, **__):
        raise AssertionError("played")

    for begin in ("standard.exploitability.attack", "policies.held_out.play_suites", "evaluation.match.play_match"):
        monkeypatch.setattr(f"swarm_pz.{begin}", play)
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "ring", *words])
    assert message in capsys.readouterr().err
    assert not Path("runs").exists()
