"""The server replies to a client as session.json says; room.test.js tests the page's own game by the same file."""

import asyncio
import json
from pathlib import Path

import numpy as np

from swarm_pz.play import protocol
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import until

STEPS = json.loads((Path(__file__).parent / "session.json").read_text())


def heard(guest):
    """Return the latest reply of a kind that session.json can name, or None."""
    for message in reversed(guest.messages):
        if isinstance(message, protocol.Refused):
            return {"refused": message.code}
        if isinstance(message, protocol.Received):
            return {"received": message.number}
        if isinstance(message, protocol.RoomState):
            over = {"outcome": message.outcome, "ended_by": message.ended_by} if message.phase == "over" else {}
            return {"phase": message.phase} | over
    return None


async def test_a_session_goes_as_in_the_page(tmp_path):
    hall, counted_down = Hall(tmp_path), asyncio.Event()

    async def answer(seat):
        await counted_down.wait()
        return np.ones((10, 10))

    hall.context.workers.answer = answer  # delays the start until the session's steps in the countdown are done
    guest = Guest(hall)
    try:
        for number, step in enumerate(STEPS):
            if "say" in step:
                guest.handler.hear(json.dumps(step["say"]))
            elif "hear" not in step:
                counted_down.set()
                await asyncio.sleep(step["pause_ms"] / 1000)
            if "hear" in step:
                await until(lambda: heard(guest) == step["hear"])  # noqa: B023
                assert heard(guest) == step["hear"], (number, step)
    finally:
        hall.close()
