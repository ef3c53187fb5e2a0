"""A worker does work in turn; what hangs holds up nobody else, and nothing ends the event loop."""

import asyncio
import threading

import pytest

from swarm_pz.play.server.worker import HangingError, Worker

pytestmark = pytest.mark.anyio


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


@pytest.mark.parametrize("stays", [True, False])
async def test_what_hangs_is_given_up_and_its_client_waits_until_it_comes_back(stays, worker):
    """Also if nobody waits for it: else a client that vanished would hold up everybody."""
    comes_back, hung = threading.Event(), []

    def hang():
        hung.append(threading.current_thread())
        comes_back.wait(60)

    late = worker.do(hang, limit_s=0.1, client="stuck")
    next_one, other = worker.do(hang, client="stuck"), worker.do(lambda: "done", client="well")
    if stays:
        with pytest.raises(TimeoutError):
            await late
    else:
        while not hung:
            await asyncio.sleep(0)
        late.cancel()
    with pytest.raises(HangingError):
        await next_one
    assert await other == "done" and len(hung) == 1
    comes_back.set()
    hung[0].join(60)
    assert await worker.do(lambda: "done", client="stuck") == "done"


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
