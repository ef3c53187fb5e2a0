"""Policies think in another process, and their faults stay there."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.simulator import Simulator
from tests.play.faulty import loader


def seat(policy, team=0):
    return PolicySeat(key=(policy, team), policy=policy, game=GameConfig(), team=team, seed=5)


@pytest.fixture
def snapshot():
    simulator = Simulator()
    simulator.reset([0])
    simulator.advance(60)
    return simulator.snapshot()


def test_policies_answer_as_they_would_here(snapshot):
    workers = PolicyWorkers(loader, limit_s=60.0)

    async def play():
        return [await workers.ask(seat(name, team), snapshot) for name in ("ring", "uniform") for team in (0, 1)]

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
        return [await workers.ask(place, snapshot) for _ in range(2)]

    try:
        answers = asyncio.run(play())
    finally:
        workers.close()
    policy, batch, row = loader(place.policy, place.game), BatchEnv(place.game), np.zeros(1, int)
    batch.reset([0])
    batch.simulator.restore(snapshot)
    policy.reset([place.seed], row)
    for answer in answers:
        np.testing.assert_array_equal(answer, batch.ask(policy, np.zeros(1, int), row)[0])


@pytest.mark.parametrize(
    ("how", "message"),
    [("raises", "no idea"), ("nan", "nan"), ("sleeps", "no command within 2 s"), ("exits", "ended its process")],
)
def test_a_fault_stays_with_its_policy(how, message, snapshot):
    workers = PolicyWorkers(loader, limit_s=2.0)

    async def play():
        assert (await workers.ask(seat(how), snapshot)).shape == (10, 10)
        with pytest.raises(PolicyError, match=message):
            await workers.ask(seat(how), snapshot)
        answer = await workers.ask(seat("ring"), snapshot)
        assert answer.shape == (10, 10)
        workers.forget(seat("ring"))
        assert (await workers.ask(seat("ring"), snapshot)).shape == (10, 10)

    try:
        asyncio.run(play())
    finally:
        workers.close()


def test_a_seat_keeps_its_stream_until_it_is_forgotten(snapshot):
    workers = PolicyWorkers(loader, limit_s=60.0)

    async def play():
        first, other = seat("noise"), seat("noise", team=1)
        answers = [await workers.ask(place, snapshot) for place in (first, other, first)]
        workers.forget(first)
        answers.append(await workers.ask(first, snapshot))
        answers.append(await workers.ask(other, snapshot))
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
