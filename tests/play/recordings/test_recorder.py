"""A game is written down: whole lines in order, whatever the disk does."""

import os
import threading

import pytest

from swarm_pz.play.protocol import EndMessage, SeatMessage
from swarm_pz.play.recordings import recorder as module
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.recordings.recording import Recording
from tests.play.recordings.games import CONFIG, header

SEAT = SeatMessage("red", "connected", 0.0)
END = EndMessage("stopped", 0, (4, 4), 1.0, "server")


class Disk:
    """A file on a disk with `room` bytes left; None is no limit."""

    def __init__(self, file):
        self.file, self.room = file, 0
        self.fileno, self.close = file.fileno, file.close

    def write(self, data):
        if self.room is None:
            return self.file.write(data)
        if not self.room:
            raise OSError(28, "No space left on device")
        taken = self.file.write(bytes(data[: self.room]))
        self.room -= taken
        return taken


@pytest.fixture
def begun(tmp_path, monkeypatch):
    """Give a recorder, and its disk that is full from now on."""
    monkeypatch.setattr(module, "_LAST_PAUSE_S", 0.001)
    recorder = Recorder(tmp_path / "a.jsonl", header(CONFIG, 1, "ring"))
    recorder.flush()
    recorder._file = Disk(recorder._file)
    yield recorder, recorder._file
    recorder.close()
    recorder.join()


def test_a_recorder_begins_a_file_of_its_own_when_it_first_writes_and_adds_nothing_once_it_is_closed(tmp_path):
    path = tmp_path / "deep" / "er" / "a.jsonl"
    recorder = Recorder(path, header(CONFIG, 1, "ring"))
    assert not path.parent.exists()
    recorder.flush()
    assert Recording.read(path).header.seed == 1
    (tmp_path / "link.jsonl").symlink_to(tmp_path / "elsewhere")
    for taken in (path, tmp_path / "link.jsonl"):
        with pytest.raises(FileExistsError):
            Recorder(taken, header(CONFIG, 2, "ring")).flush()
    recorder.write(SEAT)
    recorder.close()
    recorder.write(END)
    recorder.close()
    assert Recording.read(path).log == [SEAT] and not recorder.fault


@pytest.mark.parametrize("room", [0, 100])
def test_what_a_full_disk_did_not_take_is_written_when_there_is_room_again(begun, room):
    recorder, disk = begun
    disk.room = room
    for _ in range(3):
        recorder.write(SEAT)
        recorder.flush()
    assert "no space left" in recorder.fault and "the game goes on" in recorder.fault
    assert Recording.read(recorder.path).end is None, "half a line is none"
    disk.room, recorder.fault = None, ""
    recorder.flush()
    assert Recording.read(recorder.path).log == [SEAT] * 3
    disk.room = 0
    recorder.write(END)
    recorder.flush()
    assert "the game goes on" in recorder.fault, "of each time that the disk is full players are told"
    disk.room = None
    recorder.close()
    assert Recording.read(recorder.path).log == [SEAT] * 3 + [END] and recorder.written


def test_the_end_of_a_game_is_written_though_the_disk_was_full_when_it_came(begun, monkeypatch):
    recorder, disk = begun
    monkeypatch.setattr(module.time, "sleep", lambda seconds: setattr(disk, "room", None))
    recorder.write(SEAT)
    recorder.write(END)
    recorder.close()
    recorder.join()
    assert Recording.read(recorder.path).log == [SEAT, END]


def test_a_disk_that_stays_full_ends_the_recording_and_not_the_game(begun, caplog):
    recorder, _ = begun
    for _ in range(module._PATIENCE + 2):
        recorder.write(SEAT)
        recorder.flush()
    assert "breaks off" in recorder.fault and "no space left" in recorder.fault
    recorder.join()
    assert "a.jsonl lacks its end" in caplog.text
    assert Recording.read(recorder.path).log == []


def test_file_and_folder_are_on_the_disk_when_a_game_has_ended_and_no_event_loop_waits(tmp_path, monkeypatch):
    synced = []

    def sync(file):
        synced.append((os.fstat(file).st_ino, threading.current_thread() is threading.main_thread()))

    monkeypatch.setattr(module.os, "fsync", sync)
    recorder = Recorder(tmp_path / "a.jsonl", header(CONFIG, 1, "ring"))
    recorder.write(SEAT)
    recorder.flush()
    assert not synced
    recorder.close()
    recorder.join()
    assert synced == [(path.stat().st_ino, False) for path in (recorder.path, tmp_path)]
