"""What recorded games were, by their first and last lines."""

import os

import msgspec
import pytest

from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings import summary as module
from swarm_pz.play.recordings.format import EndLine, Header, RecordedSeat
from swarm_pz.play.recordings.summary import END_BYTES, Summaries, Summary, summary_of

END = EndLine(outcome="red", tick=2270, sizes=(20, 0), ms=75671.0, ended_by="capture")


def write(path, *lines):
    config = TableConfig()
    header = Header(
        version=2,
        software="swarm-pz",
        started="2026-01-01T12:00:00.000+00:00",
        table=config.to_dict(),
        config_hash=config.game.rules_hash,
        seed=1,
        rules_hash=config.game.rules_hash,
        red=RecordedSeat("person", label="P1"),
        blue=RecordedSeat("policy", policy="ring"),
        lesson=True,
    )
    path.write_bytes(b"".join(msgspec.json.encode(line) + b"\n" for line in (header, *lines)))
    return path


def test_a_game_is_told_by_its_ends_however_long_it_is(tmp_path):
    path = write(tmp_path / "a.jsonl", *[{"type": "frame", "tick": 0, "data": "A" * END_BYTES}] * 3, END)
    assert summary_of(path) == Summary(
        name="a.jsonl",
        started="2026-01-01T12:00:00.000+00:00",
        red=RecordedSeat("person", label="P1"),
        blue=RecordedSeat("policy", policy="ring"),
        lesson=True,
        outcome="red",
        ended_by="capture",
        seconds=75.7,
        sizes=(20, 0),
    )


@pytest.mark.parametrize("content", [b"", b"{}\n", b"\xff\xfe\n", b"[" * 9000, b'{"type":"end"}\n'])
def test_what_is_no_game_has_a_name_alone(content, tmp_path):
    (path := tmp_path / "a.jsonl").write_bytes(content)
    assert summary_of(path) == Summary("a.jsonl")


def test_an_unfinished_game_tells_who_played(tmp_path):
    summary = summary_of(write(tmp_path / "a.jsonl", {"type": "frame", "tick": 0, "data": ""}))
    assert summary.blue.policy == "ring" and summary.outcome is None and summary.seconds is None


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.jsonl")
    assert summary_of(tmp_path / "a.jsonl") == Summary("a.jsonl")


def test_a_file_is_read_again_only_when_it_changed(tmp_path, monkeypatch):
    read = []
    monkeypatch.setattr(module, "summary_of", lambda path: read.append(path.name) or Summary(path.name))
    paths = [write(tmp_path / f"{name}.jsonl", END) for name in "abc"]
    summaries = Summaries()
    assert [summary.name for summary in summaries.of(paths)] == ["a.jsonl", "b.jsonl", "c.jsonl"]
    write(paths[1], END, END)
    paths[2].unlink()
    assert [summary.name for summary in summaries.of(paths)] == ["a.jsonl", "b.jsonl"]
    assert read == ["a.jsonl", "b.jsonl", "c.jsonl", "b.jsonl"]
