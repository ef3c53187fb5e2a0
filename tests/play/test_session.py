"""The server answers a client as session.json has it; room.test.js compares the game in the page with the same file."""

import asyncio
import json
from pathlib import Path

import numpy as np

from swarm_pz.play import protocol
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import until

STEPS = json.loads((Path(__file__).parent / "session.json").read_text())


def heard(guest):
    """Return the last answer that the session names."""
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

    hall.context.workers.answer = answer  # the game waits for it: no countdown is over before all is said in it
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
