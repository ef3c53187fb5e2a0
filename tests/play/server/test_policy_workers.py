"""Policies think in another process, and their faults stay there."""

import asyncio
import os
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.play.server import policy_workers as module
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.simulator import Simulator
from tests.play.faulty import Faulty, loader


def seat(policy, team=0):
    return PolicySeat(key=(policy, team), policy=policy, game=GameConfig(), team=team)


SEED = 5


@pytest.fixture
def snapshot():
    simulator = Simulator()
    simulator.reset([0])
    simulator.advance(60)
    return simulator.snapshot()


def test_a_policy_is_loaded_for_what_flies_its_own_seat_and_a_mismatch_is_told_then():
    game = GameConfig(controllers=("direct", "ergodic"))
    place = PolicySeat(key=1, policy="uniform", game=game, team=1)
    policy, batch = module._load(place, loader)
    assert batch.ask(policy, np.array([1]), np.zeros(1, np.int64)).shape == (1, *batch.command_shape)
    with pytest.raises(
        PolicyError, match="'density', but the control system direct takes those of kind 'accelerations'"
    ):
        module._load(replace(place, team=0), loader)


def test_policies_answer_as_they_would_here(snapshot):
    workers = PolicyWorkers(loader, limit_s=60.0)

    async def play():
        return [await workers.ask(seat(name, team), snapshot, SEED) for name in ("ring", "uniform") for team in (0, 1)]

    try:
        answers = asyncio.run(play())
    finally:
        workers.close()
    assert all(answer.shape == (10, 10) for answer in answers)
    assert not np.allclose(answers[0], answers[1])
    np.testing.assert_array_equal(answers[2], answers[3])


def test_a_policys_first_answers_are_those_of_a_game_that_has_just_begun(snapshot):
    # It is asked once before, so that what is compiled is compiled; that leaves no trace.
    place = seat("noise")
    workers = PolicyWorkers(loader, limit_s=60.0)

    async def play():
        await workers.load(place)
        return [await workers.ask(place, snapshot, SEED, begins=begins) for begins in (True, False, True)]

    try:
        answers = asyncio.run(play())
    finally:
        workers.close()
    policy = loader(place.policy, place.game, place.game.team_systems[place.team])
    batch, row = BatchEnv(place.game), np.zeros(1, int)
    batch.reset([0])
    batch.simulator.restore(snapshot)
    policy.reset([SEED], row)
    for answer in answers[:2]:
        np.testing.assert_array_equal(answer, batch.ask(policy, np.zeros(1, int), row)[0])
    np.testing.assert_array_equal(answers[2], answers[0])  # another game


@pytest.mark.parametrize(
    ("how", "message"),
    [("raises", "no idea"), ("nan", "nan"), ("sleeps", "no command within 2 s"), ("exits", "ended its process")],
)
def test_a_fault_stays_with_its_policy(how, message, snapshot):
    workers = PolicyWorkers(loader, limit_s=2.0)

    async def play():
        assert (await workers.ask(seat(how), snapshot, SEED)).shape == (10, 10)
        with pytest.raises(PolicyError, match=message):
            await workers.ask(seat(how), snapshot, SEED)
        answer = await workers.ask(seat("ring"), snapshot, SEED)
        assert answer.shape == (10, 10)
        workers.forget(seat("ring"))
        assert (await workers.ask(seat("ring"), snapshot, SEED)).shape == (10, 10)

    try:
        asyncio.run(play())
    finally:
        workers.close()


def test_a_seat_keeps_its_stream_until_it_is_forgotten(snapshot):
    workers = PolicyWorkers(loader, limit_s=60.0)

    async def play():
        first, other = seat("noise"), seat("noise", team=1)
        answers = [await workers.ask(place, snapshot, SEED) for place in (first, other, first)]
        workers.forget(first)
        answers.append(await workers.ask(first, snapshot, SEED))
        answers.append(await workers.ask(other, snapshot, SEED))
        return answers

    try:
        answers = asyncio.run(play())
    finally:
        workers.close()
    first, other, second, again, others_second = answers
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(other, first)  # the same seed; noise sees no sides
    np.testing.assert_array_equal(others_second, second)
    assert not np.array_equal(second, first)


# --- loading --------------------------------------------------------------------------------------


def waiting_loader(name, config, system):
    """Load a policy as soon as there is a file, whose name is that of the policy; others at once."""
    while name.startswith("/") and not Path(name).exists():
        time.sleep(0.01)
    return Faulty("")


class Numbered(Faulty):
    """Says by its command in which process it thinks."""

    def act(self, observations, rows):
        return np.full((len(rows), 10, 10), os.getpid() % 9973 / 9973)


def numbered(name, config, system):
    return Numbered(name)


def test_a_policy_that_loads_for_long_keeps_no_other_from_answering(snapshot, tmp_path):
    workers, slow = PolicyWorkers(waiting_loader, processes=2), seat(str(tmp_path / "loaded"))

    async def play():
        await workers.load(seat("one"))
        loading = asyncio.create_task(workers.load(slow))
        answers = [await workers.ask(seat("one"), snapshot, SEED, begins=k == 0) for k in range(3)]
        assert len(answers) == 3 and not loading.done()
        Path(slow.policy).touch()
        await loading

    try:
        asyncio.run(play())
    finally:
        workers.close()


def test_seats_of_a_policy_share_processes_and_the_last_one_is_for_who_must_load(snapshot):
    workers = PolicyWorkers(numbered, processes=3)
    many = [PolicySeat(key=k, policy="many", game=GameConfig(), team=0) for k in range(5)]

    async def play():
        numbers = []
        for place in (*many, seat("other")):
            await workers.load(place)
            numbers.append((await workers.ask(place, snapshot, SEED, begins=True))[0, 0])
        return numbers

    try:
        *shared, other = asyncio.run(play())
    finally:
        workers.close()
    assert len(set(shared)) == 2 and sorted(map(shared.count, set(shared))) == [2, 3]
    assert other not in shared


def test_a_policy_that_nobody_waits_for_any_more_does_not_keep_its_process(snapshot, tmp_path):
    workers, given_up = PolicyWorkers(waiting_loader, processes=1), seat(str(tmp_path / "never"))

    async def play():
        loading = asyncio.create_task(workers.load(given_up))
        while workers._processes[0]._loading is None:
            await asyncio.sleep(0.01)
        busy = workers._processes[0]._process
        loading.cancel()
        workers.forget(given_up)
        await workers.load(seat("one"))
        assert workers._processes[0]._process is not busy
        return await workers.ask(seat("one"), snapshot, SEED, begins=True)

    try:
        assert asyncio.run(play()).shape == (10, 10)
    finally:
        workers.close()


def test_workers_that_are_closed_while_a_process_starts_start_none(monkeypatch, tmp_path):
    monkeypatch.setattr(module, "LOADING_S", 1.0)
    starts, ended = threading.Event(), threading.Event()
    pause = module._Process._start

    def start(process):
        starts.set()
        ended.wait(10.0)
        pause(process)

    monkeypatch.setattr(module._Process, "_start", start)
    workers = PolicyWorkers(waiting_loader, processes=1)

    async def play():
        loading = asyncio.create_task(workers.load(seat(str(tmp_path / "never"))))
        while not starts.is_set():
            await asyncio.sleep(0.01)
        threading.Timer(0.2, ended.set).start()
        workers.close()
        with pytest.raises(PolicyError, match="the server is ending"):
            await loading

    asyncio.run(play())
