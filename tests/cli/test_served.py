"""The commands play, replay and study: what reaches the server, films, messages and tables."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.policies import load
from swarm_pz.policy import about
from tests.cli.conftest import run
from tests.play.recordings.games import plain_lines, record, write_lines
from tests.play.studies.test_design import PLAIN, written

HERE = "--host 127.0.0.2 --port 0"


# --- play and replay ------------------------------------------------------------------------------


def test_a_table_is_served_as_it_was_asked_for(served):
    options = f"{HERE} --min-command-interval 0.75 --out games --countdown 1.5 --game.command-period 2 --record-labels"
    run(f"play --opponent ring {options} --embed https://lab.example http://localhost:3000")
    ((loader, policies, args),) = served
    game = GameConfig(command_period=2.0)
    assert loader is load and policies == {"uniform": "everywhere", "ring": about("ring")}
    assert (args["host"], args["port"], args["folder"], args["page"]) == ("127.0.0.2", 0, Path("games"), "play=ring")
    assert (args["countdown_s"], args["record_labels"]) == (1.5, True)
    assert args["embedders"] == ("https://lab.example", "http://localhost:3000")
    assert args["table"].game == game and args["table"].min_command_interval == 0.75
    assert "█" in args["draw_code"]("http://127.0.0.2:8000/") and args["say"].func is print
    assert args["greeting"].startswith(f"rules: {game.rules_hash} ")


def test_factors_are_read_before_anybody_plays(served, refused):
    Path("factors.toml").write_text('[blue]\ncommand_delay_ms = 100\nshare = 0.5\nhelper = "ring"\n')
    run("play --factors factors.toml")
    red, blue = served[0][2]["table"].factors
    assert (red.command_delay_ms, blue.command_delay_ms, blue.helper) == (0.0, 100.0, "ring")
    Path("factors.toml").write_text('[blue]\nshare = 0.5\nhelper = "rign"\n')
    assert "did you mean 'ring'" in refused("play --factors factors.toml") and len(served) == 1


def test_a_recording_is_only_verified_filmed_or_written_if_that_is_asked(
    served, refused, tmp_path, capsys, monkeypatch
):
    filmed = []
    monkeypatch.setattr(Playback, "film", lambda _, *given: filmed.append(given[:2]))
    record(tmp_path / "a.jsonl", ticks=30)
    run("replay a.jsonl --verify --film a.gif --speed 3 --mcap bags/a.mcap --positions a.csv")
    printed = capsys.readouterr().out
    assert "verified: 11 frames" in printed
    assert filmed == [(Path("a.gif"), 3.0)] and "film: a.gif" in printed and "messages: bags/a.mcap" in printed
    assert Path("bags/a.mcap").read_bytes().startswith(b"\x89MCAP0")
    table = np.genfromtxt("a.csv", delimiter=",", skip_header=1, usecols=(0, 1, 3, 4))
    frame = [*Recording.read(Path("a.jsonl")).frames()][1]
    assert len(table) == 31 * len(frame.positions)
    at = table[table[:, 0] == frame.tick]
    assert np.allclose(at[:, 2:], frame.positions, atol=1e-4) and (at[:, 1] == range(len(at))).all()
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    assert "rosbags is not installed" in refused("replay a.jsonl --mcap b.mcap")
    assert not served and not list(tmp_path.glob("b.*"))


def test_a_recording_that_plays_differently_here_or_breaks_off_is_an_error(tmp_path, refused):
    record(tmp_path / "a.jsonl", ticks=60)
    lines = plain_lines(tmp_path / "a.jsonl")
    place = next(i for i, line in enumerate(lines) if line["type"] == "in_force")
    later = next(i for i, line in enumerate(lines) if line.get("tick") == lines[place]["tick"] + 6)
    moved = lines[place] | {"tick": lines[place]["tick"] + 3}
    write_lines(tmp_path / "b.jsonl", [*lines[:place], *lines[place + 1 : later], moved, *lines[later:-1]])
    error = refused("replay b.jsonl --verify")
    assert "had to come into force at tick" in error and "it is unfinished: it breaks off after" in error
    write_lines(tmp_path / "b.jsonl", [lines[0] | {"seed": 2}, *lines[1:]])
    for only in ("--verify", "--positions b.csv"):
        assert "plays differently here from tick 0" in refused(f"replay b.jsonl {only}")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("replay a.jsonl --port 99999", "port must be a whole number in [0, 65535]"),
        ("replay a.jsonl --film a.avi", "must end in .gif or .mp4"),
        ("replay a.jsonl --positions a.txt", "ends in .csv"),
        ("play --embed lab", "--embed takes the origin of a page"),
        ("play --opponent rign", "did you mean 'ring'"),
        ("play --out a.jsonl", "cannot be recorded in a.jsonl"),
        ("play --rosbridge 0 --ros-opponent unifrm", "did you mean 'uniform'"),
    ],
)
def test_what_cannot_be_shown_or_served_is_refused(words, message, request, tmp_path, refused):
    if "embed" not in words:  # which only the real server refuses
        assert request.getfixturevalue("served") == []
    record(tmp_path / "a.jsonl", ticks=30)
    assert message in refused(words)


# --- studies --------------------------------------------------------------------------------------


@pytest.fixture
def study(tmp_path):
    """A study that has begun: its first participant has done a step, and the file of the second is torn."""
    written(tmp_path)
    opened = StudyFolder.begin(tmp_path / "study.toml", tmp_path / "data")
    opened.progress(0).finish(opened.progress(0).next)
    (tmp_path / "data" / "participants" / "P02.jsonl").write_text("{\n")
    yield opened
    opened.close()


def test_a_study_is_served_from_its_folder(served, tmp_path, capsys):
    written(tmp_path)
    run("study run study.toml --port 0 --folder data --host 127.0.0.2 --countdown 1")
    ((loader, _, args),) = served
    assert loader is load and args["study"].study.title == "Two interfaces" and not args["record_labels"]
    assert (args["folder"], args["host"], args["countdown_s"]) == (Path("data/games"), "127.0.0.2", 1.0)
    printed = capsys.readouterr()
    assert "the participants' codes are in data/codes.txt" in printed.out and "warning" not in printed.err
    run("study run study.toml --port 0 --folder data")  # the first run released the folder
    assert len(served) == 2


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ('title = "late"', 'title = "late"\nopponent = "rign"', "condition 'late': opponent: .*did you mean 'ring'"),
        ('title = "late"', 'title = "late"\nsystem = "flocing"', "condition 'late': .*did you mean 'flocking'"),
    ],
)
def test_a_study_that_cannot_be_run_is_refused_before_anything_is_made(before, after, said, served, tmp_path, refused):
    (tmp_path / "consent.md").write_text("?")
    (tmp_path / "study.toml").write_text(PLAIN.replace(before, after))
    assert re.search(said, refused("study run study.toml --folder data"))
    assert not served and not (tmp_path / "data").exists()


def test_a_study_has_a_status_an_export_and_participants_who_withdraw(study, capsys, refused):
    run("study plan study.toml")
    assert "# Plan: Two interfaces" in capsys.readouterr().out
    run("study power study.toml --runs 1 --participants 4")
    assert "false alarms" in capsys.readouterr().out
    run("study status data")
    printed = capsys.readouterr().out
    for part in ("Two interfaces", "0 of 4 participants", "has not come", "start.form", "line 1"):
        assert part in printed, part
    assert "no study has run in" in refused("study status .")
    run("study export data --out out")
    printed = capsys.readouterr()
    assert "1 participants, 0 games" in printed.out and "report.md" in printed.out and "left out: line 1" in printed.err
    assert Path("out/data/description-participants_data.csv").exists()
    assert "--overwrite" in refused("study export data --out out")
    run("study export data --out out --overwrite")
    withdraw = f"study withdraw {study.codes[0].lower()} --folder data"
    assert "may be in session" in refused(withdraw)
    study.close()
    capsys.readouterr()
    run(withdraw)
    printed = capsys.readouterr().out
    assert "P01 has withdrawn" in printed and "and 0 recordings" in printed
