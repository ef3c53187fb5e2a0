from __future__ import annotations

from pathlib import Path

import pytest

from swarm_pz.errors import OutputError
from swarm_pz.files import check_file, check_folder, draft_of


def write_and_fail(path, fail):
    with draft_of(path) as draft:
        draft.write_text("half")
        fail()


def interrupt():
    raise KeyboardInterrupt


def test_a_file_is_whole_or_not_there(tmp_path):
    path = tmp_path / "new folder" / "a.txt"
    with draft_of(path) as draft:
        draft.write_text("first")
        assert not path.exists()
        assert draft.suffix == ".txt"
    with pytest.raises(KeyboardInterrupt):
        write_and_fail(path, interrupt)
    assert [(file.name, file.read_text()) for file in path.parent.iterdir()] == [("a.txt", "first")]


def test_a_full_disk_is_named_with_the_file_and_nothing_is_lost(tmp_path):
    """The system's own error neither names the file nor says what became of the old one."""
    path = tmp_path / "a.txt"
    path.write_text("first")
    with pytest.raises(OutputError, match=r"/a\.txt': the disk is full, with 4 bytes of the file written"):
        write_and_fail(path, lambda: Path("/dev/full").write_text("the other half"))
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("a.txt", "first")]


def test_a_link_in_the_place_of_a_draft_is_not_written_through(tmp_path):
    (tmp_path / "precious").write_text("precious")
    (tmp_path / ".a.draft.txt").symlink_to(tmp_path / "precious")
    with draft_of(tmp_path / "a.txt") as draft:
        draft.write_text("first")
    assert (tmp_path / "precious").read_text() == "precious"
    assert (tmp_path / "a.txt").read_text() == "first" and not (tmp_path / "a.txt").is_symlink()
    (tmp_path / ".a.draft.txt").mkdir()
    with pytest.raises(OutputError, match=r"cannot write .*a\.txt"), draft_of(tmp_path / "a.txt"):
        pass


def test_what_cannot_be_written_is_said_in_words(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="got the folder"):
        check_file(tmp_path)
    for path in (tmp_path / "file" / "a.txt", tmp_path / "file" / "deeper" / "a.txt"):
        with pytest.raises(OutputError, match=r"file' is a file"):
            check_file(path)
    with pytest.raises(OutputError, match="file name too long"):
        check_folder(tmp_path / ("x" * 300))
    monkeypatch.setattr("os.access", lambda path, mode: path not in (tmp_path, tmp_path / "file"))
    with pytest.raises(OutputError, match=f"no permission to write in '{tmp_path}'"):
        check_file(tmp_path / "a" / "b.txt")
    monkeypatch.setattr("os.access", lambda path, mode: path != tmp_path / "file")
    with pytest.raises(OutputError, match="read-only"), draft_of(tmp_path / "file"):
        raise AssertionError("the work has begun")
