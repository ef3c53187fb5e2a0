"""Which web pages may connect to a rosbridge."""

import asyncio
import socket
from unittest.mock import Mock

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from swarm_pz.errors import CommandError
from swarm_pz.play.ros.origins import origins_of
from swarm_pz.play.ros.rosbridge import Rosbridge


async def _is_let_in(port, origin):
    try:
        async with connect(f"ws://127.0.0.1:{port}", origin=origin):
            return True
    except InvalidStatus:
        return False


def test_programs_and_pages_of_this_machine_are_let_in_and_others_when_they_are_named():
    async def play(*named):
        bridge, listening = Rosbridge(Mock(), {}), socket.create_server(("127.0.0.1", 0))
        await bridge.open(listening, *[origins_of("127.0.0.1", named)] if named else [])
        port = listening.getsockname()[1]
        pages = (
            None,
            "http://localhost:8000",
            "http://127.0.0.1",
            "https://lab.example",
            "http://localhost.evil.example",
        )
        try:
            return [await _is_let_in(port, page) for page in (*pages, "file://")]
        finally:
            await bridge.close()

    assert asyncio.run(play()) == [True, True, True, False, False, False], "whoever embeds a bridge, too"
    assert asyncio.run(play("https://LAB.example/", "file://")) == [True, True, True, True, False, True]


def test_what_is_no_address_of_a_page_is_named():
    with pytest.raises(CommandError, match="--ros-origin takes the address of a page without its path, such as"):
        origins_of("127.0.0.1", ["lab.example"])
