"""A late clock, and the recording to which a token leads once its room is closed."""

from types import SimpleNamespace

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.server import server_context
from swarm_pz.play.server.server_context import GameClock, Punctuality
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
async def test_who_comes_back_after_their_room_was_closed_is_sent_the_recording(is_kept, tmp_path):
    hall = Hall(tmp_path)
    guest = Guest(hall)
    guest.say(protocol.Create(opponent="ring"))
    (seated,) = guest.heard(protocol.Seated)
    guest.say(protocol.Ready())
    await playing(hall.room())
    path = hall.room().session.recorder.path
    assert hall.recording_of(seated.token) is None, "what a player draws is not for others while they play"
    hall.close_room(hall.room())
    path.touch() if is_kept else path.unlink(missing_ok=True)
    (refused,) = Guest(hall, seated.token).heard(protocol.Refused)
    assert (refused.code, refused.about) == ("unknown", "hello")
    assert refused.recording == (path.name if is_kept else None) and (path.name in refused.reason) == is_kept
    hall.close()
