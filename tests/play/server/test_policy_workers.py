"""Policies run in other processes, and their faults stay there."""

import asyncio
import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.play.server import policy_workers as module
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.policy import load
from swarm_pz.simulator import Simulator

SEED = 5
FAULTS = {"raises": "no idea", "nan": "nan", "sleeps": "no command within 1 s", "exits": "ended its process"}
"""Policies that fail as their names say, at their second command, and what is said of them."""


class Faulty:
    observation = ObservationConfig(grid=10)

    def __init__(self, fault):
        self.fault, self.count = fault, 0

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        self.count += 1
        answer = np.full((len(rows), 10, 10), 1.0 / self.count)
        if self.count == 3:  # the first is asked for when the policy is loaded
            if self.fault == "raises":
                raise RuntimeError("no idea")
            if self.fault == "nan":
                answer[:] = np.nan
            if self.fault == "sleeps":
                time.sleep(10)
            if self.fault == "exits":
                os._exit(3)
        return answer


def seat(policy, team=0):
    return PolicySeat(key=(policy, team), policy=policy, game=GameConfig(), team=team)


@pytest.fixture(scope="module")
def snapshot():
    simulator = Simulator()
    simulator.reset([0])
    simulator.advance(60)
    return simulator.snapshot()


def loader(name, config, system):
    """Load a policy, faulty ones included; one whose name is a path, once that file exists."""
    while name.startswith("/") and not Path(name).exists():
        time.sleep(0.01)
    return Faulty(name) if name in FAULTS else load(name, config, system)


@pytest.fixture(scope="module")
def workers():
    """Give workers with one process, which all tests share: starting one takes seconds."""
    made = PolicyWorkers(loader, processes=1, limit_s=60.0)
    yield made
    made.close()


def test_a_policy_is_loaded_for_what_flies_its_own_seat_and_a_mismatch_is_told_then():
    place = PolicySeat(key=1, policy="uniform", game=GameConfig(controllers=("direct", "ergodic")), team=1)
    policy, batch = module._load(place, loader)
    assert batch.ask(policy, np.array([1]), np.zeros(1, np.int64)).shape == (1, *batch.command_shape)
    with pytest.raises(PolicyError, match="direct takes those of kind 'accelerations'"):
        module._load(replace(place, team=0), loader)


async def test_policies_answer_as_they_would_in_a_match_with_states_and_streams_of_their_own(workers, snapshot):
    async def ask(name, team=0, begins=False):
        return await workers.ask(seat(name, team), snapshot, SEED, begins=begins)

    ring, other_ring = [await ask("ring", team) for team in (0, 1)]
    assert ring.shape == (10, 10) and not np.allclose(ring, other_ring), "each is shown its own side"
    await workers.load(seat("noise"))  # loading asks it once, which must leave no trace
    first, second, again = [await ask("noise", begins=begins) for begins in (True, False, True)]
    others_first = await ask("noise", team=1)
    workers.forget(seat("noise"))
    anew = await ask("noise")
    policy = loader("noise", GameConfig(), GameConfig().team_systems[0])
    batch, row = BatchEnv(GameConfig()), np.zeros(1, int)
    batch.reset([0])
    batch.simulator.restore(snapshot)
    policy.reset([SEED], row)
    for answer in (first, second):
        np.testing.assert_array_equal(answer, batch.ask(policy, np.zeros(1, int), row)[0])
    for answer in (again, others_first, anew):  # the same seed; noise ignores its side
        np.testing.assert_array_equal(answer, first)


async def test_a_fault_stays_with_its_policy(workers, snapshot, monkeypatch):
    monkeypatch.setattr(workers, "_limit_s", 1.0)
    for name, message in FAULTS.items():
        assert (await workers.ask(seat(name), snapshot, SEED)).shape == (10, 10)
        with pytest.raises(PolicyError, match=message):
            await workers.ask(seat(name), snapshot, SEED)
        assert (await workers.ask(seat("ring"), snapshot, SEED)).shape == (10, 10)


# --- loading --------------------------------------------------------------------------------------


class Loading:
    """Stands in for a process: keeps who is loaded there, and answers nothing."""

    def __init__(self, loader):
        self.known, self.is_started, self.seats = set(), False, []

    async def ask(self, question):
        self.is_started = True
        self.known.add(question.seat.policy)
        self.seats.append(question.seat)
        return np.zeros(0)

    def forget(self, seat, *, was_alone):
        pass


async def test_seats_of_a_policy_share_processes_and_who_must_load_has_another_that_keeps_nobody_waiting(monkeypatch):
    monkeypatch.setattr(module, "_Process", Loading)
    workers = PolicyWorkers(loader, processes=3)
    many, other = [replace(seat("many"), key=k) for k in range(5)], seat("other")
    for place in (*many, other):
        await workers.load(place)
    loaded = [[one.policy for one in process.seats] for process in workers._processes]
    assert sorted(map(sorted, loaded)) == [["many"] * 2, ["many"] * 3, ["other"]]


async def test_a_policy_that_nobody_waits_for_any_more_does_not_keep_its_process(workers, snapshot, tmp_path):
    given_up, (process,) = seat(str(tmp_path / "never")), workers._processes
    for key in list(workers._places):  # of the tests before
        workers.forget(PolicySeat(key=key, policy="", game=GameConfig(), team=0))
    loading = asyncio.create_task(workers.load(given_up))
    while process._loading is None:
        await asyncio.sleep(0.01)
    busy = process._process
    loading.cancel()
    workers.forget(given_up)
    await workers.load(seat("ring"))
    assert process._process is not busy
    assert (await workers.ask(seat("ring"), snapshot, SEED, begins=True)).shape == (10, 10)
