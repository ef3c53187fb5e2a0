"""A game in real time: when policies are asked, what is written, how it ends, and what its faults do."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, FrameLine
from swarm_pz.play.recordings.playback import Playback
from tests.play.server.test_room import Client, Workers, opened, playing, read, running, starting, until


def watched(room):
    """Begin a game of two policies, and return who watches it."""
    client = Client()
    room.watch(client)
    room.place_policy("red", "one")
    room.place_policy("blue", "two")
    room.ready(client, True)
    return client


def test_policies_are_asked_once_a_command_period_and_only_when_they_have_answered(tmp_path):
    async def play():
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
            await until(lambda: len(read(room).of(CommandLine)) >= 8)
            assert periods(RED) == [0, 1, 4] and periods(BLUE) == [0, 1, 2, 3, 4]
            config, seed = room.config, read(room).header.seed
            lines = read(room).of(CommandLine)
        return config, seed, workers, lines

    config, seed, workers, lines = asyncio.run(play())
    assert {(line.team, line.number) for line in lines} == {(0, 1), (0, 2), (0, 3), *((1, n) for n in range(1, 6))}
    assert all(line.density[0][1] == (1.0 if line.team == RED else 0.75) for line in lines)
    for seat, _ in workers.asked:
        assert (seat.policy, seat.game) == (("one", "two")[seat.team], config.game)
    assert {(stream.entropy, stream.spawn_key) for stream in workers.seeds.values()} == {(seed, (0,)), (seed, (1,))}
    both = sorted({seat.key for seat, _ in workers.asked})
    assert len(both) == 2 and sorted(workers.paused) == sorted(workers.forgotten) == both, "both, once, at the end"


@pytest.mark.parametrize(
    ("fault", "reason"), [(PolicyError("no idea"), "no idea"), (RuntimeError("oh"), "it could not be asked")]
)
def test_a_policy_that_cannot_be_asked_is_told_of(fault, reason, tmp_path):
    async def answer(seat):
        raise fault

    async def play():
        with opened(tmp_path, Workers(answer), time_limit=None) as room:
            client = watched(room)
            await until(lambda: len(client.heard(protocol.Notice)) == 2)
            await playing(room)
            return [message.text for message in client.heard(protocol.Notice)]

    notices = asyncio.run(play())
    assert sorted(notices) == [f"{name} keeps its last command: {reason}" for name in ("one", "two")]


def test_an_answer_after_the_end_is_nobodys(tmp_path):
    async def play():
        late = asyncio.Event()

        async def answer(seat):
            if len(room._context.workers.asked) > 2:
                try:
                    await asyncio.sleep(60)
                finally:
                    late.set()
            return np.ones((10, 10))

        with opened(tmp_path, Workers(answer), speed=2.0, time_limit=None) as room:
            watched(room)
            await until(lambda: len(room._context.workers.asked) == 4)
            room.stop()
            await asyncio.wait_for(late.wait(), 30)
            return read(room)

    recording = asyncio.run(play())
    assert len(recording.of(CommandLine)) == 2 and recording.end.outcome == "stopped"


def test_a_game_runs_to_its_last_tick_and_its_end_is_the_end(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=1.0, speed=2.0) as room:
            red, _ = await running(room)
            await until(lambda: room.phase == "over")
            room.stop()
            shown = len(red.frames)
            await asyncio.sleep(0.1)
            assert len(red.frames) == shown == 30
            return read(room), room.session.sizes, red, room.outcome

    recording, sizes, red, outcome = asyncio.run(play())
    state = red.messages[-1]
    assert (state.phase, state.outcome, outcome) == ("over", "draw", "draw")
    assert state.recording == recording.name and state.sizes == sizes
    assert (recording.end.outcome, recording.end.tick, recording.end.sizes) == ("draw", 30, sizes[-1])
    assert [line.tick for line in recording.of(FrameLine)] == [*range(0, 31, 3)]
    assert Playback(recording).verify().verified and len(sizes) == 2


def meddle(room, tick, change):
    """Change the teams of a game, as its drones would, in a tick."""
    game = room.session.game
    advance = game.advance

    def advance_and_change():
        events = advance()
        if game.tick == tick:
            change(game.simulator.games.teams[0])
        return events

    game.advance = advance_and_change


@pytest.mark.parametrize(("team", "outcome"), [(RED, "red"), (BLUE, "blue")])
def test_who_has_every_drone_has_won_the_game(team, outcome, tmp_path):
    async def play():
        with opened(tmp_path, table=TableConfig(), red=4, blue=6, speed=2.0, time_limit=None) as room:
            red, _ = starting(room)
            meddle(room, 1, lambda teams: teams.fill(team))
            await until(lambda: room.phase == "over")
            return read(room), room.outcome, decode_frame(red.frames[-1][0])

    recording, told, last = asyncio.run(play())
    assert last.tick == 1 and last.fields is not None and (last.teams == team).all(), "the end is shown whole"
    assert [line.tick for line in recording.of(FrameLine)] == [0, 1]
    assert told == recording.end.outcome == outcome and recording.end.ended_by == "capture"
    assert recording.end.sizes == ((10, 0) if team == RED else (0, 10))


def test_sizes_are_told_once_a_second(tmp_path):
    async def play():
        with opened(tmp_path, red=4, blue=6, speed=2.0, time_limit=None) as room:
            await running(room)
            meddle(room, 30, lambda teams: np.copyto(teams, [RED] * 3 + [BLUE] * 7))
            await until(lambda: len(room.session.sizes) == 2)
            return room.session.sizes

    assert asyncio.run(play()) == [(4, 6), (3, 7)]


def test_a_stopped_game_shows_and_writes_nothing_more(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, _ = await running(room)
            await until(lambda: len(red.frames) > 3)
            room.stop()
            shown = len(red.frames)
            await asyncio.sleep(0.2)
            assert len(red.frames) == shown
            return read(room), shown

    recording, shown = asyncio.run(play())
    assert (recording.end.outcome, recording.end.tick, recording.end.ended_by) == ("stopped", shown, "server")


def test_a_fault_of_the_server_stops_the_game_and_is_told(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, _ = await running(room)
            room.session.game.advance = None
            await until(lambda: room.phase == "over")
            assert [message.text for message in red.heard(protocol.Notice)] == [
                "this game was stopped by a fault of the server"
            ]
            return read(room), room.outcome

    recording, outcome = asyncio.run(play())
    assert outcome == recording.end.outcome == "stopped" and recording.end.ended_by == "server"


@pytest.mark.parametrize(
    ("happens", "ended_by"),
    [
        (lambda room, red, blue: None, "time"),
        (lambda room, red, blue: room.leave(red), "left"),
        (lambda room, red, blue: room.disconnect(blue), "left"),
        (lambda room, red, blue: (room.disconnect(blue), room.resume(blue, room.seats[1])), "time"),
        (lambda room, red, blue: (room.resume(Client(), room.seats[1]), room.disconnect(blue)), "time"),
    ],
)
def test_a_game_that_somebody_left_is_not_ended_by_time(happens, ended_by, tmp_path):
    async def play():
        with opened(tmp_path, time_limit=1.0, speed=2.0) as room:
            red, blue = await running(room)
            happens(room, red, blue)
            await until(lambda: room.phase == "over")
            return read(room)

    recording = asyncio.run(play())
    assert (recording.end.outcome, recording.end.ended_by) == ("draw", ended_by)
    assert Playback(recording).verify().verified


def test_a_room_that_is_closed_when_its_players_have_gone_was_left(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, blue = await running(room)
            room.leave(red)
            room.leave(blue)
            room.stop()
            return read(room)

    recording = asyncio.run(play())
    assert (recording.end.outcome, recording.end.ended_by) == ("stopped", "left")
    assert not Playback(recording).verify().faults


def test_games_of_a_lesson_say_that_they_are(tmp_path):
    async def play(lesson):
        with opened(tmp_path / str(lesson), time_limit=None) as room:
            room.games.lesson = lesson
            await running(room)
            return read(room).header.lesson

    assert [asyncio.run(play(lesson)) for lesson in (True, False)] == [True, False]
