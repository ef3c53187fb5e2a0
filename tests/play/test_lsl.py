"""Markers over Lab Streaming Layer, read back by a real inlet."""

import asyncio
import json
import os
import subprocess
import sys

import numpy as np
import pylsl
import pytest

from swarm_pz.cli import main
from swarm_pz.config import TEAM_NAMES, CaptureConfig, GameConfig
from swarm_pz.play.game import TableConfig
from swarm_pz.play.lsl import Markers
from swarm_pz.play.recordings.format import CapturedLine, ClockLine, EndLine, InForceLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from tests.play.server.test_live_session import watched
from tests.play.server.test_room import Workers, opened, read, until

WAIT_S = 60.0


@pytest.fixture
def stream(request):
    """Give markers, and an inlet that receives them."""
    markers = Markers(request.node.name)
    info = pylsl.resolve_byprop("name", request.node.name, 1, WAIT_S)[0]
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(WAIT_S)
    yield markers, inlet
    inlet.close_stream()


def pulled(inlet, last="end"):
    """Return markers and their times up to the last one."""
    found = []
    while not found or found[-1][0]["event"] != last:
        sample, time = inlet.pull_sample(WAIT_S)
        assert sample is not None, f"no marker came after {found}"
        found.append((json.loads(sample[0]), time))
    return found


def test_a_game_is_told_in_order_and_its_clock_is_that_of_the_recording(stream, tmp_path):
    markers, inlet = stream

    async def answer(seat):
        density = np.zeros((10, 10))
        density[len(room._context.workers.asked) % 10, 5] = 1.0
        return density

    async def play():
        nonlocal room
        game = GameConfig(capture=CaptureConfig(threshold=0.3), command_period=0.5)
        table = TableConfig(game=game)
        with opened(tmp_path, Workers(answer), table, markers=markers, speed=2.0, time_limit=5.0) as room:
            watched(room)
            await until(lambda: room.phase == "over")
            return read(room), room.session.recorder.path.stem

    room = None
    recording, name = asyncio.run(play())
    found = pulled(inlet)
    assert {marker["game"] for marker, _ in found} == {name}
    assert [time for _, time in found] == sorted(time for _, time in found)
    assert found[0][0] == {"event": "start", "game": name, "tick": 0, "red": "one", "blue": "two"}
    told = []
    for line in recording.events:
        if isinstance(line, InForceLine):
            told.append(("command", line.tick, TEAM_NAMES[line.team], line.number))
        elif isinstance(line, CapturedLine):
            told.append(("capture", line.tick, TEAM_NAMES[line.team], line.drone))
        elif isinstance(line, EndLine):
            told.append(("end", line.tick, line.outcome, line.ended_by))
    keys = {"command": ("side", "number"), "capture": ("side", "drone"), "end": ("outcome", "ended_by")}
    heard = [(one["event"], one["tick"], *(one[key] for key in keys[one["event"]])) for one, _ in found[1:]]
    assert heard == told
    assert {one[0] for one in told} == {"command", "capture", "end"}
    first, last = recording.of(ClockLine)
    assert first.clock == "lsl" and first.ms < last.ms and 0.0 <= first.uncertainty_ms < 1000.0
    for line, (_, time) in zip(
        recording.of(InForceLine), [one for one in found if one[0]["event"] == "command"], strict=True
    ):
        assert abs(time - first.seconds - (line.ms - first.ms) / 1000.0) < 1.0
    assert Playback(recording).verify().faults == ()
    assert {row.outcome for row in seat_rows(recording)} <= {"win", "loss", "draw"}


def test_two_clocks_are_compared_where_their_readings_are_closest_together(monkeypatch):
    """LSL's clock is 5 s ahead; readings are 10 ms apart, but for those of the eighth time."""
    begun = [(100.0 * number, 2.0 if number == 7 else 10.0) for number in range(20)]
    ours = iter([ms for before, width in begun for ms in (before, before + width)])
    theirs = iter([5.0 + (before + width / 2.0) / 1000.0 for before, width in begun])
    markers = Markers("clocks")
    monkeypatch.setattr(pylsl, "local_clock", lambda: next(theirs))
    line = markers.clock(lambda: next(ours))
    assert (line.clock, line.ms, line.seconds, line.uncertainty_ms) == ("lsl", 701.0, 5.701, 1.0)


def test_an_automatic_command_says_whose_it_is(stream):
    markers, inlet = stream
    for sender in ("", "shared:ring"):
        markers.note("a", InForceLine(team=1, number=2, tick=3, ms=100.0, sender=sender))
    markers.note("a", EndLine(outcome="red", tick=4, sizes=(2, 0), ms=133.0, ended_by="capture"))
    told = {"event": "command", "game": "a", "tick": 3, "side": "blue", "number": 2}
    assert [marker for marker, _ in pulled(inlet)][:2] == [told, told | {"by": "shared:ring"}]


def test_a_missing_library_says_what_to_do(tmp_path):
    code = "from swarm_pz.play.lsl import Markers; Markers()"
    (tmp_path / "none.so").write_text("no library")
    ended = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code],
        env=dict(os.environ, PYLSL_LIB=str(tmp_path / "none.so")),
        capture_output=True,
        text=True,
        check=False,
    )
    assert "MissingExtraError: pylsl found no liblsl that works here" in ended.stderr
    assert "name its file in the variable PYLSL_LIB" in ended.stderr


def test_who_records_goes_on_when_the_server_is_started_again():
    first, second = Markers("again"), Markers("again")
    assert len({markers._outlet.get_info().source_id() for markers in (first, second)}) == 1


def test_a_library_that_breaks_ends_no_game(caplog):
    markers = Markers("broken")

    class Broken:
        def push_sample(self, *_):
            raise RuntimeError("the stream is lost")

    markers._outlet = Broken()
    markers.note("P01.block1.game1", CapturedLine(team=0, drone=1, tick=2))
    assert "has not taken the marker" in caplog.text and "P01.block1.game1" in caplog.text


def test_the_command_takes_one_name_or_none(capsys):
    with pytest.raises(SystemExit):
        main(["play", "--lsl", "one", "two", "--port", "0"])
    assert "lsl must be one name, or none" in capsys.readouterr().err
