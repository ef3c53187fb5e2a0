"""Commands are made one at a time, and what hangs while one is made holds up nobody else."""

import asyncio
import gc
import threading
import time

import pytest

from swarm_pz.errors import CommandError
from swarm_pz.play.server import painter as module
from swarm_pz.play.server.painter import Painter


@pytest.fixture
def painter(monkeypatch):
    monkeypatch.setattr(module, "MAKE_S", 0.2)
    return Painter()


def test_commands_are_made_in_turn_by_one_thread_and_whoever_leaves_keeps_nobody_waiting_twice(painter):
    order, goes_on = [], threading.Event()

    def work(number):
        goes_on.wait(60)
        order.append((number, threading.current_thread()))
        return number

    async def script():
        module.MAKE_S = 60.0
        first, second, *rest = (asyncio.create_task(painter.make(lambda n=n: work(n), "one")) for n in range(4))
        await asyncio.sleep(0.01)
        first.cancel()  # is being made
        second.cancel()  # waits
        goes_on.set()
        assert await asyncio.gather(*rest) == [2, 3]

    asyncio.run(script())
    assert [number for number, _ in order] == [0, 2, 3] and len({thread for _, thread in order}) == 1


def test_a_command_that_cannot_be_made_after_whoever_gave_it_has_left_is_no_fault_of_the_server(painter):
    """asyncio logged it with a traceback: nobody had looked at the error."""
    goes_on, faults = threading.Event(), []

    def work():
        goes_on.wait(60)
        raise CommandError("lines may cover the map 100 times")

    async def script():
        asyncio.get_running_loop().set_exception_handler(lambda _, fault: faults.append(fault))
        left = asyncio.create_task(painter.make(work, "ergodic"))
        await asyncio.sleep(0)
        left.cancel()
        goes_on.set()
        await painter.make(lambda: "made", "ergodic")
        gc.collect()

    asyncio.run(script())
    assert not faults


def test_a_system_that_hangs_over_a_command_reads_no_other_until_it_comes_back_and_others_go_on(painter):
    comes_back, hung = threading.Event(), []

    def hang():
        hung.append(threading.current_thread())
        comes_back.wait(60)

    async def script():
        with pytest.raises(CommandError, match=r"stuck did not read that command within 0\.2 s"):
            await painter.make(hang, "stuck")
        with pytest.raises(CommandError, match="stuck still reads another command"):
            await painter.make(hang, "stuck")
        assert len(hung) == 1, "each would keep a thread"
        assert await painter.make(lambda: "made", "well") == "made"
        comes_back.set()
        hung[0].join(60)
        assert await painter.make(lambda: "made", "stuck") == "made"

    asyncio.run(script())


class EscapeError(BaseException):
    """What nobody expects."""


@pytest.mark.parametrize("fault", [KeyboardInterrupt, SystemExit, GeneratorExit, StopIteration, EscapeError])
def test_what_would_end_the_server_is_an_error_like_others(fault, painter):
    def work():
        raise fault

    async def script():
        with pytest.raises(RuntimeError):
            await painter.make(work, "one")
        assert await painter.make(lambda: "made", "one") == "made"

    asyncio.run(script())


def test_own_systems_may_take_their_time(painter):
    async def script():
        assert await painter.make(lambda: time.sleep(0.5) or "made", "ergodic") == "made"

    asyncio.run(script())
