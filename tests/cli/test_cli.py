from __future__ import annotations

import errno
import inspect
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import minari
import pytest

from swarm_pz import policy
from swarm_pz.cli import learn, main, named_options
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.training.config import TrainConfig
from tests.play.recordings.test_format import record

SHORT = ["--game.time-limit", "5", "--game.drones-per-team", "2"]


def test_policies_are_listed(capsys):
    main(["policies"])
    printed = capsys.readouterr().out
    assert "ring        Make a ring around the opponents' mean position." in printed
    assert "prowl       answers attractors: Circle the largest cluster, and come closer." in printed
    assert "hold        answers any: Send what the control system does by itself" in printed
    _, _, systems = printed.partition("control systems, by --game.controllers:\n")
    assert "flocking         takes attractors: Everybody flies to one place" in systems


def test_evaluate_prints_a_table_and_writes_json(tmp_path, capsys):
    main(["evaluate", "ring", "--opponent", "noise", "--games", "4", "--json", str(tmp_path / "e.json"), *SHORT])
    assert "against noise" in capsys.readouterr().out
    figures = json.loads((tmp_path / "e.json").read_text())
    assert set(figures) >= {
        "wins", "draws", "losses", "games", "win_rate", "win_rate_ci95", "mean_share", "median_seconds",
        "restricted_mean_seconds", "unique_games", "config_hash",
    }  # fmt: skip
    assert figures["games"] == 4


def test_a_preset_is_where_the_rules_of_a_command_begin(tmp_path):
    out = tmp_path / "e.json"
    main(["evaluate", "ring", "--preset", "released", "--games", "2", "--json", str(out), *SHORT])
    rules = GameConfig.preset("released").replace(time_limit=5.0, drones_per_team=2)
    assert json.loads(out.read_text())["config_hash"] == rules.hash


def test_an_unknown_preset_is_refused_with_the_nearest(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "ring", "--preset", "releasd"])
    assert "did you mean 'released'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["policies", "--preset", "released"], "this command has no rules"),
        (["evaluate", "ring", "--preset"], "--preset expects one of paper, released"),
    ],
)
def test_a_preset_that_cannot_be_is_refused(arguments, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert message in capsys.readouterr().err


def test_training_keeps_what_it_sees_under_a_preset():
    rules, _ = named_options.take_preset(["--preset", "released"])
    learner = inspect.signature(named_options.begin_with_preset(rules, learn.train)).parameters["config"].default
    assert learner.game == rules.replace(observation=TrainConfig().game.observation)


@pytest.mark.parametrize("preset", [[], ["--preset", "paper"]])
def test_evaluate_names_lost_games_and_the_line_that_shows_one(tmp_path, capsys, monkeypatch, preset):
    out = tmp_path / "e.json"
    rules = ["--game.drones-per-team", "1", "12", "--game.time-limit", "60"]  # red loses
    main([*preset, "evaluate", *rules, "corners", "--games", "24", "--seed", "3", "--json", str(out)])
    printed = capsys.readouterr().out
    lost = json.loads(out.read_text())["lost"]
    named = [f"pair {game['pair']} as {game['side']}" for game in lost]
    assert len(named) > 6
    assert f"lost: {', '.join(named[:6])}, and {len(named) - 6} more (--json FILE has all)\n" in printed
    line = next(line for line in printed.splitlines() if line.startswith("see one: ")).removeprefix("see one: ")
    program, *words = shlex.split(line)
    assert Path(program).name == "swarm-pz" and words[-2:] == ["--out", "lost.mp4"]
    monkeypatch.chdir(tmp_path)
    main(words)
    winner = {"red": "blue", "blue": "red"}[lost[0]["side"]]
    assert f"{winner} won ({lost[0]['seconds']:.1f} s" in capsys.readouterr().out
    assert (tmp_path / "lost.mp4").stat().st_size > 1000


def test_a_match_without_losses_names_none(capsys):
    main(["evaluate", "uniform", "--opponent", "halo", "--games", "2", "--game.time-limit", "1"])
    assert "lost:" not in capsys.readouterr().out


@pytest.mark.parametrize("command", ["render", "diagnose"])
def test_one_game_of_a_match_can_be_chosen(tmp_path, capsys, command):
    out = ["--out", str(tmp_path / "game.png"), *SHORT]
    main([command, "noise", "uniform", "--seed", "2", "--pair", "3", "--side", "blue", *out])
    chosen = capsys.readouterr().out
    main([command, "noise", "uniform", "--seed", "2", "--pair", "4", "--side", "blue", *out])
    assert chosen != capsys.readouterr().out
    if command == "diagnose":
        assert "uniform (red)" in chosen and "noise (blue)" in chosen


def test_render_writes_a_film(tmp_path, capsys):
    main(["render", "ring", "noise", "--out", str(tmp_path / "film.mp4"), *SHORT])
    assert (tmp_path / "film.mp4").stat().st_size > 1000
    assert "film.mp4" in capsys.readouterr().out


def test_render_writes_a_picture_with_overlays(tmp_path, capsys):
    picture = tmp_path / "board.png"
    overlays = ["--overlay", "target", "captures", "--overlay-team", "both"]
    main(["render", "ring", "noise", "--out", str(picture), "--seconds", "2.5", *overlays, *SHORT])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert "2.5 s" in capsys.readouterr().out


def test_diagnose_draws_a_game_over_time_and_writes_json(tmp_path, capsys):
    picture, figures = tmp_path / "game.png", tmp_path / "game.json"
    main(["diagnose", "ring", "noise", "--out", str(picture), "--json", str(figures), "--seconds", "2", *SHORT])
    assert picture.stat().st_size > 1000
    assert len(json.loads(figures.read_text())["times_s"]) == 21
    assert "ring (red) and noise (blue) had not finished after 2.0 s" in capsys.readouterr().out


def test_train_ends_with_a_table_a_curve_a_film_and_a_policy(tmp_path, capsys):
    out = tmp_path / "run"
    tiny = [
        "--total-steps",
        "64",
        "--num-envs",
        "4",
        "--rollout",
        "8",
        "--width",
        "8",
        "--evaluation-games",
        "2",
        "--threads",
        "1",
        "--games",
        "6",
    ]
    main(["train", "--out", str(out), *tiny, *SHORT])
    printed = capsys.readouterr().out
    for baseline in ("untrained", "noise"):
        assert f"share above {baseline}" in printed
    for name in ("learning_curve.png", "game.mp4", "evaluation.json", "policy.safetensors", "policy.json"):
        assert (out / name).stat().st_size > 0, name
    rules = GameConfig(time_limit=5.0, drones_per_team=2)
    assert f"rules: {rules.rules_hash}" in printed
    for name in ("evaluation.json", "policy.json", "history.json"):
        written = json.loads((out / name).read_text())
        assert written["rules_hash"] == rules.rules_hash, name
        assert written["command"].startswith("swarm-pz train --out"), name
    main(["evaluate", str(out), "--games", "2", *SHORT])
    assert "run" in capsys.readouterr().out


def test_dataset_writes_what_a_player_saw_where_minari_reads_it(tmp_path, capsys):
    rules = ["--game.time-limit", "5", "--game.drones-per-team", "3"]
    main(["dataset", "ring", "uniform", "--games", "2", "--out", str(tmp_path), "--action-cells", "5", *rules])
    printed = capsys.readouterr().out
    assert "swarm-ring-v0: 2 episodes, 10 steps" in printed and "rules: " in printed
    dataset = minari.MinariDataset(printed.split("dataset: ")[1].split("\n")[0])
    assert dataset.id == "swarm-ring-v0" and dataset.action_space.shape == (5, 5)
    main(["dataset", "ring", "uniform", "noise", "--each", "--games", "2", "--out", str(tmp_path / "each"), *rules])
    assert {path.name for path in (tmp_path / "each").iterdir()} == {
        "swarm-noise-v0",
        "swarm-ring-v0",
        "swarm-uniform-v0",
    }


def test_dataset_reads_what_a_table_recorded(tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=1000)
    record(tmp_path / "b.jsonl", ticks=60)
    options = ["--out", str(tmp_path / "out"), "--game.observation.grid", "10"]
    main(["dataset", "--recordings", str(tmp_path), *options])
    printed = capsys.readouterr()
    assert "swarm-person-v0: 1 episodes" in printed.out and "left out: b.jsonl: stopped" in printed.err
    assert minari.MinariDataset(tmp_path / "out/swarm-person-v0/data").observation_space.shape == (9, 10, 10)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "name a player and opponents, or else give --recordings; got neither"),
        ("ring uniform --recordings games", "got both"),
        ("ring", "players must be at least two"),
        ("ring uniform --view person2", "view must be left out"),
        ("ring uniform --each --name a-v0", "name must be left out with each"),
        ("ring uniform ring --each", "players must be different ones"),
        ("ring nobody", "there is no policy 'nobody'"),
        ("nobody ring", "there is no policy 'nobody'"),
        ("--recordings nowhere", "there is no recording, nor a folder of recordings, 'nowhere'"),
        ("--recordings nowhere --game.time-limit 5", "game must be left out but for its observation"),
    ],
)
def test_dataset_says_in_a_line_what_is_wrong_and_writes_nothing(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["dataset", *words.split(), "--out", "out"])
    assert stopped.value.code == 2 and message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_log_says_how_far_a_tournament_is(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.cli.report.QUIET", 0.0)
    main(["tournament", "ring", "uniform", "--processes", "1", "--out", str(tmp_path), "--games", "2", *SHORT])
    said = capsys.readouterr().out
    assert "0 of 2 games" in said and "2 of 2 games" in said


def test_tournament_writes_the_ladder_and_goes_on(tmp_path, capsys):
    arguments = ["tournament", "ring", "uniform", "--processes", "1", "--out", str(tmp_path), *SHORT]
    main([*arguments, "--games", "2"])
    main([*arguments, "--games", "4"])
    assert "rating" in capsys.readouterr().out
    assert len((tmp_path / "games.jsonl").read_text().splitlines()) == 4
    figures = json.loads((tmp_path / "ladder.json").read_text())
    assert {entry["player"] for entry in figures["players"]} == {"ring", "uniform"}
    text = (tmp_path / "ladder.md").read_text()
    assert "swarm-pz tournament ring uniform --processes 1" in text
    assert "--games 4" in text
    assert (tmp_path / "ladder.png").stat().st_size > 0


def test_evaluate_held_out_reports_how_a_policy_generalises(tmp_path, capsys):
    main(["evaluate", "ring", "--held-out", "--games", "2", "--json", str(tmp_path / "e.json"), *SHORT])
    assert "generalisation" in capsys.readouterr().out
    assert set(json.loads((tmp_path / "e.json").read_text())) >= {"in_suite_score", "held_out_score"}


def test_evaluate_exploit_trains_best_responses(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.cli.report.QUIET", 0.0)
    monkeypatch.setitem(sys.modules, "cma", None)  # whose search plays for longer
    small = ["--exploit-steps", "64", "--exploiters", "2", "--games", "2", "--threads", "1", "--processes", "1"]
    rules = ["--game.time-limit", "5", "--game.drones-per-team", "2"]
    out = tmp_path / "run"
    main(["evaluate", "centre", "--exploit", *small, *rules, "--out", str(out), "--json", str(tmp_path / "e.json")])
    said = capsys.readouterr().out
    assert "128 of 128 steps of training" in said  # nothing was said of them
    assert "the search that does not learn is left out" in said and "an exploiter of centre" in said
    assert "exploitability: " in said.splitlines()[-3] and " % of 2 games" in said.splitlines()[-3]
    figures = json.loads((tmp_path / "e.json").read_text())
    assert figures == json.loads((out / "exploitability.json").read_text())
    assert figures["exploiter"]["opponent"] == "centre" and len(figures["choice"]) == 2 and figures["siege"] is None


def test_league_writes_a_policy(tmp_path, capsys):
    tiny = {"total-steps": 64, "num-envs": 4, "rollout": 8, "width": 8, "threads": 1, "evaluation-games": 2}
    learner = [text for name, value in tiny.items() for text in (f"--learner.{name}", str(value))]
    small = ["--learner.game.time-limit", "5", "--learner.game.drones-per-team", "2"]
    main(["league", "--out", str(tmp_path), "--scripts", "ring", "--cycle", "32", "--games", "2", *learner, *small])
    assert "against the scripts" in capsys.readouterr().out
    card = json.loads((tmp_path / "policy.json").read_text())
    assert card["results"]["ring"]["games"] > 0


TACTIC = """
from swarm_pz.policies.scripted import tactic

@tactic
def surround(view):
    return view.every(view.x)

def bare(view):
    return view.x

number = 3
"""


@pytest.fixture
def tactics(tmp_path, monkeypatch):
    """A folder to be in, with a tactic in a file, and another file that cannot be run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(TACTIC)
    (tmp_path / "broken.py").write_text("\nimport nothing_of_this_name\n")


@pytest.mark.usefixtures("tactics")
@pytest.mark.parametrize(
    "words",
    [
        "evaluate mine.py:surround --games 2",
        "evaluate uniform --opponent=mine.py:surround --games 2",
        "tournament mine.py:surround ring --games 2 --processes 2",  # others load it by its name
        "render ring mine.py:surround --out surround.png --seconds 1",
        "dataset mine.py:surround ring --games 2 --out surround",
    ],
)
def test_a_tactic_in_a_file_plays_where_a_player_is_named(words, capsys):
    main([*words.split(), *SHORT])
    assert "surr" in capsys.readouterr().out


@pytest.mark.usefixtures("tactics")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("none.py:surround", "there is no file 'none.py'\n"),
        ("mine.py:suround", "mine.py has no 'suround'; did you mean 'surround'? Known: bare, surround\n"),
        ("broken.py:surround", "broken.py, line 2, cannot be imported: ModuleNotFoundError"),
        ("mine.py:number", "'number' of mine.py must be a tactic (its function stands below @tactic), or a callable"),
        ("mine.py:bare", "has no attribute 'x'\"); expected a tactic (its function stands below @tactic)"),
        ("mine.py", "got the file 'mine.py'; name the tactic in it, too: mine.py:NAME\n"),
    ],
)
def test_a_file_without_the_tactic_is_refused_in_words(name, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", name])
    assert message in capsys.readouterr().err


@pytest.mark.usefixtures("tactics")
def test_a_file_that_the_command_line_does_not_name_is_not_run():
    """A recording, a report or a study may name a file; so may a client at the table, whom the lobby refuses, too."""
    main(["policies"])
    with pytest.raises(PolicyError, match="the command line alone may name one"):
        policy.load("broken.py:surround", GameConfig())
    assert policy.about("broken.py:surround") == "" and policy.kind_of("broken.py:surround") == "density"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "rign"], "did you mean 'ring'"),
        (["evaluate", "ring", "--games", "3"], "even number"),
        (["evaluate", "ring", "--game.capture.threshold", "2"], "capture.threshold"),
        (["evaluate", "ring", "--seed", "-1"], "seed must be a whole number"),
        (["train", "--games", "5"], "games must be an even number"),
        (["evaluate", "ring", "--held-out", "--exploit"], "one at a time"),
        (["evaluate", "ring", "--held-out", "--opponent", "halo"], "left out"),
        (["evaluate", "ring", "--processes", "2"], "processes must be left out without held_out or exploit"),
        (["tournament", "ring"], "two or more players, each named once, got ['ring']"),
        (["tournament", "ring", "rign"], "did you mean 'ring'"),
        (["league", "--games", "5"], "games must be an even number"),
        (["league", "--seats", "0"], "seats must be"),
        (["bench", "--games", "0"], "games must be at least 1"),
        (["bench", "--drones", "5"], "drones must be even"),
        (["bench", "--drones", "1000000"], "nothing to measure"),
        (["render", "--speed", "0"], "speed must be a number above 0"),
        (["render", "--pair", "-1"], "pair must be a whole number in [0, 1000000000], got -1"),
        (["diagnose", "--side", "green"], "red"),
        (["diagnose", "--out", "game.txt"], "out must be a file .png, .pdf or .svg"),
        (["diagnose", "--seconds", "0"], "seconds must be a number above 0"),
        (["render", "--out", "film.avi"], "must end in .gif or .mp4"),
        (["evaluate", "runs/nothing"], "there is no folder 'runs/nothing'"),
        (["evaluate", "ring", "--json", "/"], "expected the name of a file to write, got the folder"),
        (["play", "--port", "99999"], "port must be a whole number in [0, 65535]"),
        (["tournament", "ring", "uniform", "--out", __file__], "is a file, not a folder"),
        (["diagnose", "--out", f"{__file__}/game.png"], "is a file, not a folder"),
        (["bench", "--plot", "/"], "expected the name of a file to write, got the folder"),
        (["evaluate", "ring", "--game.drones-per-team", "0"], "Error parsing game: drones_per_team must be"),
        (["evaluate", "ring", "--gaems", "2"], "--games {None}|INT"),
        (["trian"], "there is no command 'trian'; did you mean 'train'? Known: "),
        (["trian", "--help"], "there is no command 'trian'; did you mean 'train'? Known: "),
        (["evaluate", "--policy", "ring"], "policy is written without --policy, as in: swarm-pz evaluate POLICY"),
        (["tournament", "--players=ring"], "players is written without --players, as in: swarm-pz tournament PLAYERS"),
        (
            ["evaluate", str(Path(__file__).parent)],
            "give the folder of a run that is finished, or a name that swarm-pz",
        ),
        (["benchmark", "rign"], "did you mean 'ring'"),
        (["sweep", "--out", __file__, "--total-steps", "64"], "is a file, not a folder"),
        (["play", "--embed", "lab"], "--embed takes the origin of a page"),
        (["render", "--overlay", "potential", "--overlay-team", "both"], "one team at a time"),
    ],
)
def test_errors_are_one_line_and_status_2(arguments, message, capsys):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    said = capsys.readouterr()
    assert message in said.err and not said.out  # nothing is said before all is checked


def test_bench_measures_every_face(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("swarm_pz.bench._SHORTEST", 0.0)
    figures, drawing = tmp_path / "speed.json", tmp_path / "speed.png"
    small = ["--games", "1", "4", "--drones", "4", "--repeats", "1", "--grid", "10"]
    main(["bench", *small, "--json", str(figures), "--plot", str(drawing)])
    measured = json.loads(figures.read_text())
    faces = {row["face"] for row in measured["speeds"]}
    assert faces == {"simulator", "batch_env", "SwarmVecEnv, uniform", "SwarmVecEnv, ring", "parallel_env"}
    assert all(row["drone_steps"] == pytest.approx(40 * row["env_steps"]) for row in measured["speeds"])
    assert {row["threads"] for row in measured["speeds"] if row["games"] == 4} == {1, 2}
    assert len(measured["phases_ns_per_drone_step"]) == 4
    assert drawing.stat().st_size > 0
    assert "drone-steps" in capsys.readouterr().out


def test_warmup_says_how_long_it_took(capsys):
    main(["warmup"])
    assert "compiled kernels are ready" in capsys.readouterr().out


def test_help_teaches(capsys):
    with pytest.raises(SystemExit):
        main(["train", "--help"])
    printed = " ".join(capsys.readouterr().out.replace("│", "").split())
    assert "Environment steps in all" in printed and "after 200,000 a tactic" in printed
    assert "stable_baselines3" not in sys.modules or "swarm_pz.training" in sys.modules


@pytest.mark.parametrize("command", ["evaluate", "tournament", "render", "diagnose", "play"])
def test_help_calls_players_by_their_name(command, capsys):
    with pytest.raises(SystemExit, match="0"):
        main([command, "--help"])
    printed = capsys.readouterr().out
    assert "PLAYER" in printed
    assert "STR]" not in printed and " STR\n" not in printed


def test_ctrl_c_is_not_a_traceback(capsys, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("swarm_pz.bench.batch_env_face", stop)
    with pytest.raises(SystemExit, match="130"):
        main(["warmup"])
    assert capsys.readouterr().err == "\nswarm-pz: stopped\n"


def test_errors_of_the_system_are_words(capsys, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device", "runs/a")

    monkeypatch.setattr("swarm_pz.bench.batch_env_face", fail)
    with pytest.raises(SystemExit, match="2"):
        main(["warmup"])
    said = "no space left on device: 'runs/a'; what was finished before is kept: make room, and run it again"
    assert capsys.readouterr().err == f"swarm-pz: {said}\n"


@pytest.mark.parametrize(
    ("words", "file"),
    [("evaluate ring --json e.json", "e.json"), ("tournament ring uniform --out . --processes 1", "games.jsonl")],
)
def test_a_full_disk_is_an_error_that_names_the_file(words, file, tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(os, "fsync", full)
    write = Path.write_text
    monkeypatch.setattr(Path, "write_text", lambda path, text: full() if "e.draft" in path.name else write(path, text))
    with pytest.raises(SystemExit, match="2"):
        main([*words.split(), "--games", "2", *SHORT])
    assert f"cannot write '{file}': the disk is full, with " in capsys.readouterr().err


def test_a_reader_that_has_seen_enough_gets_no_error():
    code = [sys.executable, "-c", "from swarm_pz.cli import main; main(['train', '--help'])"]
    with subprocess.Popen(code, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:  # noqa: S603
        process.stdout.close()
        assert process.stderr.read() == b""
