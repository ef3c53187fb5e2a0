"""Seats that are flown by any control system: what they take, what is refused, and systems that fail."""

import asyncio
import dataclasses

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.recordings.verification import faults_of
from swarm_pz.play.server import control_thread as pilot
from swarm_pz.play.server import rendered_command as painter
from swarm_pz.play.server.room_settings import settings_of, table_config
from tests.play.server.test_client_handler import Guest, visiting
from tests.play.server.test_room import give, opened, playing, read, seated, until
from tests.play.systems import Dreaming, Escaping, Fields, Hanging, Magnet, Raising, Unready, install

DOT = protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])
PUSH = [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.0, 0.0]]
SMALL = GameConfig(drones_per_team=2, capture=CaptureConfig(enabled=False))


def table(*controllers):
    return TableConfig(game=SMALL.replace(controllers=controllers))


def settings(**more):
    return {"red": 2, "blue": 2, "time_limit": 600.0} | more


async def begun(room):
    red, blue = seated(room, "red", "blue")
    room.ready(red, True)
    room.ready(blue, True)
    await playing(room)
    return red, blue


def test_a_room_chooses_the_systems_of_its_seats_and_the_host_those_that_it_does_not_name():
    host = table("direct", "flocking")
    assert table_config(protocol.Settings(), host).game.team_controllers == ("direct", "flocking")
    chosen = table_config(protocol.Settings(blue_system="ergodic"), host)
    assert chosen.game.team_controllers == ("direct", "ergodic")
    assert (settings_of(chosen).red_system, settings_of(chosen).blue_system) == ("direct", "ergodic")
    assert table_config(settings_of(chosen), host) == chosen


def test_a_room_that_names_the_hosts_system_has_its_numbers(monkeypatch):
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Stiff(Magnet):
        name = "stiff"
        gain: float = 1.0

    install(monkeypatch, Stiff)
    host = table(Stiff(gain=3.0), "ergodic")
    chosen = table_config(protocol.Settings(red_system="ergodic", blue_system="stiff"), host)
    assert chosen.game.team_systems[1] == Stiff(gain=3.0)


def test_a_seat_says_what_it_takes_and_its_commands_are_recorded_and_played_again(tmp_path):
    async def play():
        with opened(tmp_path, table=table("direct", "ergodic"), **settings()) as room:
            red, blue = await begun(room)
            told = red.heard(protocol.Seated)[0].commands
            assert (told.system, told.takes, told.shape, told.low, told.high) == (
                "direct",
                "accelerations",
                [4, 2],
                -1.0,
                1.0,
            )
            state = red.heard(protocol.RoomState)[-1]
            assert (state.red.takes, state.blue.takes) == ("accelerations", "density")
            assert state.settings.red_system == "direct"
            give(room, red, protocol.CommandMessage(1, command=PUSH))
            give(room, blue, protocol.CommandMessage(1, density=np.eye(10).tolist()))
            await until(lambda: red.heard(protocol.InForceMessage) and blue.heard(protocol.InForceMessage))
            before = room.session.game.tick
            await until(lambda: room.session.game.tick > before + 8)
            room.stop()
            return room.session.recorder.path

    recording = Recording.read(asyncio.run(play()))
    lines = {line.team: line for line in recording.of(CommandLine)}
    assert lines[0].density is None and lines[0].command == PUSH and lines[1].command is None
    result = Playback(recording).verify()
    assert result.verified, result
    assert [row.system for row in seat_rows(recording)] == ["direct", "ergodic"]


def test_strokes_become_what_attracts_and_what_repels_where_a_seat_takes_both(tmp_path, monkeypatch):
    install(monkeypatch, Fields)
    strokes = [DOT, protocol.StrokeMessage("repel", 0.2, [(0.9, 0.1)])]

    async def play():
        with opened(tmp_path, table=table("fields", "ergodic"), **settings()) as room:
            red, _ = await begun(room)
            give(room, red, protocol.CommandMessage(1, strokes=strokes))
            await until(lambda: red.heard(protocol.InForceMessage))
            tick = room.session.game.tick
            await until(lambda: room.session.game.tick > tick + 3)
            room.stop()
            return read(room)

    recording = asyncio.run(play())
    (line,) = recording.of(CommandLine)
    attracts, repels = np.array(line.command)
    assert line.density is None and attracts.argmax() in (44, 45, 54, 55) and repels.argmax() == 9
    assert attracts[1, 9] < 0.01 and repels[5, 5] < 0.01
    result = Playback(recording).verify()
    assert result.verified, result
    line.command[0][9][9] += 0.01
    changed = Recording("changed.jsonl", recording.header, recording.events)
    assert any("not that of its strokes" in fault for fault in faults_of(changed, None))


@pytest.mark.parametrize(
    ("message", "told"),
    [
        (protocol.CommandMessage(1, density=np.eye(10).tolist()), "'density' cannot fly direct"),
        (
            protocol.CommandMessage(1, strokes=[protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])]),
            "cannot fly direct",
        ),
        (protocol.CommandMessage(1, command=PUSH[:3]), r"shape \(3, 2\)"),
        (protocol.CommandMessage(1, command=[*PUSH[:3], [5.0, 0.0]]), "within"),
        (protocol.CommandMessage(1, command=[0.0] * 10_000), "shape"),
        (protocol.CommandMessage(1, command={"shape": "ring"}), "red's command"),
        (protocol.CommandMessage(1, command=PUSH, density=np.eye(10).tolist()), "either"),
    ],
)
def test_a_command_that_cannot_fly_the_seat_is_refused_and_the_game_goes_on(message, told, tmp_path):
    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.Create(settings=protocol.Settings(red=4, blue=0, red_system="direct")))
        guest.say(protocol.Ready())
        await playing(hall.room())
        guest.say(message)
        await until(lambda: guest.heard(protocol.Refused))
        (refused,) = guest.heard(protocol.Refused)
        assert (refused.code, refused.about) == ("not_valid", "command")
        assert told.replace("\\", "") in refused.reason
        tick = hall.room().session.game.tick
        await until(lambda: hall.room().session.game.tick > tick)
        assert not guest.heard(protocol.Received)

    visiting(tmp_path, script)


def test_a_room_whose_system_cannot_say_what_it_takes_is_not_opened(tmp_path, monkeypatch):
    install(monkeypatch, Unready)

    async def script(hall):
        guest = Guest(hall)
        for name in ("unready", "nobody"):
            assert guest.say(protocol.Create(settings=protocol.Settings(red_system=name))) == "not_valid"
            assert not hall.rooms
        assert "no control system 'nobody'" in guest.heard(protocol.Refused)[-1].reason

    visiting(tmp_path, script)


# --- systems that fail ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "told"),
    [
        (Raising, "lost in a corner"),
        (Hanging, "did not answer within"),
        (Escaping, "raised KeyboardInterrupt"),
    ],
)
def test_a_system_that_fails_forfeits_its_game_and_others_go_on(system, told, tmp_path, monkeypatch):
    install(monkeypatch, system)
    monkeypatch.setattr(pilot, "SOLVE_S", 3.0)

    async def play():
        own, host = table(system.name, "ergodic"), table("ergodic", "ergodic")
        with (
            opened(tmp_path / "one", table=own, **settings()) as room,
            opened(tmp_path / "two", table=host, **settings()) as other,
        ):
            red, _ = await begun(room)
            await begun(other)
            give(room, red, protocol.CommandMessage(1, command=[0.0, 0.0]))
            await until(lambda: system.corners or room.phase == "over")
            before = other.session.game.tick
            await until(lambda: room.phase == "over")
            assert system is not Hanging or other.session.game.tick > before, "others have gone on meanwhile"
            assert other.phase == "playing"
            state = red.heard(protocol.RoomState)[-1]
            assert (state.outcome, state.ended_by) == ("blue", "forfeit")
            assert told in state.forfeit and f"{system.name}, which flies red" in state.forfeit
            assert any(told in message.text for message in red.heard(protocol.Notice))
            await until(lambda: room.session.recorder.written)
            return read(room)

    recording = asyncio.run(play())
    assert (recording.end.outcome, recording.end.ended_by) == ("blue", "forfeit")
    assert told in recording.forfeit and recording.of(SeatLine)[-1].event == "forfeit"
    result = Playback(recording).verify()
    assert result.verified, result
    assert {row.left_out for row in seat_rows(recording)} == {"forfeit"}


def test_a_system_that_fails_at_once_forfeits_when_the_game_begins(tmp_path, monkeypatch):
    install(monkeypatch, Raising)
    monkeypatch.setattr(Raising, "default", lambda self, config: np.zeros(2))

    async def play():
        with opened(tmp_path, table=table("ergodic", "raising"), **settings()) as room:
            red, blue = seated(room, "red", "blue")
            room.ready(red, True)
            room.ready(blue, True)
            await until(lambda: room.phase == "over")
            await until(lambda: room.session.recorder.written)
            return read(room)

    recording = asyncio.run(play())
    assert (recording.end.outcome, recording.end.tick, recording.end.ended_by) == ("red", 0, "forfeit")
    assert Playback(recording).verify().verified


@pytest.mark.parametrize("corner", [[0.0, 0.0], [1.0, 1.0]], ids=["reads", "draws"])
def test_a_system_that_hangs_over_a_command_refuses_it_and_others_are_commanded(corner, tmp_path, monkeypatch):
    install(monkeypatch, Dreaming)
    monkeypatch.setattr(painter, "RENDER_S", 2.0)
    monkeypatch.setattr(Dreaming, "corners", [])
    one, two = (protocol.Settings(red=2, blue=0, time_limit=600.0, red_system=name) for name in ("dreaming", "direct"))

    async def script(hall):
        guests = [Guest(hall) for _ in range(2)]
        for guest, chosen in zip(guests, (one, two), strict=True):
            guest.say(protocol.Create(settings=chosen))
            guest.say(protocol.Ready())
        dreamer, other = guests
        rooms = list(hall.rooms.values())
        await until(lambda: all(room.phase == "playing" for room in rooms))
        dreamer.say(protocol.CommandMessage(1, command=corner))
        await until(lambda: Dreaming.corners)
        other.say(protocol.CommandMessage(1, command=PUSH[:2]))
        dreamer.say(protocol.CommandMessage(2, command=corner))
        before = rooms[0].session.game.tick
        await until(lambda: other.heard(protocol.Received) and len(dreamer.heard(protocol.Refused)) == 2)
        reasons = [refused.reason for refused in dreamer.heard(protocol.Refused)]
        assert "did not read that command" in reasons[0] and "still reads another" in reasons[1]
        assert rooms[0].session.game.tick > before and all(room.phase == "playing" for room in rooms)

    visiting(tmp_path, script)
