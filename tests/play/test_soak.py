"""Rooms with clients that drop, return, flood and send garbage, for half a minute; an hour of it is a benchmark."""

import asyncio

from benchmarks.table.load import soak


def test_nothing_is_lost_and_nothing_is_left():
    figures = asyncio.run(soak(30.0, rooms=6))
    assert figures["rooms_lost"] == 0
    assert figures["clients_without_frames"] == 0
    assert figures["connections_left"] == 0
    assert figures["rooms_left"] == 0
    assert figures["tasks_left"] <= 0
    assert figures["files_left"] <= 0
    assert figures["recordings"] >= 6, "a game that is won is followed by another"
