"""The recording to which a seat's token leads once its room is closed."""

import pytest

from swarm_pz.play import protocol
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import playing

pytestmark = pytest.mark.anyio


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
