"""What waits comes in order and not before its time, and how long it waited is told."""

import asyncio
import time
from functools import partial

import pytest

from swarm_pz.play.server.delays import DelayLine, Measured

pytestmark = pytest.mark.anyio


async def test_all_come_later_and_in_order():
    line, measured, came, waited = DelayLine(30.0), Measured(30.0), asyncio.Queue(), []

    def note(name, put):
        came.put_nowait((name, time.monotonic() - put))

    for name, pause in (("a", 0.01), ("b", 0.0), ("c", 0.02)):
        line.put(partial(note, name, time.monotonic()), measured)
        await asyncio.sleep(pause)
    for expected in "abc":
        name, seconds = await came.get()
        waited.append(seconds)
        assert name == expected
    told = measured.told()
    assert min(waited) >= 0.029 and (told.asked_ms, told.count) == (30.0, 3) and told.got_ms >= 29.0


def test_without_a_delay_it_is_done_at_once():
    line, measured, done = DelayLine(0.0), Measured(0.0), []
    line.put(lambda: done.append("a"), measured)
    assert done == ["a"] and (measured.told().got_ms, measured.told().count) == (0.0, 1)


async def test_what_still_waits_at_the_end_is_given_back():
    line, done = DelayLine(20.0), []
    for name in "ab":
        line.put(lambda name=name: done.append(name))
    left = line.close()
    await asyncio.sleep(0.05)
    assert done == [] and not line.close()
    for act in left:
        act()
    assert done == ["a", "b"]


@pytest.mark.parametrize(("waited", "got"), [([], None), ([50.0, 52.0, 900.0], 52.0)])
def test_what_was_got_is_the_median(waited, got):
    measured = Measured(50.0)
    for ms in waited:
        measured.note(ms)
    assert (measured.told().got_ms, measured.told().count) == (got, len(waited))
