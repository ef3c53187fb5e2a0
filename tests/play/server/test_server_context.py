"""Late clocks, and the recording to which a token leads after a restart."""

import os
from types import SimpleNamespace

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.server import server_context
from swarm_pz.play.server.server_context import NAME, GameClock, Punctuality, SeatIndex
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import playing

pytestmark = pytest.mark.anyio


async def test_ticks_are_caught_up_two_at_a_time_and_then_time_slips(monkeypatch):
    now = [100.0]

    async def sleep(seconds):
        now[0] += seconds

    loop = SimpleNamespace(get_running_loop=lambda: SimpleNamespace(time=lambda: now[0]), sleep=sleep)
    monkeypatch.setattr(server_context, "asyncio", loop)
    punctuality, period = Punctuality(), 1 / 60
    clock = GameClock(2.0, punctuality)
    assert [await clock.due() for _ in range(3)] == [1, 1, 1] and now[0] == pytest.approx(100.0 + 3 * period)
    now[0] += 2.5 * period
    assert [await clock.due() for _ in range(3)] == [2, 1, 1] and punctuality.slipped == 0
    now[0] += 15 * period
    assert await clock.due() == 2 and punctuality.slipped == 1
    late = now[0]
    assert await clock.due() == 1 and now[0] == pytest.approx(late + period)


@pytest.mark.parametrize("is_kept", [True, False])
async def test_who_comes_back_after_a_restart_is_sent_the_recording(is_kept, tmp_path):
    hall = Hall(tmp_path)
    guest = Guest(hall)
    guest.say(protocol.Create(opponent="ring"))
    (seated,) = guest.heard(protocol.Seated)
    guest.say(protocol.Ready())
    await playing(hall.room())
    path = hall.room().session.recorder.path
    assert hall.recording_of(seated.token) is None, "what a player draws is not for others while they play"
    hall.close()
    if not is_kept:
        path.unlink()
    with (tmp_path / NAME).open("a") as file:
        file.write("half a li")
    (refused,) = Guest(Hall(tmp_path), seated.token).heard(protocol.Refused)
    assert (refused.code, refused.about) == ("unknown", "hello")
    assert refused.recording == (path.name if is_kept else None) and (path.name in refused.reason) == is_kept
    SeatIndex(tmp_path).note("f" * 32, "b.jsonl")
    assert SeatIndex(tmp_path).recording_of("f" * 32) == "b.jsonl", "the torn line before it does no harm"
    assert seated.token not in (tmp_path / NAME).read_text()


@pytest.mark.parametrize("how", ["link", "pipe"])
def test_an_index_that_is_no_file_is_not_written_and_delays_no_game(how, tmp_path):
    path, elsewhere = tmp_path / NAME, tmp_path / "elsewhere"
    elsewhere.write_text("mine\n")
    path.symlink_to(elsewhere) if how == "link" else os.mkfifo(path)
    index = SeatIndex(tmp_path)
    index.note("f" * 32, "a.jsonl")
    assert index.recording_of("f" * 32) == "a.jsonl" and elsewhere.read_text() == "mine\n"
