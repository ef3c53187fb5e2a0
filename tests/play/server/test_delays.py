"""Delays, and what a seat's client is shown: all of it, later, less often, or without what is hidden."""

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
FIELDS = (np.arange(5000) % 251).astype(np.uint8).reshape(2, 50, 50)


def moment(tick, fields=None, altitudes=None, places=PLACES, speeds=1.0 - PLACES):
    arrays = {"positions": places, "velocities": speeds, "teams": TEAMS, "altitudes": altitudes, "fields": fields}
    return encode_frame(Frame(sequence=tick, tick=tick, server_ms=100.0 * tick, **arrays))


def viewing(team=0, speed=1.0, **factors):
    client = Client()
    return client, SeatView(client, team, Factors(**factors), speed)


def state(phase, sizes=None, **more):
    seats = protocol.SeatState(), protocol.SeatState()
    return protocol.RoomState("ABCD", phase, protocol.Settings(), *seats, sizes or [(2, 2)], **more)


@pytest.mark.parametrize("team", [0, 1])
def test_hidden_opponents_are_nowhere_in_what_is_sent(team):
    client, view = viewing(team, hide=("opponents",))
    view.show(moment(3, FIELDS), 3)
    view.send(moment(3, FIELDS, np.full(4, 0.5)))
    own = (team == TEAMS)[:, None]
    same = bytearray(moment(3, FIELDS, 0.5 * own[:, 0], PLACES * own, (1.0 - PLACES) * own))
    same[1] |= 4 << (1 - team)
    assert client.bytes == [bytes(same)], "zeros in place of all that the seat does not see"
    frame = decode_frame(client.frames[0][0])
    assert frame.hidden == 1 - team and (frame.teams == TEAMS).all()
    assert (np.isnan(frame.positions).all(1) == (frame.teams != team)).all()


def test_hidden_ground_and_targets_are_not_sent():
    client, view = viewing(hide=("ground", "target"))
    view.show(moment(3, FIELDS), 3)
    view.send(encode_target(0, 1, FIELDS[0]))
    view.send(moment(4, FIELDS, np.zeros(4)))
    assert decode_frame(client.frames[0][0]).fields is None
    (keyframe,) = map(decode_frame, client.bytes)
    assert keyframe.fields is None and keyframe.altitudes is not None
    np.testing.assert_allclose(keyframe.positions, PLACES, atol=1e-5)


@pytest.mark.parametrize(("rate", "speed", "expected"), [(7, 1.0, 7), (10, 2.0, 5)])
def test_so_many_moments_are_shown_a_second_and_evenly_with_the_ground_of_those_left_out(rate, speed, expected):
    client, view = viewing(frame_rate=rate, speed=speed)
    for tick in range(1, 31):
        view.show(moment(tick, FIELDS if tick == 29 else None), tick)
    shown = [sequence for _, sequence in client.frames]
    assert len(shown) == expected and shown[-1] == 30
    assert np.ptp(np.diff(shown)) <= 1
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
    received, view.measured = [], Measured(40.0)
    client.send = received.append
    client.show = lambda frame, sequence: received.append(decode_frame(frame))
    sizes = [(2, 2)]
    view.send(state("starting", starts_ms=1000.0))
    view.send(state("playing", sizes))
    view.send(encode_target(0, 1, FIELDS[0]))
    view.show(moment(3), 3)
    view.send(state("over"))
    sizes.append((3, 1))
    assert not received
    while len(received) < 5:
        await asyncio.sleep(0.01)
    starting, playing, target, frame, over = received
    assert (starting.phase, starting.starts_ms) == ("starting", 1040.0)
    assert (playing.phase, playing.sizes) == ("playing", [(2, 2)]), "as it was, not as it is by now"
    assert target[0] == 2 and (frame.tick, frame.server_ms) == (3, 340.0) and over.phase == "over"
    assert view.measured.summary().count == 1 and view.measured.summary().got_ms >= 39.0
    view.show(moment(4), 4)
    view.close()
    await asyncio.sleep(0.08)
    assert len(received) == 5, "who is elsewhere is shown nothing more"
