"""A folder of recordings: its own regular files, and nothing that a link, a pipe or a size makes of them."""

import os
import socket
from pathlib import Path

import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play.recordings import folder as module
from swarm_pz.play.recordings.folder import checked_name, is_regular, read_regular


@pytest.mark.parametrize("name", ["../a.jsonl", "a/b.jsonl", "a.txt", ".jsonl", "a..jsonl", "", "a.jsonl\n", "ä.jsonl"])
def test_names_are_no_paths(name):
    for good in ("20260101T000000Z-ABCD-1.jsonl", "a" * 100 + ".jsonl"):
        assert checked_name(good) == good
    with pytest.raises(RecordingError):
        checked_name("a" * 101 + ".jsonl")
    with pytest.raises(RecordingError):
        checked_name(name)


def others(tmp_path):
    """Return what is no regular file: links, a pipe, a socket, a folder, a device."""
    (tmp_path / "secret").write_text("secret")
    made = {name: tmp_path / f"{name}.jsonl" for name in ("link", "astray", "round", "pipe", "socket", "folder")}
    made["link"].symlink_to(tmp_path / "secret")
    made["astray"].symlink_to(tmp_path / "nowhere")
    made["round"].symlink_to(made["round"])
    os.mkfifo(made["pipe"])
    made["folder"].mkdir()
    with socket.socket(socket.AF_UNIX) as listening:
        here = Path.cwd()
        os.chdir(tmp_path)  # a socket's path may not be long
        listening.bind("socket.jsonl")
        os.chdir(here)
    return made


def test_only_regular_files_are_read_and_nothing_is_waited_for(tmp_path):
    for path in others(tmp_path).values():
        assert not is_regular(path)
        with pytest.raises(RecordingError, match=rf"{path.name} cannot be read: expected a regular file"):
            read_regular(path)
    assert read_regular(tmp_path / "secret") == b"secret" and is_regular(tmp_path / "secret")
    assert not is_regular(tmp_path / "none")


def test_a_pipe_that_takes_a_files_place_is_refused_and_not_waited_for(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "a.jsonl")
    (tmp_path / "b.jsonl").write_text("")
    regular = (tmp_path / "b.jsonl").stat()
    monkeypatch.setattr(type(tmp_path), "lstat", lambda self: regular)
    with pytest.raises(RecordingError, match="a regular file"):
        read_regular(tmp_path / "a.jsonl")


def test_a_file_that_is_too_large_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "MOST_BYTES", 10)
    (tmp_path / "a.jsonl").write_bytes(b"x" * 10)
    assert len(read_regular(tmp_path / "a.jsonl")) == 10
    (tmp_path / "a.jsonl").write_bytes(b"x" * 11)
    with pytest.raises(RecordingError, match="is too large: expected 10 bytes or fewer, got 11"):
        read_regular(tmp_path / "a.jsonl")
