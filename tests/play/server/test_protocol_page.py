"""The examples of version 2 on the protocol's page, line by line: what clients say there is answered so."""

import json
import re
from pathlib import Path

import pytest

from swarm_pz.play import protocol
from tests.play.server.test_client_handler import Guest, visiting
from tests.play.server.test_room import playing, until

PAGE = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text()
OF_THEIR_TIME = {"room", "token", "server_ms", "tick"}


def conversation(heading):
    """Return the lines of the example under a heading."""
    return re.search(rf"## {heading}\n.*?```\n(.*?)```", PAGE, re.DOTALL).group(1).splitlines()


def like(message, expected):
    told = json.loads(protocol.encode(message))
    same = {key: value for key, value in expected.items() if key not in OF_THEIR_TIME}
    return set(told) == set(expected) and same.items() <= told.items()


async def hold(hall, guest, lines):
    for line in lines:
        text = line[2:]
        if line.startswith(">"):
            guest.handler.hear(text)
            if json.loads(text)["type"] == "ready":
                await playing(hall.room())
        else:
            expected = json.loads(text)
            await until(lambda expected=expected: any(like(message, expected) for message in guest.messages))


def test_commands_of_other_kinds_are_answered_as_the_page_says(tmp_path):
    async def script(hall):
        await hold(hall, Guest(hall), conversation("Commands of other kinds"))

    visiting(tmp_path, script)


def test_automatic_responses_act_as_the_page_says(tmp_path):
    lines = conversation("Automatic responses")
    assert sum('"silent_s":5}' in line for line in lines) == 1

    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.Create(settings=protocol.Settings(blue=0, time_limit=None)))
        guest.say(protocol.Ready())
        await playing(hall.room())
        await hold(hall, guest, [line.replace('"silent_s":5}', '"silent_s":0.5}') for line in lines])

    visiting(tmp_path, script)


@pytest.mark.parametrize("heading", ["Commands of other kinds", "Automatic responses"])
def test_every_line_of_the_examples_is_a_message(heading):
    for line in conversation(heading):
        (protocol.decode_client if line.startswith(">") else protocol.decode_server)(line[2:])
