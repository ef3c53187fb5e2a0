"""A folder of recordings: only regular files in it are read; their first and last lines give a summary."""

import os

import msgspec
import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play.protocol import EndMessage, RecordedSeat
from swarm_pz.play.recordings import folder as module
from swarm_pz.play.recordings.folder import END_BYTES, Summary, checked_name, is_regular, read_regular, summary_of
from tests.play.recordings.games import CONFIG, header


@pytest.mark.parametrize(
    "name",
    ["../a.jsonl", "a.txt", ".jsonl", "a..jsonl", "a.jsonl\n", "ä.jsonl", "a" * 101 + ".jsonl"],
)
def test_names_are_no_paths(name):
    for good in ("20260101T000000Z-ABCD-1.jsonl", "a" * 100 + ".jsonl"):
        assert checked_name(good) == good
    with pytest.raises(RecordingError):
        checked_name(name)


def test_only_regular_files_of_a_bounded_size_are_read_and_nothing_is_waited_for(tmp_path, monkeypatch):
    secret, link, pipe, other = (tmp_path / name for name in ("secret", "link.jsonl", "pipe.jsonl", "folder.jsonl"))
    secret.write_text("secret")
    link.symlink_to(secret)
    os.mkfifo(pipe)
    other.mkdir()
    for path in (link, pipe, other):
        assert not is_regular(path) and summary_of(path) == Summary(path.name)
        with pytest.raises(RecordingError, match=rf"{path.name} .* a regular file"):
            read_regular(path)
    assert read_regular(secret) == b"secret" and is_regular(secret) and not is_regular(tmp_path / "none")
    monkeypatch.setattr(module, "MOST_BYTES", 5)
    with pytest.raises(RecordingError, match="too large"):
        read_regular(secret)
    regular = secret.stat()
    monkeypatch.setattr(type(tmp_path), "lstat", lambda self: regular)  # as if a pipe replaced the file after the check
    with pytest.raises(RecordingError, match="a regular file"):
        read_regular(pipe)


# --- summaries ------------------------------------------------------------------------------------

END = EndMessage("red", 2270, (20, 0), 75671.0, "capture")
FRAME = {"type": "frame", "tick": 0, "data": "A" * END_BYTES}


def write(path, *lines):
    path.write_bytes(b"".join(msgspec.json.encode(line) + b"\n" for line in (header(CONFIG, 1, "ring"), *lines)))
    return path


def test_a_game_is_told_by_its_ends_however_long_it_is_and_an_unfinished_one_tells_who_played(tmp_path):
    seats = {"red": RecordedSeat("person", label="P1"), "blue": RecordedSeat("policy", policy="ring")}
    known = {"name": "a.jsonl", "started": "2026-01-01T00:00:00.000+00:00", **seats}
    whole = Summary(**known, outcome="red", ended_by="capture", seconds=75.7, sizes=(20, 0))
    assert summary_of(write(tmp_path / "a.jsonl", *[FRAME] * 3, END)) == whole
    assert summary_of(write(tmp_path / "a.jsonl", FRAME)) == Summary(**known)


@pytest.mark.parametrize("content", [b"", b"{}\n", b"\xff\xfe\n", b"[" * 9000, b'{"type":"end"}\n'])
def test_what_is_no_game_has_a_name_alone(content, tmp_path):
    (path := tmp_path / "a.jsonl").write_bytes(content)
    assert summary_of(path) == Summary("a.jsonl")
