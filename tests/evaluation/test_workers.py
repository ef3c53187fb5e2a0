"""Whoever does the work, it is done once, kept by the one that shared it out, and stopped where nothing is lost."""

from __future__ import annotations

import os
import threading
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import pytest

from swarm_pz.errors import ConfigError, Stopped, WorkerError
from swarm_pz.evaluation.workers import BackgroundTasks, LostTaskError, Processes, SerialExecutor, open_pool, share


def double(number):
    if number < 0:
        os._exit(3)
    if number == 13:
        raise ZeroDivisionError("thirteen")
    return 2 * number


def shared(pool, numbers, **given):
    kept = {}
    share(pool, double, [(number,) for number in numbers], lambda task, result: kept.update({task: result}), **given)
    return kept


@pytest.mark.parametrize("pool", [SerialExecutor, lambda: Processes(2), lambda: ThreadPoolExecutor(2)])
def test_every_pool_does_every_task_once(pool):
    with pool() as workers:
        assert shared(workers, range(12)) == {(number,): 2 * number for number in range(12)}


def test_one_process_is_this_one_and_more_are_others():
    with open_pool(1) as alone, open_pool(3) as others:
        assert isinstance(alone, SerialExecutor) and isinstance(others, Processes) and others.slots == 6
        assert alone.submit(os.getpid).result() == os.getpid()
    with pytest.raises(ConfigError, match="processes must be"):
        open_pool(0)


def test_what_a_task_raises_is_raised_and_what_was_done_before_is_kept():
    kept = []
    with pytest.raises(ZeroDivisionError, match="thirteen"):
        share(SerialExecutor(), double, [(1,), (13,), (2,)], lambda *done: kept.append(done))
    assert kept == [((1,), 2)]


def test_who_died_is_named_and_what_was_done_is_kept():
    kept = []
    with open_pool(2) as pool, pytest.raises(WorkerError, match=r"died while these were measured: .*number -1"):
        share(
            pool,
            double,
            [(-1,)],
            lambda *done: kept.append(done),
            name=lambda task: f"number {task[0]}",
            verb="measured",
        )
    assert kept == []


class Held(Executor):
    """Does nothing by itself: a test says what comes of each task."""

    slots = 3

    def __init__(self):
        self.given = []

    def submit(self, fn, /, *args):
        future = Future()
        self.given.append((args, future))
        if args == ("lost",):
            future.set_exception(LostTaskError("three died"))
        elif args == ("done",):
            future.set_result("done")
        elif args == ("begun",):
            future.set_running_or_notify_cancel()
            threading.Timer(0.05, future.set_result, ["begun"]).start()
        return future


def test_a_task_that_kills_its_workers_is_named_alone_and_others_that_began_are_kept():
    pool, kept = Held(), []
    with pytest.raises(WorkerError, match=r"died while these were played: \('lost',\); run it again"):
        share(pool, str, [("begun",), ("lost",), ("queued",), ("never",)], lambda task, _: kept.append(task))
    assert kept == [("begun",)]
    assert [args for args, _ in pool.given] == [("begun",), ("lost",), ("queued",)]
    assert pool.given[2][1].cancelled()


def test_who_is_asked_to_stop_gives_out_no_more_and_keeps_what_was_begun():
    pool, kept = Held(), []
    tasks = [("begun",), ("done",), ("queued",), ("never",)]
    share(pool, str, tasks, lambda task, _: kept.append(task), should_stop=lambda: bool(kept))
    assert sorted(kept) == [("begun",), ("done",)]
    assert len(pool.given) == 3 and pool.given[2][1].cancelled()


def test_an_interrupt_ends_the_pool_at_once():
    class Endless(Held):
        def end(self):
            for _, future in self.given:
                future.set_exception(LostTaskError("ended"))

    pool, kept = Endless(), []
    with pytest.raises(KeyboardInterrupt):
        share(pool, str, _interrupted(), lambda task, _: kept.append(task))
    assert kept == [] and isinstance(pool.given[0][1].exception(), LostTaskError)


def _interrupted():
    yield ("queued",)
    raise KeyboardInterrupt


@pytest.mark.parametrize("pool", [SerialExecutor, lambda: ThreadPoolExecutor(2)])
def test_what_an_errand_brings_is_there_when_it_is_wanted(pool):
    with pool() as workers, BackgroundTasks(workers) as background:
        background.send("six", double, 6)
        background.send("thirteen", double, 13)
        assert background.fetch("six") == 12
        with pytest.raises(ZeroDivisionError, match="thirteen"):
            background.fetch("thirteen")
        assert not background.is_elsewhere and background.is_here is isinstance(workers, SerialExecutor)


def test_who_died_on_an_errand_is_named():
    with BackgroundTasks(Held()) as background:
        background.send("the exploiter", str, "lost")
        with pytest.raises(WorkerError, match="died while these were done: the exploiter"):
            background.fetch("the exploiter")


def test_who_is_asked_to_stop_does_not_wait_for_an_errand_and_ends_what_is_under_way():
    class Ended(Held):
        ended = 0

        def end(self):
            self.ended += 1

    pool = Ended()
    with BackgroundTasks(pool) as background:
        background.send("the exploiter", str, "queued")
        pool.given[0][1].set_running_or_notify_cancel()
        background.send("later", str, "queued")
        with pytest.raises(Stopped, match="the exploiter is under way"):
            background.fetch("the exploiter", lambda: True)
    assert pool.ended == 1 and pool.given[1][1].cancelled()
    with BackgroundTasks(pool) as background:
        background.send("done", str, "done")
        assert background.fetch("done") == "done"
    assert pool.ended == 1
