"""What waits comes in order and not before its time, and how long it waited is told."""

import asyncio
import time

import pytest

from swarm_pz.play.server import delays
from swarm_pz.play.server.delays import DelayLine, Measured


class Clock:
    """A clock and a loop that go where a test wants them."""

    def __init__(self, monkeypatch):
        self.now, self.timers = 0.0, []
        monkeypatch.setattr(delays.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(delays.asyncio, "get_running_loop", lambda: self)

    def call_later(self, seconds, act):
        timer = [self.now + seconds, act]
        self.timers.append(timer)
        return Handle(self, timer)

    def go(self, seconds):
        """Let time pass; timers act at their times."""
        end = self.now + seconds
        while due := [timer for timer in self.timers if timer[0] <= end]:
            timer = min(due, key=lambda one: one[0])
            self.timers.remove(timer)
            self.now = timer[0]
            timer[1]()
        self.now = end


class Handle:
    """A timer that can be cancelled."""

    def __init__(self, clock, timer):
        self.clock, self.timer = clock, timer

    def cancel(self):
        self.clock.timers.remove(self.timer)


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


def test_all_come_later_and_in_order(clock):
    line, measured, done = DelayLine(300.0), Measured(300.0), []
    for name, pause in (("a", 0.125), ("b", 0.0), ("c", 0.25)):
        line.put(lambda name=name: done.append((name, clock.now)), measured)
        clock.go(pause)
    clock.go(1.0)
    assert done == [("a", pytest.approx(0.3)), ("b", pytest.approx(0.425)), ("c", pytest.approx(0.425))]
    told = measured.told()
    assert (told.asked_ms, told.got_ms, told.count) == (300.0, pytest.approx(300.0), 3)


def test_without_a_delay_it_is_done_at_once(clock):
    line, measured, done = DelayLine(0.0), Measured(0.0), []
    line.put(lambda: done.append("a"), measured)
    assert done == ["a"] and not clock.timers
    assert (measured.told().got_ms, measured.told().count) == (0.0, 1)


def test_what_still_waits_at_the_end_is_given_back(clock):
    line, done = DelayLine(100.0), []
    line.put(lambda: done.append("a"))
    line.put(lambda: done.append("b"))
    left = line.close()
    clock.go(1.0)
    assert done == [] and not line.close()
    for act in left:
        act()
    assert done == ["a", "b"]


def test_of_nothing_there_is_no_median():
    told = Measured(50.0).told()
    assert (told.asked_ms, told.got_ms, told.count) == (50.0, None, 0)


def test_what_was_got_is_the_median():
    measured = Measured(50.0)
    for ms in (50.0, 52.0, 900.0):
        measured.note(ms)
    assert measured.told().got_ms == 52.0


def test_on_a_real_loop_nothing_comes_before_its_time():
    async def play():
        line, came = DelayLine(30.0), []
        began = time.monotonic()
        done = asyncio.Event()
        line.put(lambda: came.append(time.monotonic() - began))
        line.put(done.set)
        await asyncio.wait_for(done.wait(), 60)
        return came

    assert asyncio.run(play())[0] >= 0.029
