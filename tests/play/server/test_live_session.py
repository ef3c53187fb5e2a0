"""A game in real time: when policies are asked, what is recorded, how it ends, and how faults are handled."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import FrameMessage, SeatCommand, SeatMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.server.test_room import (
    EYE,
    Client,
    Workers,
    give,
    opened,
    read,
    running,
    starting,
    ticks,
    until,
    watched,
)


async def test_policies_are_asked_once_a_command_period_and_only_when_they_have_answered(tmp_path):
    answered = asyncio.Event()

    async def answer(seat):
        if seat.team == RED and periods(RED)[-1] > 0:
            await answered.wait()
        return np.full((10, 10), 1.0) + np.eye(10) * seat.team / 3

    def periods(team):
        return [tick // 15 for seat, tick in workers.asked if seat.team == team]

    workers, table = Workers(answer), TableConfig(game=GameConfig(command_period=0.5))
    with opened(tmp_path, workers, table, speed=2.0, time_limit=None) as room:
        watched(room)
        await until(lambda: len(periods(BLUE)) == 4)
        assert periods(RED) == [0, 1] and periods(BLUE) == [0, 1, 2, 3]
        answered.set()
        await until(lambda: len(read(room).of(SeatCommand)) >= 8)
        assert periods(RED) == [0, 1, 4] and periods(BLUE) == [0, 1, 2, 3, 4]
        config, seed, lines = room.plan.config, read(room).header.seed, read(room).of(SeatCommand)
    assert {(line.team, line.number) for line in lines} == {(0, 1), (0, 2), (0, 3), *((1, n) for n in range(1, 6))}
    assert all(line.density[0][1] == (1.0 if line.team == RED else 0.75) for line in lines)
    assert all((seat.policy, seat.game) == (("one", "two")[seat.team], config.game) for seat, _ in workers.asked)
    assert {(stream.entropy, stream.spawn_key) for stream in workers.seeds.values()} == {(seed, (0,)), (seed, (1,))}
    both = sorted({seat.key for seat, _ in workers.asked})
    assert len(both) == 2 and sorted(workers.paused) == sorted(workers.forgotten) == both, "both, once, at the end"


async def test_a_policy_that_fails_keeps_its_last_command_and_the_room_says_so(tmp_path):
    async def answer(seat):
        if len(workers.asked) > 2:
            raise PolicyError("no idea") if seat.team == RED else RuntimeError("oh")
        return np.eye(10)

    workers, table = Workers(answer), TableConfig(game=GameConfig(command_period=0.2))
    with opened(tmp_path, workers, table, time_limit=None) as room:
        client = watched(room)
        await until(lambda: len(client.notices) >= 2)
        notices = ["one keeps its last command: no idea", "two keeps its last command: it could not be asked"]
        assert sorted(client.notices[:2]) == notices
        await ticks(room, room.session.game.tick + 3)
        recording = read(room)
    assert {line.team for line in recording.of(SeatMessage) if line.event == "failed"} == {0, 1}
    assert len(recording.of(SeatCommand)) == 2


# --- what is written ------------------------------------------------------------------------------


async def test_a_command_tells_its_tick_and_what_was_played_is_in_the_file_after_half_a_second(tmp_path):
    with opened(tmp_path, speed=2.0, time_limit=None) as room:
        red, _ = await running(room)
        played = []
        for number in (1, 2, 3):
            await ticks(room, 7 * number)
            played.append(room.session.game.tick)
            give(room, red, protocol.CommandMessage(number, density=EYE))
        assert Recording.read(room.session.recorder.path).last_tick >= 15
        room.stop()
        recording = read(room)
    assert [line.tick for line in recording.of(SeatCommand)] == played
    assert Playback(recording).verify().verified


async def test_a_recording_that_breaks_off_is_told_of_once_and_the_game_goes_on(tmp_path):
    with opened(tmp_path, speed=2.0, time_limit=None) as room:
        red, _ = await running(room)
        room.session.recorder.fault = "the recording breaks off: No space left on device"
        await ticks(room, room.session.game.tick + 31)
        assert red.notices == ["the recording breaks off: No space left on device"]


# --- how it ends ----------------------------------------------------------------------------------


async def test_a_game_runs_to_its_last_tick_and_its_end_is_the_end(tmp_path):
    with opened(tmp_path, red=3, blue=4, time_limit=1.0, speed=2.0, majority=True, seed=0) as room:
        red, _ = await running(room)
        await until(lambda: room.phase == "over")
        room.stop()
        await asyncio.sleep(0.1)
        recording, sizes, state = read(room), room.session.sizes, red.messages[-1]
    assert [sequence for _, sequence in red.frames] == [*range(red.frames[0][1], red.frames[0][1] + 30)]
    with_fields = [frame[1] & 2 > 0 for frame, _ in red.frames]
    assert [sum(with_fields[i : i + 3]) for i in range(0, 30, 3)] == [1] * 10, "at every solve"
    assert (state.phase, state.outcome, state.recording, state.sizes) == ("over", "blue", recording.name, sizes)
    assert (recording.end.outcome, recording.end.tick, recording.end.sizes) == ("blue", 30, sizes[-1])
    assert recording.end.ended_by == "time"
    assert [line.tick for line in recording.of(FrameMessage)] == [*range(0, 31, 3)]
    assert Playback(recording).verify().verified and len(sizes) == 2


def meddle(room, tick, change):
    """Change a game's teams at a tick, as captures would."""
    game = room.session.game
    advance = game.advance

    def advance_and_change():
        events = advance()
        if game.tick == tick:
            change(game.simulator.games.teams[0])
        return events

    game.advance = advance_and_change


async def test_who_has_every_drone_has_won_the_game(tmp_path):
    with opened(tmp_path, table=TableConfig(), red=4, blue=6, speed=2.0, time_limit=None) as room:
        red, _ = starting(room)
        meddle(room, 30, lambda teams: np.copyto(teams, [RED] * 3 + [BLUE] * 7))
        meddle(room, 31, lambda teams: teams.fill(BLUE))
        await until(lambda: room.phase == "over")
        recording, announced, last = read(room), room.outcome, decode_frame(red.frames[-1][0])
        assert room.session.sizes == [(4, 6), (3, 7)], "once a second"
    assert last.tick == 31 and last.fields is not None and (last.teams == BLUE).all(), "the end is shown whole"
    assert recording.of(FrameMessage)[-1].tick == 31
    assert announced == recording.end.outcome == "blue" and recording.end.ended_by == "capture"
    assert recording.end.sizes == (0, 10)


async def test_a_fault_of_the_server_stops_the_game_and_is_told(tmp_path):
    with opened(tmp_path, time_limit=None) as room:
        red, _ = await running(room)
        room.session.game.advance = None
        await until(lambda: room.phase == "over")
        assert red.notices == ["this game was stopped by a fault of the server"]
        end = read(room).end
    assert (end.outcome, end.ended_by) == ("stopped", "server")


@pytest.mark.parametrize(
    ("happens", "ended_by"),
    [
        (lambda room, red, blue: room.leave(red), "left"),
        (lambda room, red, blue: (room.disconnect(blue), room.resume(blue, room.seats[1])), "server"),
        (lambda room, red, blue: (room.resume(Client(), room.seats[1]), room.disconnect(blue)), "server"),
    ],
)
async def test_a_game_that_somebody_left_says_so_and_shows_no_more_once_it_is_stopped(happens, ended_by, tmp_path):
    with opened(tmp_path, time_limit=None, lesson=ended_by == "left") as room:
        red, blue = await running(room)
        happens(room, red, blue)
        room.stop()
        shown = len(red.frames)
        await asyncio.sleep(0.05)
        assert len(red.frames) == shown
        recording = read(room)
    assert (recording.end.outcome, recording.end.ended_by) == ("stopped", ended_by)
    assert not Playback(recording).verify().faults and recording.header.lesson == (ended_by == "left")
