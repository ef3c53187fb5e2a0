"""In every pool a task runs once, the process that shared it out keeps its result, and a stop loses nothing."""

import os
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import pytest

from swarm_pz.errors import ConfigError, Stopped, WorkerError
from swarm_pz.evaluation.processes import LostTaskError
from swarm_pz.evaluation.workers import BackgroundTasks, Processes, SerialExecutor, open_pool, share


def double(number):
    if number < 0:
        os._exit(3)
    if number == 13:
        raise ZeroDivisionError("thirteen")
    return 2 * number


def test_one_process_is_this_one_and_more_are_others_of_which_one_that_ends_is_named():
    kept = []
    with open_pool(1) as alone, open_pool(2) as others:
        assert isinstance(others, Processes) and (others.count, others.slots) == (2, 4)
        assert alone.submit(os.getpid).result() == os.getpid()
        share(others, double, [(3,)], lambda *done: kept.append(done))
        with pytest.raises(WorkerError, match=r"died while these were measured: number -1"):
            share(others, double, [(-1,)], print, name=lambda task: f"number {task[0]}", verb="measured")
    assert kept == [((3,), 6)]
    with pytest.raises(ConfigError, match="processes must be"):
        open_pool(0)


def test_what_a_task_raises_is_raised_and_what_was_done_before_is_kept():
    kept = []
    with pytest.raises(ZeroDivisionError, match="thirteen"):
        share(SerialExecutor(), double, [(1,), (13,), (2,)], lambda *done: kept.append(done))
    assert kept == [((1,), 2)]


class Held(Executor):
    """Runs nothing: a task's argument says what becomes of it; one that has begun ends when `cancel` is tried."""

    slots, ended = 3, 0

    def __init__(self):
        self.futures = []

    def submit(self, fn, /, *args):
        future = Future()
        self.futures.append(future)
        if args == ("lost",):
            future.set_exception(LostTaskError("three died"))
        elif args == ("done",):
            future.set_result("done")
        elif args == ("begun",):
            future.set_running_or_notify_cancel()
            cancel = future.cancel  # `share` tries this when it ends
            future.cancel = lambda: cancel() or future.set_result("begun") or False
        return future

    def end(self):
        self.ended += 1
        for future in self.futures:
            if not future.done():
                future.set_exception(LostTaskError("ended"))


def test_a_lost_task_is_named_alone_and_others_that_began_are_kept():
    pool, kept = Held(), []
    with pytest.raises(WorkerError, match=r"these were played: \('lost',\);"):
        share(pool, str, [("begun",), ("lost",), ("queued",), ("never",)], lambda task, _: kept.append(task))
    assert kept == [("begun",)] and len(pool.futures) == 3 and pool.futures[2].cancelled()


def test_work_that_should_stop_gives_out_no_more_and_keeps_what_was_begun():
    pool, kept = Held(), []
    tasks = [("begun",), ("done",), ("queued",), ("never",)]
    share(pool, str, tasks, lambda task, _: kept.append(task), should_stop=lambda: bool(kept))
    assert sorted(kept) == [("begun",), ("done",)] and len(pool.futures) == 3 and pool.futures[2].cancelled()


def test_an_interrupt_ends_the_pool_at_once():
    def tasks():
        yield ("queued",)
        raise KeyboardInterrupt

    pool, kept = Held(), []
    with pytest.raises(KeyboardInterrupt):
        share(pool, str, tasks(), lambda task, _: kept.append(task))
    assert kept == [] and pool.ended == 1


@pytest.mark.parametrize("pool", [SerialExecutor, lambda: ThreadPoolExecutor(2)])
def test_the_result_of_a_background_task_is_there_when_it_is_wanted(pool):
    with pool() as workers, BackgroundTasks(workers) as background:
        background.send("six", double, 6)
        background.send("thirteen", double, 13)
        assert background.fetch("six") == 12 and "six" not in background and "thirteen" in background
        with pytest.raises(ZeroDivisionError, match="thirteen"):
            background.fetch("thirteen")
        assert not background.is_elsewhere and background.is_here is isinstance(workers, SerialExecutor)


def test_background_tasks_that_were_lost_are_named_and_those_that_should_stop_are_not_waited_for():
    pool = Held()
    with BackgroundTasks(pool) as background:
        background.send("done", str, "done")
        assert background.fetch("done") == "done"
        background.send("the learner", str, "lost")
        with pytest.raises(WorkerError, match="died while these were done: the learner"):
            background.fetch("the learner")
    assert pool.ended == 0
    with BackgroundTasks(pool) as background:
        background.send("the exploiter", str, "queued")
        pool.futures[-1].set_running_or_notify_cancel()
        background.send("later", str, "queued")
        with pytest.raises(Stopped, match="the exploiter is under way"):
            background.fetch("the exploiter", lambda: True)
    assert pool.ended == 1 and pool.futures[-1].cancelled()
