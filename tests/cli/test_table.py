"""Commands for people at the table: what they hand on to the server, to films and to tables."""

import sys
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.play.recordings import playback
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.recordings.sandbox import Sandbox
from swarm_pz.play.server import serve as module
from swarm_pz.policies import load
from swarm_pz.policy import about
from tests.play.recordings.test_format import plain_lines, record, write_chained


@pytest.fixture
def served(monkeypatch):
    """Give what the server is called with; it ends at once."""
    calls = []
    monkeypatch.setattr("swarm_pz.cli.table.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(module, "serve", lambda loader, policies, **how: calls.append((loader, policies, how)))
    return calls


def refused(capsys, *arguments):
    """Return what a command that is refused says."""
    with pytest.raises(SystemExit, match="2"):
        main(list(arguments))
    return capsys.readouterr().err


def test_the_table_is_served_as_it_was_asked_for(served, capsys):
    options = ["--host", "127.0.0.2", "--port", "0", "--min-command-interval", "0.75", "--out", "games"]
    options += ["--countdown", "1.5"]
    main(["play", "--opponent", "ring", *options, "--game.command-period", "2"])
    ((loader, policies, how),) = served
    game = GameConfig(command_period=2.0)
    assert loader is load and policies == {"uniform": "everywhere", "ring": about("ring")}
    assert (how["host"], how["port"], how["folder"], how["page"]) == ("127.0.0.2", 0, Path("games"), "play=ring")
    assert how["countdown_s"] == 1.5
    assert how["table"].game == game and how["table"].min_command_interval == 0.75
    assert "█" in how["draw_code"]("http://127.0.0.2:8000/")
    how["say"]("it is there")
    assert capsys.readouterr().out == "it is there\n"
    assert how["greeting"].startswith(f"rules: {game.rules_hash} (rules_hash of")


@pytest.mark.parametrize(("opponent", "page"), [([], ""), (["--opponent", "none"], "play=none")])
def test_nobody_is_an_opponent_that_is_no_policy(opponent, page, served):
    main(["play", *opponent])
    ((_, policies, how),) = served
    assert how["page"] == page and policies == {"uniform": "everywhere"}


def test_factors_are_read_before_anybody_plays(served, capsys, tmp_path):
    path = tmp_path / "factors.toml"
    path.write_text('[blue]\ncommand_delay_ms = 100\nshare = 0.5\nhelper = "ring"\n')
    main(["play", "--factors", str(path)])
    ((_, _, how),) = served
    red, blue = how["table"].factors
    assert (red.command_delay_ms, blue.command_delay_ms, blue.helper) == (0.0, 100.0, "ring")
    path.write_text('[blue]\nshare = 0.5\nhelper = "rign"\n')
    assert "did you mean 'ring'" in refused(capsys, "play", "--factors", str(path))
    path.write_text("[blue]\nframe_rate = 31\n")
    assert "frame_rate must be a whole number in [1, 30], got 31" in refused(capsys, "play", "--factors", str(path))
    assert len(served) == 1


def test_an_opponent_must_be_there(served, capsys):
    assert "did you mean 'ring'" in refused(capsys, "play", "--opponent", "rign")
    assert not served


def test_a_recording_is_shown_from_its_own_folder(served, tmp_path):
    (tmp_path / "games").mkdir()
    record(tmp_path / "games" / "a.jsonl", ticks=30)
    main(["replay", str(tmp_path / "games" / "a.jsonl"), "--host", "127.0.0.2", "--port", "0"])
    ((loader, policies, how),) = served
    assert loader is load and policies == {"uniform": "everywhere"}
    assert (how["host"], how["port"], how["folder"], how["page"]) == (
        "127.0.0.2",
        0,
        tmp_path / "games",
        "replay=a.jsonl",
    )
    assert "█" in how["draw_code"]("http://127.0.0.2:8000/")


def test_a_recording_is_written_as_messages_of_ros_if_that_is_asked(served, tmp_path, capsys, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=30)
    recording = str(tmp_path / "a.jsonl")
    main(["replay", recording, "--mcap", str(tmp_path / "bags" / "a.mcap")])
    assert f"messages: {tmp_path / 'bags' / 'a.mcap'}" in capsys.readouterr().out
    assert (tmp_path / "bags" / "a.mcap").read_bytes().startswith(b"\x89MCAP0")
    assert "name ends with .mcap" in refused(capsys, "replay", recording, "--mcap", str(tmp_path / "a.bag"))
    assert "is a file, not a folder" in refused(capsys, "replay", recording, "--mcap", f"{recording}/a.mcap")
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    said = refused(capsys, "replay", recording, "--mcap", str(tmp_path / "b.mcap"))
    assert "mcap_ros2 is not installed; install it with" in said and "lab]" in said
    assert not served and not list(tmp_path.glob("b.*"))


def test_a_recording_is_only_verified_or_filmed_if_that_is_asked(served, tmp_path, capsys, monkeypatch):
    filmed = []
    do = Sandbox.do

    def noted(sandbox, name, work, *given, **how):
        return filmed.append(given[1:]) if work is playback.film else do(sandbox, name, work, *given, **how)

    monkeypatch.setattr(Sandbox, "do", noted)
    record(tmp_path / "a.jsonl", ticks=30)
    main(["replay", str(tmp_path / "a.jsonl"), "--verify"])
    said = capsys.readouterr().out
    assert "verified: 11 frames" in said and f"ends with {Recording.read(tmp_path / 'a.jsonl').link}" in said
    assert not filmed
    main(["replay", str(tmp_path / "a.jsonl"), "--film", "a.gif", "--speed", "3"])
    assert filmed == [(Path("a.gif"), 3.0)] and "film: a.gif" in capsys.readouterr().out
    main(["replay", str(tmp_path / "a.jsonl"), "--film", "b.gif", "--verify"])
    assert filmed[1:] == [(Path("b.gif"), 2.0)] and "verified" in capsys.readouterr().out
    assert not served


def test_a_recording_that_plays_differently_here_is_an_error(tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=150)
    lines = plain_lines(tmp_path / "a.jsonl")
    place = next(i for i, line in enumerate(lines) if line["type"] == "in_force" and line["tick"] == 60)
    later = next(i for i, line in enumerate(lines) if line.get("tick") == 66)
    moved = lines[place] | {"tick": 63}
    write_chained(tmp_path / "b.jsonl", [*lines[:place], *lines[place + 1 : later], moved, *lines[later:]])
    said = refused(capsys, "replay", str(tmp_path / "b.jsonl"), "--verify")
    assert "plays differently here from tick 6" in said
    assert "command 1 of red had to come into force at tick 60" in said
    write_chained(tmp_path / "c.jsonl", lines[:-1])
    said = refused(capsys, "replay", str(tmp_path / "c.jsonl"), "--verify")
    assert "it is unfinished: it breaks off after 51 frames" in said and "differently" not in said


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--port", "99999"], "port must be a whole number in [0, 65535]"),
        (["--speed", "0"], "speed must be above 0"),
        (["--film", "a.avi"], "must end in .gif or .mp4"),
    ],
)
def test_a_replay_that_cannot_be_is_refused(options, message, served, tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=30)
    assert message in refused(capsys, "replay", str(tmp_path / "a.jsonl"), *options)
    assert not served


def test_a_folder_that_takes_no_recordings_is_an_error_before_anybody_plays(served, tmp_path, capsys):
    (tmp_path / "games").write_text("no folder")
    assert "games cannot be recorded in" in refused(capsys, "play", "--out", str(tmp_path / "games"))
    assert not served


def test_a_table_has_a_ladder_and_is_held_in_frames_as_it_was_asked_for(served):
    main(["play", "--ladder", "--out", "games", "--embed", "https://lab.example", "http://localhost:3000"])
    ((_, _, how),) = served
    assert (how["page"], how["levels"]) == ("ladder", Path("games/levels"))
    assert how["embedders"] == ("https://lab.example", "http://localhost:3000")
    main(["play", "--out", "games"])
    assert (served[1][2]["page"], served[1][2]["levels"], served[1][2]["embedders"]) == ("", None, ())
