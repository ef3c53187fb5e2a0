"""Rooms with factors: hidden things, delays, shared commands, and their recordings."""

import asyncio

import numpy as np

from swarm_pz.config import BLUE, RED, CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.commands import as_followed
from swarm_pz.play.factors import Factors
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import InForceMessage, SeatCommand
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.server.incoming_commands import mixture
from tests.play.server.test_room import (
    CALM,
    Client,
    Workers,
    against,
    code_of,
    give,
    opened,
    playing,
    read,
    running,
    seated,
    ticks,
    until,
    watched,
)

NONE = Factors()
HELPED = Factors(share=0.25, helper="two")
CORNER, RIM = np.zeros((10, 10)), np.ones((10, 10))
CORNER[0, 0], RIM[1:9, 1:9] = 1.0, 0.0


def varied(red=NONE, blue=NONE, **more):
    return CALM.replace(factors=(red, blue), **more)


def command(number, density=CORNER):
    return protocol.CommandMessage(number, density=density.tolist())


async def test_only_the_seat_that_is_varied_sees_less_and_its_end_comes_later(tmp_path):
    def is_over(client):
        return any(state.phase == "over" for state in client.heard(protocol.RoomState))

    table = varied(Factors(display_delay_ms=150.0, hide=("opponents", "target")), game=TableConfig().game)
    with opened(tmp_path, table=table, time_limit=1.0, speed=2.0) as room:
        red, blue = await running(room)
        watcher = Client()
        room.watch(watcher)
        ends = []
        send = blue.send
        blue.send = lambda message: (send(message), ends.append((is_over(blue), is_over(red))))
        give(room, red, command(1))
        await until(lambda: is_over(red))
        assert ends[-1] == (True, False)
        recording = read(room)
    shown = [decode_frame(frame) for frame, _ in red.frames]
    assert {frame.hidden for frame in shown} == {1} and np.isnan(shown[-1].positions[shown[-1].teams == 1]).all()
    assert [frame.tick for frame in shown] == [*range(1, 31)]
    for other in (blue, watcher):
        frames = [decode_frame(frame) for frame, _ in other.frames]
        assert all(frame.hidden is None and np.isfinite(frame.positions).all() for frame in frames)
    assert not [data for data in red.bytes if data[0] == 2] and [data for data in blue.bytes if data[0] == 2]
    reds = red.heard(protocol.Seated)[0].factors
    assert reds == protocol.SeatFactors(hide=["opponents", "target"]) and blue.heard(protocol.Seated)[0].factors is None
    display, other = (delays.display for delays in recording.end.delays)
    assert display.asked_ms == 150.0 and display.count > 0 and display.got_ms >= 149.0 and other.asked_ms == 0.0
    assert Playback(recording).verify().verified


async def test_who_comes_back_is_shown_the_game_as_before(tmp_path):
    table = varied(Factors(display_delay_ms=30.0, hide=("opponents",)))
    with opened(tmp_path, table=table, time_limit=None) as room:
        red, _ = await running(room)
        again = Client()
        room.disconnect(red)
        room.resume(again, room.seats[0])
        shown = len(red.frames)
        await until(lambda: len(again.frames) > 5)
        assert len(red.frames) == shown, "what was on its way to a lost connection is lost with it"
    first = next(data for data in again.bytes if data[0] == 1)
    assert all(decode_frame(data).hidden == 1 for data in (first, *(data for data, _ in again.frames)))


async def test_a_game_goes_by_its_speed(tmp_path):
    late = Factors(command_delay_ms=50.0, hide=("opponents",), speed=0.25)
    with opened(tmp_path, table=varied(late), time_limit=None) as room:
        await running(room)
        await ticks(room, 4)
        room.stop()
        recording = read(room)
    assert recording.end.server_ms - recording.header.began_ms >= 1000.0 * recording.end.tick / 30 / 0.25 - 1.0


# --- shared control -------------------------------------------------------------------------------


async def test_a_shared_command_is_mixed_recorded_and_shown_as_such(tmp_path):
    answers = iter([RIM, RIM])

    async def answer(seat):
        return next(answers, np.ones((10, 10)))

    table = varied(HELPED, min_command_interval=0.0)
    with opened(tmp_path, Workers(answer), table, speed=2.0, time_limit=None) as room:
        red, blue = seated(room, "red", "blue")
        for player in (red, blue):
            room.ready(player, True)
        await playing(room)
        await ticks(room, 4)
        give(room, red, command(1))
        await until(lambda: len(red.heard(protocol.InForceMessage)) > 2)
        assert not blue.heard(protocol.InForceMessage)
        room.stop()
        recording = read(room)
    assert red.heard(protocol.Seated)[0].factors == protocol.SeatFactors(helper="two", share=0.25)
    flown = [command for _, command in recording.in_force()]
    assert {one.sender for one in flown} == {"shared:two"} and [one.number for one in flown] == [0, 1, 1]
    parts = [(np.ones((10, 10)), RIM), (CORNER, RIM), (CORNER, np.ones((10, 10)))]
    for one, (own, helpers) in zip(flown, parts, strict=True):
        np.testing.assert_array_equal(one.values, mixture(own, as_followed(helpers), 0.25))
    assert [line.number for line in recording.of(SeatCommand) if not line.sender] == [1], "the player's own, too"
    shown = [data for data in red.bytes if data[0] == 2]
    assert shown[-1] != shown[0] and shown[-1][4] == 1, "of what both make, by the number of the player's"
    row = seat_rows(recording)[0]
    assert row.commands == 1 and row.first_command_s > 0.0
    assert Playback(recording).verify().verified


async def test_a_shared_seat_is_a_players_whose_game_waits_for_the_helper(tmp_path):
    ready = asyncio.Event()
    workers = Workers(loading=lambda seat: ready.wait())
    with opened(tmp_path, workers, varied(HELPED), time_limit=None) as room:
        assert code_of(room.place_policy, "red", "one") == "not_valid"
        red, blue = seated(room, "red", "blue")
        assert red.messages[-1].red.policy_state == "loading" and red.messages[-1].red.name == ""
        room.ready(red, True)
        room.ready(blue, True)
        assert room.phase == "waiting"
        ready.set()
        await playing(room)
        room.leave(red)
        room.stop()
        assert workers.forgotten == workers.loaded, "the helper goes with the player"


# --- when commands count --------------------------------------------------------------------------


async def test_delayed_commands_count_later_in_order_and_the_recording_verifies(tmp_path):
    table = varied(Factors(command_delay_ms=200.0), min_command_interval=0.0)
    with opened(tmp_path, table=table, time_limit=None) as room:
        red, blue = await running(room)
        give(room, blue, command(1))
        for number, density in ((1, CORNER), (2, RIM), (3, CORNER)):
            give(room, red, command(number, density))
        assert len(red.heard(protocol.Received)) == 3, "each is confirmed at once"
        assert [line.team for line in read(room).of(SeatCommand)] == [1], "nothing of red counts yet"
        await until(lambda: 3 in [message.number for message in red.heard(protocol.InForceMessage)])
        delays = room.session.delays()
        give(room, red, command(4, RIM))
        await until(lambda: red.heard(protocol.InForceMessage)[-1].number == 4)
        room.stop()
        recording = read(room)
    lines = [line for line in recording.of(SeatCommand) if line.team == 0]
    assert [line.number for line in lines] == [1, 2, 3, 4]
    forced = {(line.team, line.number): line for line in recording.of(InForceMessage)}
    numbers = [number for team, number in forced if team == 0]
    assert numbers == sorted(numbers) and numbers[-2:] == [3, 4] and (1, 1) in forced
    assert all(forced[0, number].server_ms - lines[number - 1].server_ms >= 199.0 for number in numbers)
    red_delay, blue_delay = (delay.command for delay in delays)
    assert (red_delay.asked_ms, red_delay.count) == (200.0, 3) and red_delay.got_ms >= 199.0
    assert (blue_delay.asked_ms, blue_delay.got_ms, blue_delay.count) == (0.0, 0.0, 1)
    assert recording.end.delays[0].command.count == 4 and recording.config.factors[0].command_delay_ms == 200.0
    assert Playback(recording).verify().verified


async def test_a_command_that_the_end_comes_before_is_written_down_all_the_same(tmp_path):
    with opened(tmp_path, table=varied(Factors(command_delay_ms=5000.0)), time_limit=None) as room:
        red, _ = await running(room)
        give(room, red, command(1))
        give(room, red, command(2))
        room.stop()
        recording = read(room)
    assert [line.number for line in recording.of(SeatCommand)] == [1, 2] and not recording.of(InForceMessage)
    delay = recording.end.delays[0].command
    assert delay.count == 0 and delay.got_ms is None and Playback(recording).verify().verified


async def test_a_policy_is_delayed_as_players_are(tmp_path):
    async def answer(seat):
        return CORNER if seat.team else RIM

    table = varied(blue=Factors(command_delay_ms=100.0), game=CALM.game.replace(command_period=0.2))
    with opened(tmp_path, Workers(answer), table, time_limit=None) as room:
        watched(room)
        await ticks(room, 12)
        room.stop()
        recording = read(room)
    commands = [(line.team, line.number) for line in recording.of(SeatCommand)]
    assert len(set(commands)) == len(commands) and (1, 1) in commands
    forced = recording.of(InForceMessage)
    answered = {line.number: line.server_ms for line in recording.of(SeatCommand) if line.team == BLUE}
    late = [line.server_ms - answered[line.number] for line in forced if line.team == BLUE]
    assert late and min(late) >= 99.0 and (forced[0].team, forced[0].tick) == (RED, 0)
    assert Playback(recording).verify().verified


async def test_a_policy_that_answers_the_same_again_holds_its_command_and_a_player_sends_it_again(tmp_path):
    async def answer(seat):
        return np.eye(10)

    released = GameConfig.preset("released").replace(capture=CaptureConfig(enabled=False), command_period=0.5)
    workers = Workers(answer)
    with opened(tmp_path, workers, TableConfig(game=released), speed=2.0, time_limit=None) as room:
        red = against(room, "two")
        await until(lambda: len(workers.asked) >= 3)
        weights = room.session.game.simulator.games.memory_weight[0, [0, -1]]
        solves = -(-room.session.game.tick // 3)
        for number in (1, 2):
            give(room, red, command(number, np.ones((10, 10))))
        recording = read(room)
    assert weights.tolist() == [solves, solves], "nothing was forgotten"
    assert [(line.team, line.number) for line in recording.of(SeatCommand)] == [(BLUE, 1), (RED, 1), (RED, 2)]
    assert Playback(recording).verify().verified
