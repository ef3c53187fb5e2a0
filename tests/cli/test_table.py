"""Commands for people at the table: what they hand on to the server, to films and to messages."""

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
from tests.cli.test_cli import refused
from tests.play.recordings.test_format import plain_lines, record, write_chained


@pytest.fixture
def served(monkeypatch):
    """Give what the server is called with; it ends at once."""
    calls = []
    monkeypatch.setattr("swarm_pz.cli.table.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(module, "serve", lambda loader, policies, **how: calls.append((loader, policies, how)))
    return calls


HERE = "--host 127.0.0.2 --port 0"


def test_a_table_is_served_as_it_was_asked_for(served):
    words = f"play --opponent ring {HERE} --min-command-interval 0.75 --out games --countdown 1.5"
    main([*words.split(), "--embed", "https://lab.example", "http://localhost:3000", "--game.command-period", "2"])
    ((loader, policies, how),) = served
    game = GameConfig(command_period=2.0)
    assert loader is load and policies == {"uniform": "everywhere", "ring": about("ring")}
    assert (how["host"], how["port"], how["folder"], how["page"]) == ("127.0.0.2", 0, Path("games"), "play=ring")
    assert (how["countdown_s"], how["levels"]) == (1.5, None)
    assert how["embedders"] == ("https://lab.example", "http://localhost:3000")
    assert how["table"].game == game and how["table"].min_command_interval == 0.75
    assert "█" in how["draw_code"]("http://127.0.0.2:8000/") and how["say"].func is print
    assert how["greeting"].startswith(f"rules: {game.rules_hash} ")
    main(["play", "--record-labels"])
    assert [how["record_labels"] for _, _, how in served] == [False, True], "names are recorded only if that is asked"


@pytest.mark.parametrize(
    ("words", "page", "levels"),
    [("", "", None), ("--opponent none", "play=none", None), ("--ladder", "ladder", Path("runs/games/levels"))],
)
def test_a_table_without_an_opponent_knows_the_installed_policies(words, page, levels, served):
    main(["play", *words.split()])
    ((_, policies, how),) = served
    assert (policies, how["page"], how["levels"]) == ({"uniform": "everywhere"}, page, levels)


def test_factors_are_read_before_anybody_plays(served, capsys, tmp_path):
    path = tmp_path / "factors.toml"
    path.write_text('[blue]\ncommand_delay_ms = 100\nshare = 0.5\nhelper = "ring"\n')
    main(["play", "--factors", str(path)])
    red, blue = served[0][2]["table"].factors
    assert (red.command_delay_ms, blue.command_delay_ms, blue.helper) == (0.0, 100.0, "ring")
    for text, message in (
        ('[blue]\nshare = 0.5\nhelper = "rign"\n', "did you mean 'ring'"),
        ("[blue]\nframe_rate = 31\n", "frame_rate must be a whole number in [1, 30], got 31"),
    ):
        path.write_text(text)
        assert message in refused(capsys, "play", "--factors", str(path))
    assert len(served) == 1


def test_a_recording_is_shown_from_its_own_folder(served, tmp_path):
    (tmp_path / "games").mkdir()
    record(tmp_path / "games" / "a.jsonl", ticks=30)
    main(["replay", "games/a.jsonl", *HERE.split()])
    ((loader, policies, how),) = served
    assert loader is load and policies == {"uniform": "everywhere"}
    place = (how["host"], how["port"], how["folder"], how["page"])
    assert place == ("127.0.0.2", 0, Path("games"), "replay=a.jsonl")


def test_a_recording_is_only_verified_filmed_or_written_if_that_is_asked(served, tmp_path, capsys, monkeypatch):
    filmed, do = [], Sandbox.do

    def noted(sandbox, name, work, *given, **how):
        return filmed.append(given[1:]) if work is playback.film else do(sandbox, name, work, *given, **how)

    monkeypatch.setattr(Sandbox, "do", noted)
    record(tmp_path / "a.jsonl", ticks=30)
    main(["replay", "a.jsonl", "--verify"])
    said = capsys.readouterr().out
    assert "verified: 11 frames" in said and f"ends with {Recording.read(tmp_path / 'a.jsonl').link}" in said
    main(["replay", "a.jsonl", "--film", "a.gif", "--speed", "3"])
    assert filmed == [(Path("a.gif"), 3.0)] and "film: a.gif" in capsys.readouterr().out
    main(["replay", "a.jsonl", "--film", "b.gif", "--verify"])
    assert filmed[1:] == [(Path("b.gif"), 2.0)] and "verified" in capsys.readouterr().out
    main(["replay", "a.jsonl", "--mcap", "bags/a.mcap"])
    assert "messages: bags/a.mcap" in capsys.readouterr().out
    assert Path("bags/a.mcap").read_bytes().startswith(b"\x89MCAP0")
    monkeypatch.setitem(sys.modules, "mcap_ros2.writer", None)
    said = refused(capsys, "replay", "a.jsonl", "--mcap", "b.mcap")
    assert "mcap_ros2 is not installed" in said and "lab]" in said
    assert not served and not list(tmp_path.glob("b.*"))


def test_a_recording_that_plays_differently_here_is_an_error(tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=150)
    lines = plain_lines(tmp_path / "a.jsonl")
    place = next(i for i, line in enumerate(lines) if line["type"] == "in_force" and line["tick"] == 60)
    later = next(i for i, line in enumerate(lines) if line.get("tick") == 66)
    moved = lines[place] | {"tick": 63}
    write_chained(tmp_path / "b.jsonl", [*lines[:place], *lines[place + 1 : later], moved, *lines[later:]])
    said = refused(capsys, "replay", "b.jsonl", "--verify")
    assert "plays differently here from tick 6" in said
    assert "command 1 of red had to come into force at tick 60" in said
    write_chained(tmp_path / "c.jsonl", lines[:-1])
    said = refused(capsys, "replay", "c.jsonl", "--verify")
    assert "it is unfinished: it breaks off after 51 frames" in said and "differently" not in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("replay a.jsonl --port 99999", "port must be a whole number in [0, 65535]"),
        ("replay a.jsonl --speed 0", "speed must be above 0"),
        ("replay a.jsonl --film a.avi", "must end in .gif or .mp4"),
        ("replay a.jsonl --mcap a.bag", "name ends with .mcap"),
        ("replay a.jsonl --mcap a.jsonl/a.mcap", "is a file, not a folder"),
        ("play --opponent rign", "did you mean 'ring'"),
        ("play --out a.jsonl", "cannot be recorded in a.jsonl"),
        ("play --ros-opponent ring", "give --rosbridge a port"),
    ],
)
def test_what_cannot_be_shown_or_served_is_refused(words, message, served, tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=30)
    assert message in refused(capsys, *words.split())
    assert not served
