"""ROS programs at a table: seats, commands, what subscribers see, and who plays which side."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect

from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, RecordingError
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import InForceMessage, SeatCommand
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.ros.bridge import Bridge, listen
from swarm_pz.play.ros.rosbridge import origins_of

ROOT = Path(__file__).parents[3]
ERGODIC = GameConfig(time_limit=600.0)
PATIENCE_S = 300.0


class Program:
    """A connected ROS program."""

    def __init__(self, link):
        self._link, self.heard = link, []

    async def say(self, **message):
        await self._link.send(json.dumps(message))

    async def publish(self, topic, **message):
        await self.say(op="publish", topic=topic, msg=message)

    async def connect_player(self, side):
        """Do what the tablet does when its button is pressed."""
        await self.say(op="advertise", topic=f"{side}_connection_service", type="std_msgs/Empty")
        await self.publish(f"{side}_connection_service")

    async def deploy(self, side, image):
        """Do what the tablet does with a drawing."""
        kind = "ergodic_humanswarmcollab_sim/tablet"
        await self.say(op="advertise", topic="/tablet_comm", type=kind)
        fields = {"name": "attract data", "team": side, "map_width": 50, "map_height": 50}
        await self.publish("/tablet_comm", **fields, data=image.ravel().tolist())

    async def subscribe(self, *topics):
        for topic in topics:
            await self.say(op="subscribe", topic=topic)

    async def hear(self, topic, where=lambda message: True):
        """Receive until a message of a topic comes."""
        while True:
            packet = json.loads(await self._link.recv())
            self.heard.append(packet)
            if packet.get("topic") == topic and where(packet["msg"]):
                return packet["msg"]

    async def refused(self, topic, **message):
        """Publish something, and return why it is refused."""
        await self.publish(topic, **message)
        return (await self.hear("/rosout", lambda message: message["level"] == 30))["msg"]

    async def leave(self):
        await self._link.close()


class Meeting:
    """A bridge and the programs connected to it."""

    def __init__(self, port, lines, stack):
        self.port, self._stack, self.lines = port, stack, lines

    async def join(self, **options):
        """Connect another program, which receives refusals, and return it."""
        link = await self._stack.enter_async_context(connect(f"ws://127.0.0.1:{self.port}", max_size=None, **options))
        program = Program(link)
        await program.subscribe("/rosout")
        return program

    async def room(self, side="red"):
        """Wait until a side has a seat, and return its room."""
        return await self.printed(rf"{side}: plays in room (\w+)")

    async def printed(self, pattern):
        """Wait for a matching line, and return the pattern's group, or the line."""
        while True:
            for line in self.lines:
                if found := re.search(pattern, line):
                    return found[1] if found.groups() else line
            await asyncio.sleep(0.05)


def meet(table, conversation, opponent="uniform", game=ERGODIC, **options):
    """Run a conversation at a bridge beside a table."""

    async def run():
        listening, lines = socket.create_server(("127.0.0.1", 0)), []
        rules, origins = TableConfig(game=game), origins_of("127.0.0.1")
        bridge = Bridge(opponent, rules, origins, None, table.address, lines.append, **options)
        serving = asyncio.create_task(bridge.run(listening))
        try:
            async with contextlib.AsyncExitStack() as stack, asyncio.timeout(PATIENCE_S):
                await conversation(Meeting(listening.getsockname()[1], lines, stack))
        finally:
            serving.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await serving

    asyncio.run(run())


def at_bridge(**options):
    """Return a decorator that turns a conversation, a coroutine function of a meeting and a table, into a test."""

    def test_of(conversation):
        def test(table):
            meet(table, lambda meeting: conversation(meeting, table), **options)

        test.__name__ = conversation.__name__
        return test

    return test_of


async def recorded(table, room, kind, count=1, teams=(0,)):
    """Wait until a room's recording has `count` lines of a kind by `teams`, and return them."""
    while True:
        with contextlib.suppress(RecordingError, ValueError, OSError):
            lines = [line for line in Recording.read(table.recording(room)).of(kind) if line.team in teams]
            if len(lines) >= count:
                return lines
        await asyncio.sleep(0.1)


def spot(seed):
    """Return an image as a tablet draws it (50, 50), which sums to 10."""
    image = np.random.default_rng(seed).random((50, 50)).astype(np.float32) ** 8
    return 10.0 * image / image.sum()


def is_of(line, image):
    """Return true if a recorded command is that of an image (50, 50)."""
    wanted = image.reshape(10, 5, 10, 5).mean(axis=(1, 3), dtype=np.float64)
    wanted -= wanted.min()
    return np.allclose(np.array(line.density), (wanted / wanted.max()) ** 4, rtol=0, atol=1e-7)


@at_bridge()
async def test_of_images_that_come_at_once_the_last_becomes_the_target(meeting, table):
    tablet = await meeting.join()
    await tablet.connect_player("red")
    for number in range(5):
        await tablet.deploy("red", spot(number))
    while not is_of((await recorded(table, await meeting.room(), SeatCommand))[-1], spot(4)):
        await asyncio.sleep(0.05)
    assert not [line for line in meeting.lines if "refused" in line], "no command came too soon"


@at_bridge(opponent=None)
async def test_two_tablets_meet_in_one_room_see_one_game_and_clear_their_own_side(meeting, table):
    red, blue = await meeting.join(), await meeting.join()
    await blue.connect_player("blue")
    await red.connect_player("red")
    room = await meeting.room("red")
    assert room == await meeting.room("blue")
    await red.subscribe("/clock", "/swarm/sizes", "/swarm/blue/capture_field")
    await red.subscribe("/red_team_target_dist", "/blue_team_target_dist")
    await red.hear("/swarm/blue/capture_field")
    await blue.publish("clear_locs")
    (line,) = await recorded(table, room, SeatCommand, teams=(0, 1))
    assert line.team == 1 and np.ptp(line.density) == 0.0
    await red.deploy("red", spot(1))
    await blue.deploy("blue", spot(2))
    target = await red.hear("/red_team_target_dist")
    assert target["info"]["width"] == 50 and max(target["data"]) == 100
    for team in (0, 1):
        await recorded(table, room, InForceMessage, teams=[team])
    for _ in range(30):
        await red.hear("/clock")
    clocks = [one["msg"]["clock"] for one in red.heard if one.get("topic") == "/clock"]
    times = [clock["sec"] + clock["nanosec"] * 1e-9 for clock in clocks]
    assert times == sorted(set(times))
    assert not [one for one in red.heard if one.get("topic") == "/blue_team_target_dist"], "it is blue's own"


@at_bridge()
async def test_a_side_is_played_by_the_client_that_last_spoke_for_it(meeting, table):
    tablet, stranger = await meeting.join(), await meeting.join()
    await tablet.connect_player("red")
    room = await meeting.room()
    image = {"data": [1.0] * 100}
    assert "by the policy uniform" in await stranger.refused("blue_connection_service")
    assert "nobody has taken blue" in await stranger.refused("/swarm/blue/density", **image)
    assert "got 'green'" in await stranger.refused("/tablet_comm", team="green", **image)
    assert "got ['red']" in await stranger.refused("/tablet_comm", team=["red"], **image)
    assert "2499 values" in await stranger.refused("/tablet_comm", team="red", data=[1.0] * 2499)
    tablet._link.transport.pause_reading()  # the bridge does not notice that it is gone
    again = await meeting.join()
    await again.deploy("red", spot(1))  # it does not press its button again
    await recorded(table, room, InForceMessage)
    assert len([line for line in meeting.lines if "plays in room" in line]) == 1
    tablet._link.transport.abort()


@at_bridge(alone_s=0.0)
async def test_seats_are_given_up_when_all_have_gone_and_not_before(meeting, table):
    tablet, other = await meeting.join(), await meeting.join()
    await tablet.connect_player("red")
    first = await meeting.room()
    await other.connect_player("red")
    await other.leave()
    await tablet.deploy("red", spot(1))
    await recorded(table, first, InForceMessage)
    assert not [line for line in meeting.lines if "ended the connection" in line]
    await tablet.leave()
    await meeting.printed("red: the table has ended the connection")
    meeting.lines.clear()
    again = await meeting.join()
    await again.connect_player("red")
    assert await meeting.room() != first


@at_bridge(game=GameConfig(time_limit=1.5))
async def test_a_game_over_is_followed_by_another_when_the_button_is_pressed(meeting, table):
    tablet = await meeting.join()
    await tablet.subscribe("/clock", "/rosout")
    await tablet.connect_player("red")
    await tablet.hear("/clock", lambda message: message["clock"]["sec"] == 1)
    room = await meeting.room()
    first = table.recording(room)
    await tablet.hear("/rosout", lambda message: message["msg"] == "red: the game is over: a draw")
    while Recording.read(first).end is None:
        await asyncio.sleep(0.1)
    while True:
        await tablet.connect_player("red")
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(0.5):
                await tablet.hear("/clock", lambda message: message["clock"]["sec"] == 0)
                break
    assert table.recording(room, other_than=first) > first


@pytest.mark.parametrize(
    ("system", "topic", "message", "kind"),
    [
        ("flocking", "flocking_command", {"x": 0.2, "y": 0.8, "migration_weight": 75}, "attractors"),
        ("direct", "/swarm/red/command", {"data": [0.5, -0.5] * 20}, "accelerations"),
    ],
)
def test_a_seat_of_another_kind_takes_its_own_commands_and_clear_ones(system, topic, message, kind, table):
    async def conversation(meeting):
        program = await meeting.join()
        await program.connect_player("red")
        if system == "direct":  # whether or not the bridge knows yet what the seat takes
            assert "direct takes accelerations" in await program.refused("/swarm/red/density", data=[1.0] * 100)
        room = await meeting.printed(rf"red: plays in room (\w+), flown by {system}")
        await program.publish(topic, **message)
        await recorded(table, room, InForceMessage)
        await program.publish("clear_locs")
        first, second = (await recorded(table, room, SeatCommand, 2))[:2]
        assert first.command is not None and np.array(first.command).ravel()[0] in (0.2, 0.5)
        assert second.command is not None or second.density is not None
        if system == "direct":
            assert "red: command is refused: red's command" in await program.refused(topic, data=[9.0] * 40)
        else:
            poses = [{"position": {"x": 0.123456789, "y": 0.987654321}}] * 20_000
            assert "65536 bytes" in await program.refused("/swarm/red/attractors", poses=poses)
            await program.publish(topic, **message)
            await recorded(table, room, SeatCommand, 3)
            assert not [line for line in meeting.lines if "ended the connection" in line]

    meet(table, conversation, game=GameConfig(time_limit=600.0, controllers=(system, "ergodic")))


def test_what_is_refused_stands_in_the_log_of_who_said_it_and_a_table_that_is_not_there_is_told_of():
    class Nowhere:
        address = "127.0.0.1:1"

    async def conversation(meeting):
        one, other, reader = await meeting.join(), await meeting.join(), await meeting.join()
        for program, side in ((one, "red"), (other, "blue")):
            await program.publish(f"/swarm/{side}/density", data=[1.0] * 100)
            assert f"nobody has taken {side}" in (await program.hear("/rosout"))["msg"]
        assert await reader.refused("/tablet_comm")  # so its subscription has been handled, too
        await one.connect_player("red")
        line = await reader.hear("/rosout", lambda message: "red: has no seat at the table" in message["msg"])
        assert line["level"] == 30
        await other.connect_player("blue")
        await meeting.printed("blue: has no seat at the table")

    meet(Nowhere, conversation, opponent=None)


def test_a_port_that_is_taken_is_said():
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(CommandError, match="another rosbridge"):
        listen("127.0.0.1", taken.getsockname()[1])


@at_bridge()
async def test_the_documentations_program_plays_with_a_real_client(meeting, table):
    (program,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "ros.md").read_text(), re.S)
    command = [sys.executable, "-u", "-c", program.replace("port=9090", f"port={meeting.port}")]
    playing = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE)
    shown = 0
    while shown < 10:
        line = await playing.stdout.readline()
        assert line, "the program has ended"
        shown += b" red drones" in line and int(line.split()[0]) > 0
    commands = await recorded(table, await meeting.room(), SeatCommand)
    assert all(line.density == [[1.0] * 10] * 5 + [[0.0] * 10] * 5 for line in commands)
    playing.kill()
    await playing.wait()
