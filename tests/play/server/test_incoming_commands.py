"""Commands on their way into a game: when they count, and what is written of them."""

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, TICKS_PER_SECOND, CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, InForceLine
from swarm_pz.play.recordings.playback import Playback
from tests.play.server.test_room import CALM, Workers, give, opened, read, running, ticks, until, watched
from tests.play.server.test_varied_rooms import CORNER, RIM, command, varied

pytestmark = pytest.mark.anyio


async def test_delayed_commands_count_later_in_order_and_the_recording_verifies(tmp_path):
    table = varied(Factors(command_delay_ms=200.0), min_command_interval=0.0)
    with opened(tmp_path, table=table, time_limit=None) as room:
        red, blue = await running(room)
        give(room, blue, command(1))
        for number, density in ((1, CORNER), (2, RIM), (3, CORNER)):
            give(room, red, command(number, density))
        assert len(red.heard(protocol.Received)) == 3, "that they arrived is told at once"
        assert [line.team for line in read(room).of(CommandLine)] == [1], "nothing of red counts yet"
        await until(lambda: red.heard(protocol.InForceMessage))
        delays = room.session.delays()
        give(room, red, command(4, RIM))
        await until(lambda: len(red.heard(protocol.InForceMessage)) == 2)
        room.stop()
        recording = read(room)
    lines = [line for line in recording.of(CommandLine) if line.team == 0]
    assert [line.number for line in lines] == [1, 2, 3, 4]
    forced = {(line.team, line.number): line for line in recording.of(InForceLine)}
    assert set(forced) == {(1, 1), (0, 3), (0, 4)}, "of those that wait for one solve the latest counts, as ever"
    assert forced[0, 3].ms - lines[2].received_ms >= 199.0
    assert forced[0, 3].tick >= forced[1, 1].tick + 0.2 * TICKS_PER_SECOND - 3
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
    assert [line.number for line in recording.of(CommandLine)] == [1, 2] and not recording.of(InForceLine)
    told = recording.end.delays[0].command
    assert told.count == 0 and told.got_ms is None and Playback(recording).verify().verified


async def test_a_policy_is_delayed_as_players_are(tmp_path):
    async def answer(seat):
        return CORNER if seat.team else RIM

    table = varied(blue=Factors(command_delay_ms=100.0), game=CALM.game.replace(command_period=0.2))
    with opened(tmp_path, Workers(answer), table, time_limit=None) as room:
        watched(room)
        await ticks(room, 12)
        room.stop()
        recording = read(room)
    commands = [(line.team, line.number) for line in recording.of(CommandLine)]
    assert len(set(commands)) == len(commands) and (1, 1) in commands
    first = [next(line.tick for line in recording.of(InForceLine) if line.team == team) for team in (0, 1)]
    assert first[0] == 0 and first[1] >= 3 and Playback(recording).verify().verified


async def test_a_policy_that_answers_the_same_again_holds_its_command(tmp_path):
    async def answer(seat):
        return np.ones((10, 10)) if seat.team == RED else np.eye(10)

    released = GameConfig.preset("released").replace(capture=CaptureConfig(enabled=False), command_period=0.5)
    workers = Workers(answer)
    with opened(tmp_path, workers, TableConfig(game=released), speed=2.0, time_limit=None) as room:
        watched(room)
        await until(lambda: len(workers.asked) >= 6)
        weights = room.session.game.simulator.games.memory_weight[0, [0, -1]]
        solves, recording = -(-room.session.game.tick // 3), read(room)
    assert weights.tolist() == [solves, solves], "nothing was forgotten"
    assert [(line.team, line.number) for line in recording.of(CommandLine)] == [(BLUE, 1)]
    assert Playback(recording).verify().verified
