"""Rooms with clients that drop, return, flood and send garbage, for some seconds; an hour of it is a benchmark."""

import asyncio

from benchmarks.table.load import soak


def test_nothing_is_lost_and_nothing_is_left():
    figures = asyncio.run(soak(5.0, rooms=2))
    for name in ("rooms_lost", "clients_without_frames", "connections_left", "rooms_left"):
        assert figures[name] == 0, name
    assert figures["tasks_left"] <= 0 and figures["files_left"] <= 0
    assert figures["recordings"] >= 3
