"""A Ray cluster plays the same games; a worker that dies costs none."""

import os
import secrets
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import ray

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import WorkerError
from swarm_pz.evaluation import ray_pool
from swarm_pz.evaluation.processes import LostTaskError
from swarm_pz.evaluation.ray_pool import RayPool
from swarm_pz.evaluation.tournament import TournamentConfig, play_block


class Ref(SimpleNamespace):
    """The result of a task."""

    __hash__ = object.__hash__


class Pretended:
    """The part of Ray that the pool uses: one machine with two processors; `fates` list what happens to each task."""

    exceptions, cloudpickle = ray.exceptions, ray.cloudpickle

    def __init__(self, fates):
        self.fates = list(fates)

    def is_initialized(self):
        return True

    def nodes(self):
        return [{"Alive": True, "Resources": {"CPU": 2.0}}]

    def remote(self, run):
        def begin(*arguments):
            return Ref(run=run, arguments=arguments, fate=self.fates.pop(0) if self.fates else "here")

        return SimpleNamespace(options=lambda **_: SimpleNamespace(remote=begin))

    def put(self, value):
        return value

    def wait(self, refs, timeout):
        (ref,) = refs
        is_ready = ref.fate != "endless"
        time.sleep(0.0 if is_ready else 0.01)
        return (refs, []) if is_ready else ([], refs)

    def cancel(self, ref, force):
        assert force
        ref.cancels = getattr(ref, "cancels", 0) + 1
        if ref.cancels == 2:
            ref.fate = "die"

    def get(self, ref):
        if ref.fate == "die":
            raise ray.exceptions.WorkerCrashedError
        expected, *work = ref.arguments
        return ref.run(expected | ({"numba": "0.1"} if ref.fate == "refuse" else {}), *work)


@pytest.fixture
def pretend(monkeypatch):
    def pretend(*fates):
        ray_of_tests = Pretended(fates)
        monkeypatch.setattr(ray_pool, "require_extra", lambda module, extra: ray_of_tests)
        return ray_of_tests

    return pretend


@pytest.mark.parametrize(
    ("fates", "error", "message"),
    [(["refuse"], WorkerError, "has numba .*, here 0.1: install"), (["die"], LostTaskError, "its workers died")],
)
def test_a_task_that_no_machine_can_do_is_an_error(fates, error, message, pretend):
    pretended = pretend(*fates)
    with RayPool("auto") as pool:
        with pytest.raises(error, match=message):
            pool.submit(len, "a").result()
        pretended.nodes = lambda: 1 / 0
        with pytest.raises(WorkerError, match="cannot be reached any more"):
            _ = pool.slots


def test_a_task_is_ended_although_its_first_cancellation_was_missed(pretend):
    pretend("endless")
    with RayPool("auto") as pool:
        future = pool.submit(len, "a")
        while not pool._running:
            time.sleep(0.01)
        pool.end()
        assert type(future.exception(timeout=60)) is LostTaskError


@pytest.mark.parametrize(
    ("address", "reason"),
    [("ray://host:10001", "must be 'auto' or HOST:PORT"), ("127.0.0.1:1", "no Ray cluster at '127.0.0.1:1'")],
)
def test_where_there_is_no_cluster_the_line_says_how_to_start_one(address, reason):
    with pytest.raises(WorkerError, match=reason):
        RayPool(address)


DRIVER = """
import time
import ray
from swarm_pz import policies
from swarm_pz.evaluation.ray_pool import RayPool
from swarm_pz.evaluation.tournament import play_block
from tests.evaluation.test_ray_pool import BLOCK

ray.init(num_cpus=1, include_dashboard=False, object_store_memory=10**8, log_to_driver=False)
with RayPool("auto") as pool:
    print([game.fingerprint for game in pool.submit(play_block, policies.load, *BLOCK).result()])
    print(type(pool.submit(divmod, 1, 0).exception()).__name__)
    endless = [pool.submit(time.sleep, 600) for _ in range(2)]  # one of them waits for the only processor
    pool.end()
    print([type(future.exception()).__name__ for future in endless])
assert ray.is_initialized(), "a cluster that was there before stays"
"""
BLOCK = "ring", "uniform", [0, 1], TournamentConfig(budget_ms=1e6, game=GameConfig(time_limit=2.0, drones_per_team=2))


@pytest.mark.skipif(os.name != "posix", reason="needs kill")
def test_a_real_cluster_plays_the_same_games_and_can_be_ended():
    secret = {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": secrets.token_hex(32)}  # else Ray writes a token to a file
    driver = subprocess.run(  # noqa: S603
        [sys.executable, "-c", DRIVER],
        cwd=Path(__file__).parents[2],
        env=os.environ | {"RAY_USAGE_STATS_ENABLED": "0"} | secret,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert driver.returncode == 0, driver.stderr
    assert [line for line in driver.stdout.splitlines() if "raylet" not in line] == [
        "Ray: 1 machine(s), 1 processor(s)",
        str([game.fingerprint for game in play_block(policies.load, *BLOCK)]),
        "ZeroDivisionError",
        "['LostTaskError', 'LostTaskError']",
    ]
