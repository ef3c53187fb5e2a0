"""A worker does its work in order, and no error ends the event loop."""

import asyncio
import threading

import pytest

from swarm_pz.play.server.worker import Worker


@pytest.fixture
def worker():
    made = Worker("test")
    yield made
    made.close()


async def test_work_is_done_in_turn_by_one_thread_and_left_out_if_nobody_waits_any_more(worker):
    order, goes_on = [], threading.Event()

    def work(number):
        goes_on.wait(60)
        order.append((number, threading.current_thread()))
        return number

    first, second, *rest = (worker.do(work, number) for number in range(4))
    first.cancel()  # it may have begun; the next one begins after it
    second.cancel()
    goes_on.set()
    assert await asyncio.gather(*rest) == [2, 3]
    assert [number for number, _ in order][-2:] == [2, 3] and 1 not in dict(order)
    assert len({thread for _, thread in order}) == 1 and threading.current_thread() not in dict(map(reversed, order))


class EscapeError(BaseException):
    """An error that nobody expects."""


async def test_what_would_end_the_event_loop_is_an_error_like_others(worker):
    def work(fault):
        raise fault

    for fault in (KeyboardInterrupt, SystemExit, GeneratorExit, StopIteration, EscapeError):
        with pytest.raises(RuntimeError, match=fault.__name__):
            await worker.do(work, fault)
    assert await worker.do(lambda: "done") == "done"


async def test_a_worker_that_is_closed_does_first_what_it_was_given():
    worker, done = Worker("test"), []
    for number in range(3):
        worker.do(done.append, number)
    worker.close(wait=True)
    assert done == [0, 1, 2]
