"""Seats that are flown by any control system: what they take, what is refused, and systems that fail."""

import dataclasses
import threading

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import SeatCommand, SeatMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.server import live_session
from swarm_pz.play.server.room_settings import settings_of, table_config
from tests.play.server.test_client_handler import Guest
from tests.play.server.test_room import EYE, give, opened, playing, read, running, starting, ticks, until
from tests.play.systems import Escaping, Hanging, Magnet, Raising, Unready, install

DOT = protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])
PUSH = [[0.5, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.0, 0.0]]
SETTINGS = {"red": 2, "blue": 2, "time_limit": 600.0, "speed": 2.0}


def table(*controllers):
    calm = CaptureConfig(enabled=False)
    return TableConfig(game=GameConfig(drones_per_team=2, capture=calm, controllers=controllers))


# --- rooms ----------------------------------------------------------------------------------------


def test_settings_come_back_from_the_table_and_leave_the_hosts_rules_alone():
    systems = {"red_system": "direct", "blue_system": "ergodic"}
    settings = protocol.Settings(red=1, blue=19, time_limit=None, speed=0.5, majority=True, **systems)
    chosen = table_config(settings, TableConfig(min_command_interval=0.25))
    assert settings_of(chosen) == settings and chosen.min_command_interval == 0.25
    released = GameConfig.preset("released")
    chosen = table_config(protocol.Settings(red=3, time_limit=60.0), TableConfig(game=released))
    assert chosen.game == released.replace(drones_per_team=(3, 10), time_limit=60.0) and chosen.mapping == "paper"
    assert not table_config(settings, table("ergodic", "ergodic")).game.capture.enabled
    assert not table_config(protocol.Settings(blue=0), TableConfig()).game.capture.enabled


def test_a_room_chooses_the_systems_of_its_seats_and_the_host_those_that_it_does_not_name(monkeypatch):
    host = table("direct", "flocking")
    assert table_config(protocol.Settings(), host).game.team_controllers == ("direct", "flocking")
    chosen = table_config(protocol.Settings(blue_system="ergodic"), host)
    assert chosen.game.team_controllers == ("direct", "ergodic") and table_config(settings_of(chosen), host) == chosen

    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Stiff(Magnet):
        name = "stiff"
        gain: float = 1.0

    install(monkeypatch, Stiff)
    settings = protocol.Settings(red_system="ergodic", blue_system="stiff")
    chosen = table_config(settings, table(Stiff(gain=3.0), "ergodic"))
    assert chosen.game.team_systems[1] == Stiff(gain=3.0), "with the host's numbers"


async def test_a_seat_says_what_it_takes_and_its_commands_are_recorded_and_played_again(tmp_path, monkeypatch):
    install(monkeypatch, Magnet)
    solve, threads = Magnet.solve, set()

    def noted(self, flight, config):
        threads.add(threading.current_thread().name)
        return solve(self, flight, config)

    monkeypatch.setattr(Magnet, "solve", noted)
    with opened(tmp_path, table=table("ergodic", "magnet"), **SETTINGS) as room:
        other, flown = both = await running(room)
        spec = flown.heard(protocol.Seated)[0].commands
        assert (spec.system, spec.takes, spec.shape, spec.low, spec.high) == ("magnet", "place", [2], 0.0, 1.0)
        state = flown.heard(protocol.RoomState)[-1]
        assert (state.settings.red_system, state.settings.blue_system) == ("ergodic", "magnet")
        give(room, flown, protocol.CommandMessage(1, command=[0.25, 0.75]))
        give(room, other, protocol.CommandMessage(1, density=EYE))
        await until(lambda: all(client.heard(protocol.InForceMessage) for client in both))
        await ticks(room, room.session.game.tick + 8)
        room.stop()
        recording = read(room)
    red, blue = sorted(recording.of(SeatCommand), key=lambda line: line.team)
    assert blue.density is None and blue.command == [0.25, 0.75] and red.command is None
    assert Playback(recording).verify().verified and threads >= {"control"}
    assert [row.system for row in seat_rows(recording)] == ["ergodic", "magnet"]


async def test_a_command_that_cannot_fly_the_seat_is_refused_and_the_game_goes_on(hall):
    guest = Guest(hall)
    guest.say(protocol.Create(settings=protocol.Settings(red=4, blue=0, red_system="direct")))
    guest.say(protocol.Ready())
    await playing(hall.room())
    cases = (
        ({"density": EYE}, "'density' cannot fly direct"),
        ({"strokes": [DOT]}, "cannot fly direct"),
        ({"command": PUSH[:3]}, "shape (3, 2)"),
        ({"command": [*PUSH[:3], [5.0, 0.0]]}, "within"),
        ({"command": [0.0] * 10_000}, "shape"),
        ({"command": {"shape": "ring"}}, "red's command"),
        ({"command": PUSH, "density": EYE}, "either"),
    )
    for count, (fields, reason) in enumerate(cases, 1):
        guest.say(protocol.CommandMessage(1, **fields))
        refused = await guest.refused(count)
        assert (refused.code, refused.about) == ("not_valid", "command") and reason in refused.reason
    await ticks(hall.room(), hall.room().session.game.tick + 1)
    assert not guest.heard(protocol.Received)


async def test_a_room_whose_system_cannot_say_what_it_takes_is_not_opened(hall, monkeypatch):
    install(monkeypatch, Unready)
    guest = Guest(hall)
    for name in ("unready", "nobody"):
        assert guest.say(protocol.Create(settings=protocol.Settings(red_system=name))) == "not_valid"
    assert "no control system 'nobody'" in guest.heard(protocol.Refused)[-1].reason and not hall.rooms


# --- systems that fail ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("system", "told"),
    [(Raising, "lost in a corner"), (Hanging, "did not answer within"), (Escaping, "raised KeyboardInterrupt")],
)
async def test_a_system_that_fails_forfeits_its_game_and_others_go_on(system, told, tmp_path, monkeypatch):
    install(monkeypatch, system)
    monkeypatch.setattr(live_session, "SOLVE_S", 1.0)
    own, host = table(system.name, "ergodic"), table("ergodic", "ergodic")
    with (
        opened(tmp_path / "one", table=own, **SETTINGS) as room,
        opened(tmp_path / "two", table=host, **SETTINGS) as other,
    ):
        red, _ = await running(room)
        await running(other)
        give(room, red, protocol.CommandMessage(1, command=[0.0, 0.0]))
        await until(lambda: system.corners or room.phase == "over")
        before = other.session.game.tick
        await until(lambda: room.phase == "over")
        assert system is not Hanging or other.session.game.tick > before, "others have gone on meanwhile"
        assert other.phase == "playing"
        state, recording = red.heard(protocol.RoomState)[-1], read(room)
    assert (state.outcome, state.ended_by) == (recording.end.outcome, recording.end.ended_by) == ("blue", "forfeit")
    assert told in state.forfeit and f"{system.name}, which flies red" in state.forfeit
    assert any(told in text for text in red.notices)
    assert told in recording.forfeit and recording.of(SeatMessage)[-1].event == "forfeit"
    assert Playback(recording).verify().verified
    assert {row.left_out for row in seat_rows(recording)} == {"forfeit"}


async def test_a_system_that_fails_at_once_forfeits_when_the_game_begins(tmp_path, monkeypatch):
    install(monkeypatch, Raising)
    monkeypatch.setattr(Raising, "default", lambda self, config: np.zeros(2))
    with opened(tmp_path, table=table("ergodic", "raising"), **SETTINGS) as room:
        starting(room)
        await until(lambda: room.phase == "over")
        recording = read(room)
    assert (recording.end.outcome, recording.end.tick, recording.end.ended_by) == ("red", 0, "forfeit")
    assert Playback(recording).verify().verified
