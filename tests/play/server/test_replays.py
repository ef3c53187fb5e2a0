"""Recorded games at a table whose processes end: the table says so, and goes on."""

import asyncio
import os
import signal

import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.recordings.sandbox import Sandbox
from swarm_pz.play.server.replay_session import ReplaySession
from swarm_pz.play.server.replays import Replays
from tests.play.recordings.test_format import record
from tests.play.recordings.test_playback import CALM
from tests.play.server.test_room import Client, until


def crash(sandbox: Sandbox) -> None:
    """End the process as a fault in a kernel would."""
    os.kill(sandbox.do("", os.getpid), signal.SIGSEGV)


def test_a_file_that_ends_the_process_which_reads_it_is_named_and_the_next_one_is_shown(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)

    async def visit():
        replays, client = Replays(), Client()
        try:
            replays.warm()
            crash(replays._reader)
            with pytest.raises(RecordingError, match=r"a\.jsonl ended the process .*\(SIGSEGV\)"):
                await replays.read(tmp_path / "a.jsonl")
            session = ReplaySession(await replays.read(tmp_path / "a.jsonl"), client)
            await until(lambda: client.frames)
            session.close()
        finally:
            replays.close()

    asyncio.run(visit())


def test_a_game_whose_process_has_ended_says_so_and_can_be_opened_again(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)

    async def visit():
        replays, client = Replays(), Client()
        try:
            first = await replays.read(tmp_path / "a.jsonl")
            session = ReplaySession(first, client)
            await until(lambda: client.frames)
            crash(replays._player)
            await until(lambda: client.heard(protocol.Notice))
            assert "cannot be shown any further" in client.heard(protocol.Notice)[0].text
            with pytest.raises(RecordingError, match="open it again"):
                await session.moment()
            session.close()
            again = await replays.read(tmp_path / "a.jsonl")
            moment = await again.ask("moment", 45)
            moment.game.advance(30)  # it is here, and goes on without that process
            assert moment.game.tick == 75 and moment.origin.tick == 45
        finally:
            replays.close()

    asyncio.run(visit())
