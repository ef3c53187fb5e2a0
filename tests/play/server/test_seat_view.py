"""What a seat's client is shown: all of it, later, less often, or without what is hidden."""

import asyncio

import numpy as np
import pytest

from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.frames import Frame, decode_frame, encode_frame, encode_target
from swarm_pz.play.server.delays import Measured
from swarm_pz.play.server.seat_view import SeatView
from tests.play.server.test_room import Client

TEAMS = np.array([0, 1, 1, 0], np.int8)
PLACES = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6], [0.7, 0.8]])
pytestmark = pytest.mark.anyio
FIELDS = (np.arange(5000) % 251).astype(np.uint8).reshape(2, 50, 50)


def moment(tick, fields=None, altitudes=None):
    return encode_frame(
        Frame(
            sequence=tick, tick=tick, server_ms=100.0 * tick, positions=PLACES, velocities=1.0 - PLACES, teams=TEAMS,
            altitudes=altitudes, fields=fields,
        )
    )  # fmt: skip


def viewing(team=0, speed=1.0, **factors):
    client = Client()
    return client, SeatView(client, team, Factors(**factors), speed)


def state(phase, sizes=None, **more):
    seat = protocol.SeatState()
    return protocol.RoomState(
        code="ABCD", phase=phase, settings=protocol.Settings(), red=seat, blue=seat, watchers=0,
        sizes=sizes or [(2, 2)], min_command_interval=0.5, **more,
    )  # fmt: skip


def test_what_nothing_is_varied_of_is_passed_on_as_it_is():
    client, view = viewing(command_delay_ms=500.0, share=0.5, helper="ring")
    data, told = moment(7, FIELDS), state("playing")
    view.show(data, 7)
    view.send_bytes(encode_target(0, 1, FIELDS[0]))
    view.send(told)
    assert client.frames == [(data, 7)] and client.frames[0][0] is data
    assert len(client.bytes) == 1 and client.messages == [told]


@pytest.mark.parametrize("team", [0, 1])
def test_hidden_opponents_are_nowhere_in_what_is_sent(team):
    client, view = viewing(team, hide=("opponents",))
    view.show(moment(3, FIELDS), 3)
    view.send_bytes(moment(3, FIELDS, np.full(4, 0.5)))
    bare = Frame(
        sequence=3, tick=3, server_ms=300.0, positions=np.where((team == TEAMS)[:, None], PLACES, 0.0),
        velocities=np.where((team == TEAMS)[:, None], 1.0 - PLACES, 0.0), teams=TEAMS,
        altitudes=np.where(team == TEAMS, 0.5, 0.0), fields=FIELDS,
    )  # fmt: skip
    same = bytearray(encode_frame(bare))
    same[1] |= 4 << (1 - team)
    assert client.bytes == [bytes(same)], "zeros in place of all that the seat does not see"
    frame = decode_frame(client.frames[0][0])
    assert frame.hidden == 1 - team and (frame.teams == TEAMS).all()
    assert (np.isnan(frame.positions).all(1) == (frame.teams != team)).all()
    assert (np.isnan(frame.velocities).all(1) == (frame.teams != team)).all()
    np.testing.assert_allclose(frame.positions[team == TEAMS], PLACES[team == TEAMS], atol=1e-5)


def test_hidden_ground_and_targets_are_not_sent():
    client, view = viewing(hide=("ground", "target"))
    view.show(moment(3, FIELDS), 3)
    view.send_bytes(encode_target(0, 1, FIELDS[0]))
    view.send_bytes(moment(4, FIELDS, np.zeros(4)))
    assert decode_frame(client.frames[0][0]).fields is None
    (keyframe,) = client.bytes
    assert decode_frame(keyframe).fields is None and decode_frame(keyframe).altitudes is not None
    np.testing.assert_allclose(decode_frame(keyframe).positions, PLACES, atol=1e-5)


@pytest.mark.parametrize(("rate", "speed", "expected"), [(10, 1.0, 10), (7, 1.0, 7), (1, 1.0, 1), (10, 2.0, 5)])
def test_so_many_moments_are_shown_a_second_and_evenly_with_the_ground_of_those_left_out(rate, speed, expected):
    client, view = viewing(frame_rate=rate, speed=speed)
    for tick in range(1, 31):
        view.show(moment(tick, FIELDS if tick == 29 else None), tick)
    shown = [sequence for _, sequence in client.frames]
    assert len(shown) == expected and shown[-1] == 30
    gaps = np.diff(shown)
    assert gaps.size == 0 or gaps.max() - gaps.min() <= 1
    assert (decode_frame(client.frames[-1][0]).fields == FIELDS).all()
    view.show(moment(60), 60)
    assert decode_frame(client.frames[-1][0]).fields is None, "once"


def test_the_last_moment_of_a_game_is_shown_whatever_the_rate():
    client, view = viewing(frame_rate=1)
    for tick in (30, 44):
        view.show(moment(tick), tick)
    view.send(state("playing"))
    assert [sequence for _, sequence in client.frames] == [30]
    for _ in range(2):
        view.send(state("over"))
    assert [sequence for _, sequence in client.frames] == [30, 44]


async def test_all_that_is_shown_comes_later_in_its_order_and_is_of_when_it_is_shown():
    client, view = viewing(display_delay_ms=40.0)
    came, view.measured = [], Measured(40.0)
    client.send, client.send_bytes = came.append, came.append
    client.show = lambda frame, sequence: came.append(decode_frame(frame))
    sizes = [(2, 2)]
    view.send(state("starting", starts_ms=1000.0))
    view.send(state("playing", sizes))
    view.send_bytes(encode_target(0, 1, FIELDS[0]))
    view.show(moment(3), 3)
    view.send(state("over"))
    sizes.append((3, 1))
    assert not came
    while len(came) < 5:
        await asyncio.sleep(0.01)
    starting, playing, target, frame, over = came
    assert (starting.phase, starting.starts_ms) == ("starting", 1040.0)
    assert (playing.phase, playing.sizes) == ("playing", [(2, 2)]), "as it was, not as it is by now"
    assert target[0] == 2 and (frame.tick, frame.server_ms) == (3, 340.0) and over.phase == "over"
    assert view.measured.told().count == 1 and view.measured.told().got_ms >= 39.0
    view.show(moment(4), 4)
    view.close()
    await asyncio.sleep(0.08)
    assert len(came) == 5, "who is elsewhere is shown nothing more"
