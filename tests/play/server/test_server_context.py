"""What leads from a token to its recorded game, also after the server was started anew."""

import asyncio
import os

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.server.server_context import NAME, SeatIndex
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import playing


def test_a_seats_latest_game_is_known_to_the_next_server_and_its_token_is_not(tmp_path):
    index, token = SeatIndex(tmp_path), "0123456789abcdef" * 2
    index.note(token, "a.jsonl")
    index.note(token, "b.jsonl")
    with (tmp_path / NAME).open("a") as file:
        file.write("half a li")
    again = SeatIndex(tmp_path)
    assert again.recording_of(token) == "b.jsonl" and again.recording_of("f" * 32) is None
    again.note("e" * 32, "c.jsonl")
    assert SeatIndex(tmp_path).recording_of("e" * 32) == "c.jsonl", "what broke off before it takes nothing with it"
    assert token not in (tmp_path / NAME).read_text()


@pytest.mark.parametrize("how", ["link", "pipe", "pipe that nobody reads"])
def test_an_index_that_cannot_be_written_is_no_fault_of_the_game_and_nothing_is_written_elsewhere(
    how, tmp_path, caplog
):
    path, elsewhere = tmp_path / NAME, tmp_path / "elsewhere"
    elsewhere.write_text("mine\n")
    if how == "link":
        path.symlink_to(elsewhere)
    else:
        os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK) if how == "pipe" else None
    index = SeatIndex(tmp_path)
    index.note("f" * 32, "a.jsonl")
    assert index.recording_of("f" * 32) == "a.jsonl" and "was not written" in caplog.text
    assert elsewhere.read_text() == "mine\n"
    if reader is not None:
        assert os.read(reader, 100) == b""
        os.close(reader)


@pytest.mark.parametrize("is_kept", [True, False])
def test_who_comes_back_after_a_restart_is_told_their_recording(is_kept, tmp_path):
    async def play():
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
        back = Guest(Hall(tmp_path), seated.token)
        return path.name, back.heard(protocol.Refused)

    name, (refused,) = asyncio.run(play())
    assert (refused.code, refused.about) == ("unknown", "hello")
    assert refused.recording == (name if is_kept else None) and (name in refused.reason) == is_kept
