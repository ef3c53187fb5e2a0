"""What commands print, write and refuse, and how they end."""

import errno
import json
import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import minari
import numpy as np
import pytest

import swarm_pz
from swarm_pz.cli import main, report
from swarm_pz.config import GameConfig
from tests.play.recordings.test_format import record

SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]
RULES = GameConfig(time_limit=5.0, drones_per_team=2)


def refused(capsys, *arguments):
    """Return what a command that is refused says, before it says anything else."""
    with pytest.raises(SystemExit, match="2"):
        main(list(arguments))
    said = capsys.readouterr()
    assert not said.out
    return said.err


# --- what they print and write --------------------------------------------------------------------


def test_policies_and_systems_are_listed(capsys):
    main(["policies"])
    policies, _, systems = capsys.readouterr().out.partition("control systems, by --game.controllers:\n")
    assert "ring        Make a ring" in policies and "prowl       answers attractors: " in policies
    assert "hold        answers any: " in policies and "flocking         takes attractors: " in systems


@pytest.mark.parametrize("preset", [[], ["--preset", "paper"]])
def test_evaluate_names_lost_games_and_the_line_that_shows_one(tmp_path, capsys, preset):
    out = tmp_path / "e.json"
    rules = ["--game.drones-per-team", "1", "12", "--game.time-limit", "60"]  # red loses
    main([*preset, "evaluate", *rules, "corners", "--games", "24", "--seed", "3", "--json", str(out)])
    printed, figures = capsys.readouterr().out, json.loads(out.read_text())
    assert "against uniform" in printed and (figures["games"], figures["policy"]) == (24, "corners")
    named = [f"pair {game['pair']} as {game['side']}" for game in figures["lost"]]
    assert f"lost: {', '.join(named[:6])}, and {len(named) - 6} more (--json FILE has all)\n" in printed
    line = next(line for line in printed.splitlines() if line.startswith("see one: ")).removeprefix("see one: ")
    program, *words = shlex.split(line)
    assert Path(program).name == "swarm-pz" and words[-2:] == ["--out", "lost.mp4"]
    main(words)
    lost = figures["lost"][0]
    winner = {"red": "blue", "blue": "red"}[lost["side"]]
    assert f"{winner} won ({lost['seconds']:.1f} s" in capsys.readouterr().out
    assert Path("lost.mp4").stat().st_size > 1000
    main(["evaluate", "uniform", "--opponent", "halo", "--games", "2", "--game.time-limit", "1"])
    assert "lost:" not in capsys.readouterr().out


def test_a_game_is_drawn_as_a_picture_or_over_time(tmp_path, capsys):
    overlays = ["--overlay", "target", "captures", "--overlay-team", "both"]
    main(["render", "ring", "noise", "--out", "board.png", "--seconds", "2.5", *overlays, *SHORT])
    assert Path("board.png").read_bytes().startswith(b"\x89PNG") and "2.5 s" in capsys.readouterr().out
    one = ["diagnose", "noise", "ring", "--seed", "2", "--side", "blue", "--seconds", "2", *SHORT]
    main([*one, "--json", "game.json", "--pair", "3"])
    assert "ring (red) and noise (blue) had not finished after 2.0 s" in capsys.readouterr().out
    assert Path("game.png").stat().st_size > 1000
    main([*one, "--json", "other.json", "--pair", "4"])
    curves, others = json.loads(Path("game.json").read_text()), json.loads(Path("other.json").read_text())
    assert len(curves["times_s"]) == 21 and curves != others


def test_train_ends_with_a_table_a_curve_a_film_and_a_policy(tmp_path, capsys):
    tiny = "--total-steps 64 --num-envs 4 --rollout 8 --width 8 --evaluation-games 2 --threads 1 --games 6"
    main(["train", "--out", "run", *tiny.split(), *SHORT])
    printed = capsys.readouterr().out
    assert "share above untrained" in printed and "share above noise" in printed
    for name in ("learning_curve.png", "game.mp4", "policy.safetensors"):
        assert Path("run", name).stat().st_size > 0, name
    assert f"rules: {RULES.rules_hash}" in printed
    for name in ("evaluation.json", "policy.json", "history.json"):
        written = json.loads(Path("run", name).read_text())
        assert written["rules_hash"] == RULES.rules_hash and written["command"].startswith("swarm-pz train"), name
    main(["evaluate", "run", "--games", "2", *SHORT])


def test_tournament_writes_the_ladder_goes_on_and_tells_a_log_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.cli.report.QUIET", 0.0)
    arguments = ["tournament", "ring", "uniform", "--processes", "1", "--out", ".", *SHORT]
    main([*arguments, "--games", "2"])
    main([*arguments, "--games", "4"])
    said = capsys.readouterr().out
    assert "0 of 2 games" in said and "2 of 2 games" in said and "rating" in said
    assert len(Path("games.jsonl").read_text().splitlines()) == 4
    assert {entry["player"] for entry in json.loads(Path("ladder.json").read_text())["players"]} == {"ring", "uniform"}
    text = Path("ladder.md").read_text()
    assert "swarm-pz tournament ring uniform --processes 1" in text and "--games 4" in text
    assert Path("ladder.png").stat().st_size > 0


def test_bench_measures_every_face(capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.bench._SHORTEST", 0.0)
    small = ["--games", "1", "4", "--drones", "4", "--repeats", "1", "--grid", "10"]
    main(["bench", *small, "--json", "speed.json", "--plot", "speed.png"])
    measured = json.loads(Path("speed.json").read_text())
    faces = {row["face"] for row in measured["speeds"]}
    assert faces == {"simulator", "batch_env", "SwarmVecEnv, uniform", "SwarmVecEnv, ring", "parallel_env"}
    assert all(row["drone_steps"] == pytest.approx(40 * row["env_steps"]) for row in measured["speeds"])
    assert {row["threads"] for row in measured["speeds"] if row["games"] == 4} == {1, 2}
    assert len(measured["phases_ns_per_drone_step"]) == 4 and Path("speed.png").stat().st_size > 0
    assert "drone-steps" in capsys.readouterr().out
    main(["warmup"])
    assert "compiled kernels are ready" in capsys.readouterr().out


def test_figures_are_written_whole_or_not_at_all(tmp_path, capsys):
    report.arguments.set(["evaluate", "ring"])
    report.write_json({"number": 1}, path := tmp_path / "a.json", RULES)
    with pytest.raises(TypeError):
        report.write_json({"number": np.zeros(3)}, path, RULES)
    written = json.loads(path.read_text())
    assert (written["number"], written["rules_hash"]) == (1, RULES.rules_hash) and len(list(tmp_path.iterdir())) == 1


def test_a_log_is_told_now_and_then_and_not_more_often(monkeypatch, capsys):
    now = [0.0]
    monkeypatch.setattr("swarm_pz.cli.report.time.monotonic", lambda: now[0])
    with report.progress("games") as move:
        for moment, done in ((59.0, 1), (61.0, 2), (62.0, 3), (122.0, 4)):
            now[0] = moment
            move(done, 5)
    assert capsys.readouterr().out.split("\n")[:2] == ["2 of 5 games", "4 of 5 games"]


# --- datasets -------------------------------------------------------------------------------------


def test_dataset_writes_what_players_saw_where_minari_reads_it(capsys):
    rules = ["--games", "2", "--game.time-limit", "5", "--game.drones-per-team", "3"]
    main(["dataset", "ring", "uniform", "--out", "one", "--action-cells", "5", *rules])
    printed = capsys.readouterr().out
    assert "swarm-ring-v0: 2 episodes, 10 steps" in printed and "rules: " in printed
    dataset = minari.MinariDataset(printed.split("dataset: ")[1].split("\n")[0])
    assert dataset.id == "swarm-ring-v0" and dataset.action_space.shape == (5, 5)
    main(["dataset", "ring", "uniform", "noise", "--each", "--out", "each", *rules])
    assert {path.name for path in Path("each").iterdir()} == {f"swarm-{n}-v0" for n in ("noise", "ring", "uniform")}


def test_dataset_reads_what_a_table_recorded(tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=1000)
    record(tmp_path / "b.jsonl", ticks=60)
    main(["dataset", "--recordings", ".", "--out", "out", "--game.observation.grid", "10"])
    printed = capsys.readouterr()
    assert "swarm-person-v0: 1 episodes" in printed.out and "left out: b.jsonl: stopped" in printed.err
    assert minari.MinariDataset("out/swarm-person-v0/data").observation_space.shape == (9, 10, 10)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "got neither"),
        ("ring uniform --recordings games", "got both"),
        ("ring", "players must be at least two"),
        ("ring uniform --view person2", "view must be left out"),
        ("ring uniform --each --name a-v0", "name must be left out with each"),
        ("ring uniform ring --each", "players must be different ones"),
        ("ring nobody", "there is no policy 'nobody'"),
        ("nobody ring", "there is no policy 'nobody'"),
        ("--recordings nowhere", "there is no recording"),
        ("--recordings nowhere --game.time-limit 5", "game must be left out but for its observation"),
    ],
)
def test_a_dataset_that_cannot_be_is_refused_and_nothing_is_written(words, message, tmp_path, capsys):
    assert message in refused(capsys, "dataset", *words.split(), "--out", "out")
    assert list(tmp_path.iterdir()) == []


# --- what they refuse, and how they end -----------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("evaluate rign", "did you mean 'ring'"),
        ("evaluate runs/nothing", "there is no folder 'runs/nothing'"),
        (f"evaluate {Path(__file__).parent}", "give the folder of a run that is finished"),
        ("evaluate ring --games 3", "even number"),
        ("evaluate ring --seed -1", "seed must be a whole number"),
        ("evaluate ring --game.capture.threshold 2", "capture.threshold"),
        ("evaluate ring --game.drones-per-team 0", "Error parsing game: drones_per_team must be"),
        ("evaluate ring --gaems 2", "--games {None}|INT"),
        ("evaluate ring --json /", "got the folder"),
        ("evaluate ring --preset releasd", "did you mean 'released'"),
        ("evaluate ring --preset", "--preset expects one of paper, released"),
        ("policies --preset released", "this command has no rules"),
        ("evaluate ring --recipe long", "trains by no recipe"),
        ("train --recipe", "--recipe expects one of quick, long"),
        ("train --recipe lnog", "--recipe must be 'quick' or 'long', got 'lnog'"),
        ("train --games 5", "games must be an even number"),
        ("league --games 5", "games must be an even number"),
        ("league --seats 0", "seats must be"),
        (f"sweep --out {__file__} --total-steps 64", "is a file, not a folder"),
        ("sweep --seed 3", "seed must be left out: --seeds names them"),
        ("tournament ring", "two or more players"),
        ("tournament ring rign", "did you mean 'ring'"),
        (f"tournament ring uniform --out {__file__}", "is a file, not a folder"),
        ("bench --games 0", "games must be at least 1"),
        ("bench --drones 5", "drones must be even"),
        ("bench --drones 1000000", "nothing to measure"),
        ("bench --plot /", "got the folder"),
        ("render --speed 0", "speed must be a number above 0"),
        ("render --pair -1", "pair must be a whole number"),
        ("render --out film.avi", "must end in .gif or .mp4"),
        ("render --overlay potential --overlay-team both", "one team at a time"),
        ("diagnose --side green", "red"),
        ("diagnose --out game.txt", "out must be a file .png"),
        (f"diagnose --out {__file__}/game.png", "is a file, not a folder"),
        ("diagnose --json /", "got the folder"),
        ("diagnose --seconds 0", "seconds must be a number above 0"),
        ("play --port 99999", "port must be a whole number"),
        ("play --embed lab", "--embed takes the origin of a page"),
        ("trian", "there is no command 'trian'; did you mean 'train'? Known: "),
        ("trian --help", "did you mean 'train'"),
        ("evaluate --policy ring", "policy is written without --policy, as in: swarm-pz evaluate POLICY"),
        ("tournament --players=ring", "players is written without --players"),
    ],
)
def test_errors_are_one_line_and_status_2(words, message, capsys):
    assert message in refused(capsys, *words.split())


@pytest.mark.parametrize("command", ["evaluate", "tournament", "render", "diagnose", "play"])
def test_help_calls_players_by_their_name(command, capsys):
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    printed = capsys.readouterr().out
    assert "PLAYER" in printed and "STR]" not in printed and " STR\n" not in printed


def test_help_and_version_are_said(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["train", "--help"])
    assert "Environment steps in all" in " ".join(capsys.readouterr().out.replace("│", "").split())
    main(["--version"])
    assert capsys.readouterr().out == f"swarm-pz {swarm_pz.__version__}\n"


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (KeyboardInterrupt(), 130, "\nswarm-pz: stopped\n"),
        (
            OSError(28, "No space left on device", "runs/a"),
            2,
            "swarm-pz: no space left on device: 'runs/a'; what was finished before is kept: make room, and run it again"
            "\n",
        ),
    ],
)
def test_interrupts_and_errors_of_the_system_are_words(error, status, said, capsys, monkeypatch):
    def fail(*_):
        raise error

    monkeypatch.setattr("swarm_pz.bench.batch_env_face", fail)
    with pytest.raises(SystemExit, match=str(status)):
        main(["warmup"])
    assert capsys.readouterr().err == said


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
        main([*words.split(), "--games", "2", *SHORT])
    assert f"cannot write '{file}': the disk is full, with " in capsys.readouterr().err


def test_a_reader_that_closes_the_output_gets_no_error():
    code = [sys.executable, "-c", "from swarm_pz.cli import main; main(['train', '--help'])"]
    with subprocess.Popen(code, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:  # noqa: S603
        process.stdout.close()
        assert process.stderr.read() == b""


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_ctrl_c_during_the_imports_is_no_traceback():
    code = (
        "import signal, sys, time; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # jobs ignore it
        "sys.argv = ['bin/swarm-pz']; print(flush=True); import swarm_pz; time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:  # noqa: S603
        process.stdout.readline()
        status = Path(f"/proc/{process.pid}/status")
        while status.exists() and int(status.read_text().split("SigCgt:")[1].split()[0], 16) & 2:
            time.sleep(0.005)  # until Python's own handler is gone
        process.send_signal(signal.SIGINT)
        assert process.stderr.read() == b"" and process.wait() == -signal.SIGINT


def test_a_program_that_is_not_on_the_path_is_called_by_its_place(monkeypatch, tmp_path):
    for called, found, expected in (
        ("some/pytest", None, "swarm-pz"),
        (f"{tmp_path}/my bin/swarm-pz", "/usr/bin/swarm-pz", "swarm-pz"),
        (f"{tmp_path}/my bin/swarm-pz", None, "'my bin/swarm-pz'"),
    ):
        monkeypatch.setattr("sys.argv", [called])
        monkeypatch.setattr("shutil.which", lambda name, found=found: found)
        assert report.program() == expected
