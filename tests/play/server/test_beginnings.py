"""How a game begins: when both can play, after a countdown, with the first commands of all in force."""

import asyncio
import contextlib
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, InForceLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server import room_games
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from swarm_pz.play.server.room_settings import settings_of
from swarm_pz.policies import load
from tests.play.recordings.test_format import record
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
    seated,
    starting,
    until,
)

FOREVER_S = 600.0


def against(room, policy):
    """Sit down in red's seat against a policy, say that one is ready, and return who does."""
    (red,) = seated(room, "red")
    room.place_policy("blue", policy)
    room.ready(red, True)
    return red


def first_in_force(recording):
    """Return the tick of each team's first command."""
    return {line.team: line.tick for line in reversed(recording.of(InForceLine))}


# --- policies load while the room waits -------------------------------------------------------------


def test_no_tick_is_played_before_both_policies_are_loaded_and_both_act_from_the_first_on(tmp_path):
    async def play():
        gates = {"slow": asyncio.Event(), "slower": asyncio.Event()}
        workers = Workers(loading=lambda seat: gates[seat.policy].wait())
        with opened(tmp_path, workers, time_limit=None) as room:
            client = Client()
            room.watch(client)
            room.place_policy("red", "slow")
            room.place_policy("blue", "slower")
            room.ready(client, True)
            gates["slow"].set()
            await until(lambda: client.messages[-1].red.policy_state == "loaded")
            state = client.messages[-1]
            assert (state.phase, state.blue.policy_state) == ("waiting", "loading") and room.session is None
            assert not workers.asked and not client.bytes
            gates["slower"].set()
            await until(lambda: room.phase == "playing" and room.session.game.tick > 3)
            return read(room)

    assert first_in_force(asyncio.run(play())) == {0: 0, 1: 0}


def test_the_first_tick_waits_for_a_first_command_that_takes_long(tmp_path):
    async def play():
        answered = asyncio.Event()

        async def answer(seat):
            await answered.wait()
            return np.eye(10)

        with opened(tmp_path, Workers(answer), time_limit=None) as room:
            red = against(room, "one")
            await until(lambda: room._context.workers.asked)
            await asyncio.sleep(0.1)  # the countdown is long over
            assert room.phase == "starting" and room.session.game.tick == 0 and not red.frames
            answered.set()
            await until(lambda: room.phase == "playing" and room.session.game.tick > 3)
            return read(room)

    recording = asyncio.run(play())
    assert first_in_force(recording) == {1: 0}
    assert recording.of(CommandLine)[0].received_ms <= 0.0


def test_the_first_command_is_that_of_a_match_at_its_first_tick(tmp_path):
    async def play():
        workers = PolicyWorkers(load, limit_s=60.0)
        with opened(tmp_path, workers, time_limit=None) as room:
            client = Client()
            room.watch(client)
            room.place_policy("red", "ring")
            room.place_policy("blue", "noise")
            room.ready(client, True)
            await until(lambda: room.phase == "playing" and room.session.game.tick > 3)
            recording = read(room)
        workers.close()
        return recording

    recording = asyncio.run(play())
    assert first_in_force(recording) == {0: 0, 1: 0}
    game, seed = recording.config.game, recording.header.seed
    batch, row = BatchEnv(game), np.zeros(1, np.int64)
    batch.reset([seed])
    for team, name in enumerate(("ring", "noise")):
        policy = load(name, game)
        policy.reset([np.random.SeedSequence(seed, spawn_key=(team,))], row)
        expected = batch.ask(policy, np.array([team]), row)[0]
        first = next(line for line in recording.of(CommandLine) if line.team == team)
        np.testing.assert_allclose(first.density, expected, atol=5.1e-5)


def test_noise_against_noise_sends_no_two_equal_commands(tmp_path):
    async def play():
        workers = PolicyWorkers(load, limit_s=60.0)
        table = TableConfig(game=GameConfig(command_period=0.1, capture=CALM.game.capture))
        with opened(tmp_path, workers, table, time_limit=None) as room:
            client = Client()
            room.watch(client)
            room.place_policy("red", "noise")
            room.place_policy("blue", "noise")
            room.ready(client, True)
            await until(lambda: room.session is not None and len(read(room).of(CommandLine)) >= 16)
            recording = read(room)
        workers.close()
        return recording

    sent = [str(line.density) for line in asyncio.run(play()).of(CommandLine)]
    assert len(sent) >= 16 and len(set(sent)) == len(sent)


def test_a_policy_that_cannot_be_loaded_is_told_of_and_another_one_plays(tmp_path):
    async def play():
        async def loading(seat):
            if seat.policy == "broken":
                raise PolicyError("no such file")
            if seat.policy == "odd":
                raise RuntimeError("oh")

        with opened(tmp_path, Workers(loading=loading), time_limit=None) as room:
            red = against(room, "broken")
            await until(lambda: red.messages[-1].blue.policy_state == "failed")
            assert red.messages[-1].blue.reason == "no such file" and room.phase == "waiting"
            assert code_of(room.ready, red, True) == "not_valid"
            room.invite(red, "blue", "odd")
            assert (red.messages[-1].blue.policy_state, red.messages[-1].blue.reason) == ("loading", "")
            await until(lambda: red.messages[-1].blue.policy_state == "failed")
            assert red.messages[-1].blue.reason == "it could not be loaded"
            room.invite(red, "blue", "sound")
            await playing(room)

    asyncio.run(play())


def test_a_policy_stays_loaded_for_the_next_game_and_is_let_go_with_its_seat(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, workers = against(room, "one"), room._context.workers
            await playing(room)
            room.stop()
            room.ready(red, True)
            await playing(room)
            (one,) = workers.loaded
            assert workers.paused == [one] and not workers.forgotten
            room.stop()
            room.invite(red, "blue", "two")
            assert workers.forgotten == [one]
            await until(lambda: len(workers.loaded) == 2)
            room.close()
            assert workers.forgotten == workers.loaded

    asyncio.run(play())


# --- the countdown ----------------------------------------------------------------------------------


def test_the_start_is_in_view_while_a_game_counts_down(tmp_path):
    async def play():
        with opened(tmp_path, countdown_s=FOREVER_S) as room:
            watcher = Client()
            room.watch(watcher)
            red, _ = starting(room)
            state, now = red.messages[-1], room._context.now_ms()
            assert state.phase == "starting" and state.red.ready and state.blue.ready
            assert 0.0 < state.starts_ms - now <= 1000.0 * FOREVER_S
            frame = decode_frame(red.bytes[0])
            assert frame.tick == 0 and frame.altitudes is not None and watcher.bytes == red.bytes[:1]
            late = Client()
            room.watch(late)
            np.testing.assert_array_equal(decode_frame(late.bytes[0]).positions, frame.positions)
            await asyncio.sleep(0.1)
            assert room.session.game.tick == 0 and not red.frames
            room.ready(red, True)
            assert room.phase == "starting", "who says so twice has said it"

    asyncio.run(play())


def test_what_is_commanded_in_the_countdown_is_in_force_at_the_first_tick(tmp_path):
    async def play():
        with opened(tmp_path, countdown_s=0.2) as room:
            red, blue = starting(room)
            for number in (1, 2):
                give(room, red, protocol.CommandMessage(number, density=np.eye(10).tolist()))
            assert [message.number for message in red.heard(protocol.Received)] == [1, 2]
            assert not read(room).of(CommandLine), "the recording begins with the game"
            await playing(room)
            give(room, blue, protocol.CommandMessage(1, density=np.eye(10).tolist()))
            await until(lambda: room.session.game.tick > 3)
            (in_force,) = red.heard(protocol.InForceMessage)
            assert (in_force.number, in_force.tick) == (2, 0)
            room.stop()
            return read(room)

    recording = asyncio.run(play())
    early, latest, later = recording.of(CommandLine)
    assert early.received_ms <= latest.received_ms < 0.0 <= later.received_ms
    assert (recording.of(InForceLine)[0].number, recording.of(InForceLine)[0].tick) == (2, 0)
    assert recording.of(InForceLine)[0].ms >= 0.0
    assert [line.ms < 0.0 for line in recording.of(SeatLine)] == [True, True], "they are here before they draw"
    assert Playback(recording).verify().verified


def test_a_countdown_that_policies_hold_up_moves_the_recordings_clock(tmp_path):
    async def play():
        answered = asyncio.Event()

        async def answer(seat):
            await answered.wait()
            return np.eye(10)

        with opened(tmp_path, Workers(answer), time_limit=None) as room:
            red = against(room, "one")
            await until(lambda: room._context.workers.asked)
            give(room, red, protocol.CommandMessage(1, density=np.eye(10).tolist()))
            sent = room._context.now_ms()
            await asyncio.sleep(0.1)
            answered.set()
            await playing(room)
            passed = room._context.now_ms() - sent
            return read(room).of(CommandLine)[0], passed

    command, passed = asyncio.run(play())
    assert -passed <= command.received_ms <= -90.0, "before the first tick by as much as it was"


@pytest.mark.parametrize("how", ["not ready", "leaves", "is cut off"])
def test_who_does_not_play_after_all_calls_the_countdown_off(how, tmp_path, monkeypatch):
    monkeypatch.setattr(room_games, "PAUSE_S", 0.0)

    async def play():
        with opened(tmp_path, countdown_s=FOREVER_S) as room:
            red, blue = starting(room)
            give(room, red, protocol.CommandMessage(1, density=np.eye(10).tolist()))
            start, path = decode_frame(red.bytes[0]).positions, room.session.recorder.path
            token, seat = room.seats[1].token, room.seats[1]
            {"not ready": lambda: room.ready(blue, False), "leaves": lambda: room.leave(blue)}.get(
                how, lambda: room.disconnect(blue)
            )()
            state = red.messages[-1]
            assert (state.phase, state.outcome, state.starts_ms) == ("waiting", None, None)
            assert state.red.ready and not state.blue.ready and not path.exists(), "nothing of it was played"
            if how == "leaves":
                room.sit(blue, "blue", "")
            elif how == "is cut off":
                assert room.seats[1].token == token
                room.resume(blue, seat)
            red.bytes.clear()
            room.ready(blue, True)
            assert room.phase == "starting"
            np.testing.assert_array_equal(decode_frame(red.bytes[0]).positions, start), "nobody chooses a start"
            assert not room.session.game._waiting[0], "what was commanded before is forgotten"

    asyncio.run(play())


def test_countdowns_that_are_called_off_make_no_file_and_begin_once_a_second(tmp_path, monkeypatch):
    """Each countdown is work: five clients that began and called off as fast as they could stopped all games."""
    now = [1000.0]
    monkeypatch.setattr(room_games, "time", SimpleNamespace(monotonic=lambda: now[0]))
    made = Mock(side_effect=room_games.LiveSession)
    monkeypatch.setattr(room_games, "LiveSession", made)

    async def play():
        with opened(tmp_path, blue=0, countdown_s=FOREVER_S) as room:
            (red,) = seated(room, "red")
            for _ in range(100):
                with contextlib.suppress(RefusedError):
                    room.ready(red, True)
                room.ready(red, False)
                now[0] += 0.0625
            assert made.call_count == 7, "in 6.25 s"
            with pytest.raises(RefusedError, match="called off just now; say that you are ready in a second"):
                room.ready(red, True)
            assert not room.seats[0].ready and list(tmp_path.iterdir()) == []

    asyncio.run(play())


def test_a_countdown_to_another_game_that_is_called_off_leaves_the_last_one_in_view(tmp_path):
    async def play():
        with opened(tmp_path, time_limit=None) as room:
            red, _ = starting(room)
            await playing(room)
            room.stop()
            over = red.messages[-1]
            object.__setattr__(room._context, "countdown_s", FOREVER_S)
            for seat in room.seats:
                room.ready(seat.connection, True)
            assert red.messages[-1].phase == "starting" and red.messages[-1].outcome is None
            room.ready(red, False)
            state = red.messages[-1]
            assert (state.phase, state.outcome, state.recording) == ("over", "stopped", over.recording)
            return Recording.read(tmp_path / over.recording)

    assert asyncio.run(play()).end.outcome == "stopped"


def test_a_game_that_goes_on_from_a_moment_counts_down_to_it_and_says_its_speed(tmp_path, monkeypatch):
    monkeypatch.setattr(room_games, "PAUSE_S", 0.0)
    record(tmp_path / "old.jsonl", ticks=90, config=CALM.replace(speed=2.0))

    async def play():
        replay = ReplaySession(Here(LoadedRecording.read(tmp_path / "old.jsonl")), Client())
        replay.seek(46)
        moment = await replay.moment()
        replay.close()
        with opened(tmp_path, moment=moment, countdown_s=FOREVER_S) as room:
            room.settings = settings_of(moment.game.config)
            red = against(room, "one")
            assert [message.text for message in red.heard(protocol.Notice)] == [
                "this game goes on as it was played: at 2 times the speed"
            ]
            await until(lambda: room.phase == "starting")
            give(room, red, protocol.CommandMessage(1, density=np.eye(10).tolist()))
            assert code_of(room.invite, red, "blue", None) == "out_of_turn", "seats change between games"
            room.ready(red, False)
            object.__setattr__(room._context, "countdown_s", 0.0)
            assert moment.game._waiting == [None, None], "the next countdown is to the same moment"
            room.ready(red, True)
            await until(lambda: room.phase == "playing" and room.session.game.tick > 50)
            room.stop()
            return read(room)

    recording = asyncio.run(play())
    assert recording.header.origin.tick == 46
    assert [line.tick for line in recording.of(InForceLine) if line.team == 1][-1:] == [48]
    assert Playback(recording).verify().verified


# --- who watches ------------------------------------------------------------------------------------


def test_a_watcher_who_is_not_ready_starts_nothing(tmp_path):
    async def play():
        with opened(tmp_path, countdown_s=FOREVER_S) as room:
            client, other = Client(), Client()
            for watcher in (client, other):
                room.watch(watcher)
            room.place_policy("red", "one")
            room.place_policy("blue", "two")
            await until(lambda: all(seat.can_play for seat in room.seats))
            room.ready(client, False)
            assert room.phase == "waiting"
            room.ready(client, True)
            assert room.phase == "starting"
            room.ready(other, False)
            assert room.phase == "waiting"

    asyncio.run(play())


def test_who_has_a_seat_does_not_watch_beside_it(tmp_path):
    with opened(tmp_path) as room:
        (red,) = seated(room, "red")
        assert code_of(room.watch, red) == "out_of_turn"
        assert room.connections == [red]
        before = len(red.messages)
        room.audience.tell_state()
        assert len(red.messages) == before + 1, "once"
