"""Rooms in which an experimenter varies something: what comes into force when, who sees what, and what is written."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.commands import as_followed
from swarm_pz.play.factors import Factors
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, SeatLine
from swarm_pz.play.recordings.moment import Moment
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from swarm_pz.play.shared import mixture
from tests.play.server.test_room import (
    CALM,
    Client,
    Here,
    Workers,
    code_of,
    give,
    opened,
    playing,
    read,
    running,
    seated,
    until,
)

NONE = Factors()
CORNER, RIM = np.zeros((10, 10)), np.ones((10, 10))
CORNER[0, 0], RIM[1:9, 1:9] = 1.0, 0.0


def varied(red=NONE, blue=NONE, **more):
    return CALM.replace(factors=(red, blue), **more)


def phase(client):
    return client.heard(protocol.RoomState)[-1].phase


def command(number, density=CORNER):
    return protocol.CommandMessage(number, density=density.tolist())


def test_only_the_seat_that_is_varied_sees_less_and_its_end_comes_later(tmp_path):
    async def play():
        table = varied(Factors(display_delay_ms=150.0, hide=("opponents", "target")), game=TableConfig().game)
        with opened(tmp_path, table=table, time_limit=1.0, speed=2.0) as room:
            red, blue = await running(room)
            watcher = Client()
            room.watch(watcher)
            give(room, red, command(1))
            await until(lambda: phase(blue) == "over")
            before = phase(red)
            await until(lambda: phase(red) == "over")
            return red, blue, watcher, before, read(room)

    red, blue, watcher, before, recording = asyncio.run(play())
    assert before == "playing" and len(red.frames) == len(blue.frames) == 30
    shown = [decode_frame(frame) for frame, _ in red.frames]
    assert {frame.hidden for frame in shown} == {1} and np.isnan(shown[-1].positions[shown[-1].teams == 1]).all()
    assert [frame.tick for frame in shown] == [*range(1, 31)]
    for other in (blue, watcher):
        frames = [decode_frame(frame) for frame, _ in other.frames]
        assert all(frame.hidden is None and np.isfinite(frame.positions).all() for frame in frames)
    assert not [data for data in red.bytes if data[0] == 2] and [data for data in blue.bytes if data[0] == 2]
    told = red.heard(protocol.Seated)[0].factors
    assert told == protocol.SeatFactors(hide=["opponents", "target"]) and blue.heard(protocol.Seated)[0].factors is None
    display = recording.end.delays[0].display
    assert display.asked_ms == 150.0 and display.count > 0 and display.got_ms >= 149.0
    assert recording.end.delays[1].display.asked_ms == 0.0
    assert Playback(recording).verify().verified


def test_who_comes_back_is_shown_the_game_as_before(tmp_path):
    async def play():
        with opened(
            tmp_path, table=varied(Factors(display_delay_ms=30.0, hide=("opponents",))), time_limit=None
        ) as room:
            red, _ = await running(room)
            seat = room.seats[0]
            room.disconnect(red)
            again = Client()
            room.resume(again, seat)
            await until(lambda: len(again.frames) > 2)
            shown = len(red.frames)
            await asyncio.sleep(0.1)
            assert len(red.frames) == shown, "what was on its way to a lost connection is lost with it"
            return again

    again = asyncio.run(play())
    assert all(decode_frame(data).hidden == 1 for data, _ in again.frames)
    assert decode_frame(next(data for data in again.bytes if data[0] == 1)).hidden == 1, "the first picture, too"


def test_a_room_without_factors_writes_what_it_always_wrote(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, _ = await running(room)
            room.stop()
            assert red.heard(protocol.Seated)[0].factors is None
            return read(room), room.session.delays()

    recording, delays = asyncio.run(play())
    assert recording.end.delays is None and delays[0]["command"] == {"asked_ms": 0.0, "got_ms": None, "count": 0}


def test_a_game_goes_by_its_speed_and_no_faster(tmp_path):
    async def play():
        with opened(tmp_path, table=varied(Factors(speed=0.25), Factors(speed=0.25)), time_limit=None) as room:
            await running(room)
            await until(lambda: room.session.game.tick >= 5)
            room.stop()
            return read(room).end

    end = asyncio.run(play())
    assert end.ms >= 1000.0 * end.tick / 30 / 0.25 - 1.0


def test_a_game_that_is_taken_over_is_played_without_them_but_by_its_clock(tmp_path):
    async def play():
        late = Factors(command_delay_ms=50.0, hide=("opponents",), speed=2.0)
        with opened(tmp_path, table=varied(late), time_limit=None) as room:
            await running(room)
            await until(lambda: room.session.game.tick > 9)
            room.stop()
            path = room.session.recorder.path
        replay = ReplaySession(Here(LoadedRecording.read(path)), Client())
        moment = await replay.moment()
        replay.close()
        assert isinstance(moment, Moment)
        with opened(tmp_path, moment=moment) as room:
            assert not room.config.varies and room.config.speed == 2.0

    asyncio.run(play())


# --- shared control -------------------------------------------------------------------------------

HELPED = Factors(share=0.25, helper="two")


async def helped(room):
    """Begin a game of two people, of whom red has a helper; return them."""
    red, blue = seated(room, "red", "blue")
    room.ready(red, True)
    room.ready(blue, True)
    await playing(room)
    return red, blue


def test_a_shared_command_is_mixed_recorded_and_shown_as_such(tmp_path):
    answers = iter([RIM, RIM, np.ones((10, 10))])

    async def answer(seat):
        latest.append(next(answers, np.ones((10, 10))))
        return latest[-1]

    async def play():
        table = varied(HELPED, min_command_interval=0.0)
        with opened(tmp_path, Workers(answer), table, time_limit=None) as room:
            red, blue = await helped(room)
            await until(lambda: room.session.game.tick > 3)
            give(room, red, command(1))
            await until(lambda: room.session.game.tick > 45)
            await until(lambda: len(red.heard(protocol.InForceMessage)) > 2)
            assert not blue.heard(protocol.InForceMessage)
            room.stop()
            return read(room), red

    latest = []
    recording, red = asyncio.run(play())
    assert red.heard(protocol.Seated)[0].factors == protocol.SeatFactors(helper="two", share=0.25)
    flown = [command for _, command in recording.in_force()]
    assert {one.sender for one in flown} == {"shared:two"} and [one.number for one in flown] == [0, 1, 1]
    for one, (own, helpers) in zip(
        flown, [(np.ones((10, 10)), RIM), (CORNER, RIM), (CORNER, np.ones((10, 10)))], strict=True
    ):
        np.testing.assert_array_equal(one.values, mixture(own, as_followed(helpers), 0.25))
    assert [line.number for line in recording.of(CommandLine) if not line.sender] == [1], (
        "the player's own stands there"
    )
    shown = [data for data in red.bytes if data[0] == 2]
    assert shown[-1] != shown[0] and shown[-1][4] == 1, "of what both make, by the number of the player's"
    row = seat_rows(recording)[0]
    assert (row.commands, row.automatic_commands) == (1, 0) and row.first_command_s > 0.0
    assert Playback(recording).verify().verified


def test_a_game_waits_for_the_helper_and_one_that_cannot_play_is_named(tmp_path):
    async def play():
        there = asyncio.Event()

        async def loading(seat):
            await there.wait()
            if faults:
                raise PolicyError(faults[0])

        for faults in ([], ["no idea"]):
            there.clear()
            with opened(tmp_path, Workers(loading=loading), varied(HELPED), time_limit=None) as room:
                red, blue = seated(room, "red", "blue")
                assert red.messages[-1].red.policy_state == "loading" and red.messages[-1].red.name == ""
                room.ready(red, True)
                room.ready(blue, True)
                assert room.phase == "waiting"
                there.set()
                if not faults:
                    await playing(room)
                    continue
                await until(lambda: room.seats[0].policy_state == "failed")
                with pytest.raises(Exception, match="two cannot play: no idea"):
                    room.ready(red, True)

    asyncio.run(play())


def test_a_helper_that_fails_keeps_its_share_and_the_room_says_so(tmp_path):
    async def answer(seat):
        if len(asked) > 1:
            raise PolicyError("lost")
        asked.append(seat)
        return RIM if len(asked) == 1 else CORNER

    async def play():
        with opened(tmp_path, Workers(answer), varied(HELPED), time_limit=None) as room:
            red, _ = await helped(room)
            await until(lambda: red.heard(protocol.Notice))
            give(room, red, command(1))
            await until(lambda: any(message.number == 1 for message in red.heard(protocol.InForceMessage)))
            room.stop()
            return read(room), red.heard(protocol.Notice)[0].text

    asked = []
    recording, notice = asyncio.run(play())
    assert notice == "two keeps its last share of the command: lost"
    assert [line.team for line in recording.of(SeatLine) if line.event == "failed"][:1] == [0]
    np.testing.assert_array_equal(recording.in_force()[-1][1].values, mixture(CORNER, CORNER, 0.25))
    assert Playback(recording).verify().verified


def test_a_shared_seat_is_a_players_without_automatic_responses(tmp_path):
    async def play():
        with opened(tmp_path, table=varied(HELPED)) as room:
            assert code_of(room.place_policy, "red", "one") == "not_valid"
            (red,) = seated(room, "red")
            assert code_of(room.respond, red, [object()]) == "not_valid"
            room.respond(red, [])
            workers = room._context.workers
            await until(lambda: workers.loaded)
            room.leave(red)
            assert workers.forgotten == workers.loaded, "its helper goes with the player"

    asyncio.run(play())


def test_a_seat_that_takes_no_densities_cannot_be_shared(tmp_path):
    table = TableConfig(game=GameConfig(), factors=(HELPED, NONE))
    with (
        pytest.raises(Exception, match="red cannot share its command with two"),
        opened(tmp_path, table=table, red_system="flocking"),
    ):
        pass
