"""Commands print, write and refuse as they should, and end with the right status."""

import errno
import json
import os
import sys
from pathlib import Path

import pytest

from swarm_pz import bench
from swarm_pz.config import GameConfig
from swarm_pz.policies import exporting
from tests.cli.conftest import run

SHORT = "--game.time-limit 5 --game.drones-per-team 2"
RULES = GameConfig(time_limit=5.0, drones_per_team=2)


# --- what they print and write --------------------------------------------------------------------


def test_evaluate_names_lost_games_by_the_options_that_show_them(capsys):
    rules = "--game.drones-per-team 1 12 --game.time-limit 30"  # red loses
    run(f"--preset paper evaluate {rules} corners --games 16 --seed 3 --json e.json")
    printed, figures = capsys.readouterr().out, json.loads(Path("e.json").read_text())
    assert "against uniform" in printed and (figures["games"], figures["policy"]) == (16, "corners")
    named = [f"--pair {game['pair']} --side {game['side']}" for game in figures["lost"]]
    assert f"lost: {', '.join(named[:6])}, and {len(named) - 6} more (--json FILE has all)\n" in printed
    run(f"--preset paper render {rules} corners uniform --seed 3 {named[0]} --out lost.png")
    lost = figures["lost"][0]
    winner = {"red": "blue", "blue": "red"}[lost["side"]]
    assert f"{winner} won ({lost['seconds']:.1f} s" in capsys.readouterr().out
    words = "evaluate uniform --opponent halo --games 2 --preset released --game.time-limit 1 --json r.json"
    run(words)
    assert "lost:" not in capsys.readouterr().out
    figures, rules = json.loads(Path("r.json").read_text()), GameConfig.preset("released").replace(time_limit=1.0)
    assert GameConfig.from_dict(figures["rules"]).rules_hash == figures["rules_hash"] == rules.rules_hash
    assert figures["command"] == f"swarm-pz {words}" and figures["versions"]["numba"]


def test_a_moment_of_a_game_is_drawn_as_a_picture(capsys):
    run(f"render ring noise --out board.png --seconds 2.5 --overlay target captures --overlay-team both {SHORT}")
    assert Path("board.png").read_bytes().startswith(b"\x89PNG") and "2.5 s" in capsys.readouterr().out


def test_train_ends_with_a_table_a_curve_a_film_and_a_policy(capsys):
    tiny = "--total-steps 64 --num-envs 4 --rollout 8 --width 8 --evaluation-games 2 --threads 1 --games 6"
    run(f"train --out run {tiny} {SHORT}")
    printed = capsys.readouterr().out
    for part in (
        "training for 64 steps in run", f"rules: {RULES.rules_hash}\n", "share above untrained", "share above noise",
        "(5.0 s, red ", "evaluate run --opponent ring)\n",
    ):  # fmt: skip
        assert part in printed, part
    for name in ("learning_curve.png", "game.mp4", "policy.safetensors"):
        assert Path("run", name).stat().st_size > 0, name
    for name in ("evaluation.json", "policy.json", "history.json"):
        written = json.loads(Path("run", name).read_text())
        assert written["rules_hash"] == RULES.rules_hash and written["command"].startswith("swarm-pz train"), name
    run(f"evaluate run --games 2 {SHORT}")


def test_tournament_writes_the_ladder_and_goes_on(capsys):
    arguments = f"tournament ring uniform --processes 1 --out . {SHORT} --games"
    run(f"{arguments} 2")
    run(f"{arguments} 4")
    assert "rating" in capsys.readouterr().out and Path("ladder.png").stat().st_size > 0
    assert len(Path("games.jsonl").read_text().splitlines()) == 4
    assert "<h1>Tournament</h1>" in Path("index.html").read_text()
    ladder = json.loads(Path("ladder.json").read_text())
    assert {entry["player"] for entry in ladder["players"]} == {"ring", "uniform"}
    assert (ladder["rules_hash"], ladder["command"]) == (RULES.rules_hash, f"swarm-pz {arguments} 4")


def test_bench_measures_every_api(capsys, monkeypatch):
    monkeypatch.setattr(bench, "MIN_SECONDS", 0.0)
    run("bench --games 1 4 --drones 4")
    printed = capsys.readouterr().out
    for api in ("simulator", "batch_env", "SwarmVecEnv, uniform", "SwarmVecEnv, ring", "parallel_env", "drone-steps"):
        assert api in printed
    run("warmup")
    assert "compiled kernels are ready" in capsys.readouterr().out


def test_a_learned_policy_is_exported_for_a_game(monkeypatch, capsys):
    arguments = []
    monkeypatch.setattr(exporting, "export_learned", lambda *named: arguments.extend(named))
    run(f"export champion mine {SHORT}")
    assert "evaluate mine" in capsys.readouterr().out
    assert (arguments[0].name, *arguments[1:]) == ("champion", RULES, RULES.team_systems[0], Path("mine"))


def test_a_pickle_is_not_opened_before_it_is_trusted(monkeypatch, refused):
    monkeypatch.setattr(exporting, "load_model", lambda path: sys.exit(3))
    assert "model.zip is a pickle" in refused("export model.zip out")
    with pytest.raises(SystemExit, match="3"):
        run("export model.zip out --trust")


# --- what they refuse -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("evaluate rign", "did you mean 'ring'"),
        (f"evaluate {Path(__file__).parent}", "give the folder of a run that is finished"),
        ("evaluate ring --game.drones-per-team 0", "Error parsing game: drones_per_team must be"),
        ("policies --preset released", "this command has no rules"),
        ("train --recipe lnog", "--recipe must be 'quick' or 'long', got 'lnog'"),
        ("train --games 5", "games must be an even number"),
        ("tournament ring", "two or more players"),
        (f"tournament ring uniform --out {__file__}", "is a file, not a folder"),
        ("trian --help", "there is no command 'trian'; did you mean 'train'? Known: "),
    ],
)
def test_errors_are_one_line_and_status_2_before_anything_is_played_or_written(words, message, refused, tmp_path):
    assert message in refused(words)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


# --- how they end ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [(KeyboardInterrupt(), 130, "swarm-pz: stopped"), (OSError(28, "full", "runs/a"), 2, "swarm-pz: full: 'runs/a'; ")],
)
def test_interrupts_and_errors_of_the_system_are_words(error, status, said, capsys, monkeypatch):
    def fail(*_):
        raise error

    monkeypatch.setattr("swarm_pz.bench.make_batch_env_step", fail)
    with pytest.raises(SystemExit, match=str(status)):
        run("warmup")
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "file"),
    [("evaluate ring --json e.json", "e.json"), ("tournament ring uniform --out . --processes 1", "games.jsonl")],
)
def test_a_full_disk_is_an_error_that_names_the_file(words, file, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    write = Path.write_text
    monkeypatch.setattr(os, "fsync", full)
    monkeypatch.setattr(Path, "write_text", lambda path, text: full() if "e.draft" in path.name else write(path, text))
    with pytest.raises(SystemExit, match="2"):
        run(f"{words} --games 2 {SHORT}")
    assert f"cannot write '{file}': the disk is full, with " in capsys.readouterr().err


def test_a_reader_that_closes_the_output_gets_no_error(monkeypatch, capsys):
    closed, output = os.pipe()
    os.close(closed)
    with os.fdopen(output, "w", buffering=1) as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        with pytest.raises(SystemExit, match="1"):
            run("policies")
    assert capsys.readouterr().err == ""
