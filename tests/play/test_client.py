"""The client for programs, against a stand-in table: what it sends, when, and how it handles the replies."""

import contextlib
import threading

import numpy as np
import pytest
from websockets.sync.server import serve

from swarm_pz.errors import PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.client import play
from swarm_pz.play.frames import Frame, encode_frame, encode_target


@contextlib.contextmanager
def stand_in(*answers):
    """Serve a table that sends `answers` to `ready` and may hang up; give its address, what it hears, and its end."""
    sent, heard_all = [], threading.Event()

    def talk(socket):
        for text in socket:
            sent.append(protocol.decode_client(text))
            if isinstance(sent[-1], protocol.Ready):
                for answer in answers:
                    socket.send(answer if isinstance(answer, bytes) else protocol.encode(answer))
                if not any(isinstance(answer, bytes) for answer in answers):
                    break
        heard_all.set()

    with serve(talk, "127.0.0.1", 0, subprotocols=[protocol.SUBPROTOCOL]) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield "{}:{}".format(*server.socket.getsockname()), sent, heard_all
        finally:
            server.shutdown()
            thread.join()


def room(phase, outcome=None):
    seat = protocol.SeatState()
    return protocol.RoomState("ABCD", phase, protocol.Settings(), seat, seat, [], outcome)


def frame(tick):
    places, teams = np.full((3, 2), 0.5), np.array([0, 1, 1], np.int8)
    return encode_frame(
        Frame(sequence=100 + tick, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)
    )


def seated(system, takes, serves):
    commands = protocol.Commands(system, takes, [2, 2], 0.0, 1.0, [], serves)
    return protocol.Seated("ABCD", "red", "0" * 32, commands)


def commands(sent):
    return [message for message in sent if isinstance(message, protocol.CommandMessage)]


def test_a_program_says_who_it_is_commands_once_a_period_and_returns_who_won():
    calls = []

    def tactic(shown, team):
        calls.append((shown.tick, team, shown.teams.tolist()))
        return np.full((10, 10), shown.tick / 100)

    late = protocol.Refused("too_many", "this one is lost", "command")
    target = encode_target(1, 1, np.zeros((2, 2), np.uint8))
    answers = [room("over", "red"), late, target, room("playing"), *map(frame, range(61)), room("over", "blue")]
    with stand_in(*answers) as (address, sent, heard_all):
        assert play(address, tactic, opponent="ring", seat="blue", period=0.5) == "blue"
        assert heard_all.wait(30)
    assert sent[:3] == [protocol.Hello(kind="program"), protocol.Create(seat="blue", opponent="ring"), protocol.Ready()]
    assert calls == [(tick, 1, [0, 1, 1]) for tick in (0, 15, 30, 45, 60)]
    expected = [(1 + k, [[15 * k / 100] * 10] * 10) for k in range(5)]
    assert [(command.number, command.density) for command in commands(sent)] == expected
    acknowledged = [message.sequence for message in sent if isinstance(message, protocol.Acknowledge)]
    assert acknowledged == list(range(103, 161, 4)), "after every fourth frame"


def test_a_program_commands_in_the_countdown_and_anew_in_the_next_one():
    answers = [room("starting"), frame(0), room("waiting"), room("starting"), frame(0), room("playing"), frame(1)]
    with stand_in(*answers, room("over", "red")) as (address, sent, heard_all):
        assert play(address, lambda frame, team: np.eye(10)) == "red"
        assert heard_all.wait(30)
    assert [command.number for command in commands(sent)] == [1, 2], "one for each start"


@pytest.mark.parametrize(
    ("asked", "opens"),
    [
        ({"room": "WXYZ", "opponent": "ring", "seat": "blue"}, protocol.Join("WXYZ", "blue")),
        (
            {"opponent": "ring", "seed": 7, "red": 5, "time_limit": 60.0, "blue_system": "flocking"},
            protocol.Create(
                settings=protocol.Settings(red=5, time_limit=60.0, blue_system="flocking"), opponent="ring", seed=7
            ),
        ),
    ],
)
def test_a_program_joins_a_room_or_opens_one_as_the_page_can(asked, opens):
    with (
        stand_in(protocol.Refused("taken", "that seat is taken", "join")) as (address, sent, _),
        pytest.raises(PolicyError, match="that seat is taken"),
    ):
        play(address, None, **asked)
    assert sent[1] == opens


def test_a_table_that_hangs_up_is_an_error():
    with stand_in(room("playing")) as (address, _, _), pytest.raises(PolicyError, match="closed the connection"):
        play(address, None)


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
    with stand_in(*answers) as (address, sent, heard_all):
        assert play(address, lambda frame, team: command, red_system="formation", answers="formation") == "red"
        assert heard_all.wait(30)
    (message,) = commands(sent)
    assert message.density is None and message.command == written


@pytest.mark.parametrize(
    ("takes", "serves", "answers", "fits"),
    [("leaders", True, "density", True), ("leaders", False, "density", False), ("density", True, "leaders", False)],
)
def test_a_program_whose_commands_cannot_fly_the_seat_is_told_before_the_game(takes, serves, answers, fits):
    answered = [seated("one", takes, serves), room("playing"), frame(0), room("over", "red")]
    outcome = contextlib.nullcontext() if fits else pytest.raises(PolicyError, match=f"one, which takes .*'{takes}'")
    with stand_in(*answered) as (address, _, _), outcome:
        assert play(address, lambda frame, team: np.eye(2), answers=answers) == "red"
