"""A program at the table, against a stand-in for it: what it says, when, and what it makes of the answers."""

import contextlib
import threading

import numpy as np
import pytest
from websockets.sync.server import serve

from swarm_pz.errors import ConfigError, PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.client import play
from swarm_pz.play.frames import Frame, encode_frame, encode_target


@contextlib.contextmanager
def stand_in(*answers):
    """Give the address of a table that answers a client's `ready` so and hangs up, and what it was said."""
    said, heard_all = [], threading.Event()

    def talk(socket):
        for text in socket:
            said.append(protocol.decode_client(text))
            if isinstance(said[-1], protocol.Ready):
                for answer in answers:
                    socket.send(answer if isinstance(answer, bytes) else protocol.encode(answer))
                if not any(isinstance(answer, bytes) for answer in answers):
                    break
        heard_all.set()

    with serve(talk, "127.0.0.1", 0, subprotocols=[protocol.SUBPROTOCOL]) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield "{}:{}".format(*server.socket.getsockname()), said, heard_all
        finally:
            server.shutdown()
            thread.join()


def room(phase, outcome=None):
    seat = protocol.SeatState()
    return protocol.RoomState("ABCD", phase, protocol.Settings(), seat, seat, 0, [], 0.5, outcome)


def frame(tick):
    places = np.full((3, 2), 0.5)
    teams = np.array([0, 1, 1], np.int8)
    return encode_frame(
        Frame(sequence=100 + tick, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)
    )


def test_a_program_says_who_it_is_commands_once_a_period_and_returns_who_won():
    seen = []

    def tactic(shown, team):
        seen.append((shown.tick, team, shown.teams.tolist()))
        return np.full((10, 10), shown.tick / 100)

    late = protocol.Refused("too_many", "this one is lost", "command")
    target = encode_target(1, 1, np.zeros((2, 2), np.uint8))
    frames = [frame(tick) for tick in range(61)]
    answers = [room("over", "red"), late, target, room("playing"), *frames, room("over", "blue")]
    with stand_in(*answers) as (address, said, heard_all):
        assert play(address, tactic, opponent="ring", seat="blue", period=0.5) == "blue"
        assert heard_all.wait(30)
    assert said[:3] == [protocol.Hello(kind="program"), protocol.Create(seat="blue", opponent="ring"), protocol.Ready()]
    assert seen == [(tick, 1, [0, 1, 1]) for tick in (0, 15, 30, 45, 60)]
    commands = [message for message in said if isinstance(message, protocol.CommandMessage)]
    expected = [(1 + k, [[15 * k / 100] * 10] * 10) for k in range(5)]
    assert [(command.number, command.density) for command in commands] == expected
    acknowledged = [message.sequence for message in said if isinstance(message, protocol.Acknowledge)]
    assert acknowledged == list(range(103, 161, 4)), "after every fourth frame"


def test_a_program_commands_in_the_countdown_and_anew_in_the_next_one():
    answers = [room("starting"), frame(0), room("waiting"), room("starting"), frame(0), room("playing"), frame(1)]
    with stand_in(*answers, room("over", "red")) as (address, said, heard_all):
        assert play(address, lambda frame, team: np.eye(10), seat="red") == "red"
        assert heard_all.wait(30)
    commands = [message.number for message in said if isinstance(message, protocol.CommandMessage)]
    assert commands == [1, 2], "one for each start"


def test_a_program_joins_the_room_that_it_is_told():
    with (
        stand_in(protocol.Refused("taken", "that seat is taken", "join")) as (address, said, _),
        pytest.raises(PolicyError, match="refused join: that seat is taken"),
    ):
        play(address, None, room="WXYZ", opponent="ring", seat="blue")
    assert said[1] == protocol.Join("WXYZ", "blue")


def test_a_program_chooses_its_room_s_settings_and_seed_as_the_page_can():
    asked = {"red": 5, "blue": 8, "time_limit": 60.0, "speed": 2.0, "blue_system": "flocking"}
    with stand_in(room("playing"), room("over", "red")) as (address, said, heard_all):
        assert play(address, None, opponent="ring", seed=7, **asked) == "red"
        assert heard_all.wait(30)
    assert said[1] == protocol.Create(settings=protocol.Settings(**asked), opponent="ring", seed=7)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"drones": 5}, r"unknown field `drones` - at `\$.settings`; settings are red, blue, time_limit"),
        ({"red": 1000}, r"`int` <= 200 - at `\$.settings.red`"),
        ({"seed": -1}, r"`int` >= 0 - at `\$.seed`"),
        ({"room": "ABCD", "red": 5}, "expected no settings and no seed for room 'ABCD'"),
        ({"room": "ABCD", "seed": 5}, "expected no settings and no seed for room 'ABCD'"),
    ],
)
def test_settings_that_no_room_has_are_refused_before_anybody_is_asked(asked, said):
    with pytest.raises(ConfigError, match=said):
        play("127.0.0.1:1", None, **asked)


def test_a_table_that_hangs_up_is_an_error():
    with stand_in(room("playing")) as (address, _, _), pytest.raises(PolicyError, match="closed the connection"):
        play(address, None)


def seated(system, takes, serves):
    told = protocol.Commands(system, takes, [2, 2], 0.0, 1.0, [], serves)
    return protocol.Seated("ABCD", "red", "0" * 32, told)


@pytest.mark.parametrize(
    ("command", "written"),
    [
        (np.eye(2), [[1.0, 0.0], [0.0, 1.0]]),
        (
            {"shape": "ring", "centre": (0.5, 0.25), "size": np.float32(0.5)},
            {"shape": "ring", "centre": [0.5, 0.25], "size": 0.5},
        ),
    ],
)
def test_a_program_commands_in_the_kind_that_it_answers(command, written):
    answers = [seated("formation", "formation", serves=False), room("playing"), frame(0), room("over", "red")]
    with stand_in(*answers) as (address, said, heard_all):
        assert play(address, lambda frame, team: command, red_system="formation", answers="formation") == "red"
        assert heard_all.wait(30)
    assert said[1] == protocol.Create(settings=protocol.Settings(red_system="formation"), seat="red")
    (given,) = [message for message in said if isinstance(message, protocol.CommandMessage)]
    assert given.density is None and given.command == written


@pytest.mark.parametrize(
    ("takes", "serves", "answers", "fits"),
    [
        ("density", True, "density", True),
        ("leaders", True, "density", True),
        ("leaders", False, "density", False),
        ("density", True, "leaders", False),
    ],
)
def test_a_program_whose_commands_cannot_fly_the_seat_is_told_before_the_game(takes, serves, answers, fits):
    answered = [seated("one", takes, serves), room("over", "red"), room("playing"), frame(0), room("over", "red")]
    with stand_in(*answered) as (address, _, _):
        if fits:
            assert play(address, lambda frame, team: np.eye(2), answers=answers) == "red"
        else:
            with pytest.raises(PolicyError, match=f"flown by one, which takes commands of kind '{takes}'"):
                play(address, lambda frame, team: np.eye(2), answers=answers)
