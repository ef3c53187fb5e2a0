"""A Ray cluster plays the same games; who dies, or is of another version, costs none."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace

import pytest
import ray

from benchmarks.ray_cluster import Cluster
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import WorkerError
from swarm_pz.evaluation import ray_pool
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.ray_pool import RayPool, _Task
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.evaluation.workers import LostTaskError, share
from tests.evaluation.test_tournament import without_times

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs kill")


class SimpleRef:
    def __init__(self, arguments, fate):
        self.arguments, self.fate = arguments, fate


class Pretended:
    """Ray, as far as the pool asks: machines of two processors each, and a fate for every task, in turn."""

    exceptions, cloudpickle = ray.exceptions, ray.cloudpickle

    def __init__(self, fates=(), machines=("a", "b")):
        self.fates, self.machines, self.put_here, self.asked_for = list(fates), list(machines), [], []
        self.is_initialized = lambda: True

    def nodes(self):
        return [{"NodeID": name, "Alive": True, "Resources": {"CPU": 2.0}} for name in self.machines]

    def remote(self, function):
        def begin(options, *arguments):
            self.asked_for.append(options)
            return SimpleRef(arguments, self.fates.pop(0) if self.fates else "done")

        def options(**given):
            def more(**others):
                return options(**given | others)

            return SimpleNamespace(options=more, remote=lambda *arguments: begin(given, *arguments))

        return SimpleNamespace(options=options)

    def wait(self, refs, *, num_returns, timeout):
        return (refs[:num_returns], refs[num_returns:])

    def put(self, value):
        self.put_here.append(value)
        return value

    def get(self, ref):
        (expected, work, places, *bundles), fate = ref.arguments, ref.fate
        if fate == "die":
            raise ray.exceptions.WorkerCrashedError
        if fate.startswith("refuse "):
            return "refused", fate[-1], f"host {fate[-1]}", expected | {"numba": "0.1"}
        function, arguments, keywords = pickle.loads(work)  # noqa: S301
        for place, bundle in zip(places, bundles, strict=True):
            arguments[place] = PolicyBundle(*bundle)
        return "done", "a", "host a", (fate, function(*arguments, **keywords))


@pytest.fixture
def pretend(monkeypatch):
    def pretend(*fates, machines=("a", "b")):
        ray_of_tests = Pretended(fates, machines)
        monkeypatch.setattr(ray_pool, "require_extra", lambda module, extra: ray_of_tests)
        monkeypatch.setattr(ray_pool, "processor", lambda: "done")
        return ray_of_tests

    return pretend


def lengths(pool, *words):
    kept = {}
    share(pool, len, [(word,) for word in words], lambda task, result: kept.update({task[0]: result}))
    return kept


def test_what_was_on_a_machine_that_died_is_given_out_again(pretend):
    pretend("die", "done", "die")
    said = []
    with RayPool("auto", said.append) as pool:
        assert lengths(pool, "a", "bb", "ccc") == {"a": 1, "bb": 2, "ccc": 3}
    assert said[0] == "Ray: 2 machine(s), 4 processor(s)"
    assert any("a worker or its machine died: what it was at is given out again" in line for line in said)


def test_a_task_that_three_workers_died_of_is_named(pretend):
    pretend("die", "die", "die", machines=("a",))
    with RayPool("auto", lambda _: None) as pool, pytest.raises(WorkerError, match=r"died while .* \('deadly',\)"):
        lengths(pool, "deadly")


def test_what_is_to_be_given_out_again_ends_with_the_pool(pretend):
    pretended = pretend()
    pool = RayPool("auto", lambda _: None)
    lost, waiting = (_Task(Future(), b"", [], []) for _ in range(2))
    lost.future.set_running_or_notify_cancel()
    with pool._changed:
        pool._queue.append(waiting)
        pool._give_again(lost)
        pool.end()
    pool.shutdown()
    assert isinstance(lost.future.exception(), LostTaskError) and waiting.future.cancelled()
    assert not [asked for asked in pretended.asked_for if asked]


def test_when_no_machine_is_left_it_is_said_once_and_one_that_joins_goes_on(pretend, monkeypatch):
    pretended, said, looks = pretend(), [], iter(range(6))

    def wait(refs, *, num_returns, timeout):
        pretended.machines[:] = ["c"] if next(looks, None) is None else []
        return (refs[:num_returns], refs) if pretended.machines else ([], refs)

    monkeypatch.setattr(pretended, "wait", wait)
    with RayPool("auto", said.append) as pool:
        assert lengths(pool, "abc") == {"abc": 3}
    assert [line for line in said if "no machine is left" in line] == [
        "no machine is left that may work: it goes on when one joins the cluster"
    ]


def test_a_machine_with_other_versions_is_left_out_by_name_and_the_others_go_on(pretend):
    pretended = pretend("refuse a")
    said = []
    with RayPool("auto", said.append) as pool:
        assert lengths(pool, "a", "bb") == {"a": 1, "bb": 2}
        assert pool.slots == 6
    (line,) = (line for line in said if "left out" in line)
    assert line.startswith("host a is left out, since it has numba 0.1, here ")
    assert pretended.asked_for[-1]["label_selector"] == {"ray.io/node-id": "!in(a)"}


def test_where_all_machines_have_other_versions_nothing_is_played(pretend):
    pretend("refuse a", machines=("a",))
    with RayPool("auto", lambda _: None) as pool, pytest.raises(WorkerError, match="host a is left out"):
        lengths(pool, "a")


def test_a_processor_of_another_kind_is_told_once(pretend):
    pretend("zen", "zen")
    said = []
    with RayPool("auto", said.append) as pool:
        lengths(pool, "a", "bb")
    assert sum("host a has a processor of another kind (zen, here done)" in line for line in said) == 1


def test_who_waits_for_a_cluster_that_is_gone_is_told(pretend):
    pretended = pretend()
    with RayPool("auto", lambda _: None) as pool:
        future = pool.submit(len, "a")
        assert future.result(timeout=10) == 1
        pretended.get = lambda ref: 1 / 0
        with pytest.raises(WorkerError, match=r"the Ray cluster cannot be reached any more \(ZeroDivisionError"):
            pool.submit(len, "a").result(timeout=10)


def test_a_folder_travels_once(pretend):
    pretended = pretend()
    one = PolicyBundle("mine", (("card", b"1"),))
    with RayPool("auto", lambda _: None) as pool:
        assert [pool.submit(_name, 7, one).result() for _ in range(3)] == [(7, "mine")] * 3
    assert pretended.put_here == [("mine", (("card", b"1"),))]


def _name(number, bundle):
    return number, bundle.name


@pytest.mark.parametrize(
    ("address", "reason"),
    [("ray://host:10001", "must be 'auto' or HOST:PORT"), ("127.0.0.1:1", "no Ray cluster at '127.0.0.1:1'")],
)
def test_where_there_is_no_cluster_the_line_says_how_to_start_one(address, reason):
    with pytest.raises(WorkerError, match=reason):
        RayPool(address)


DRIVER = """
import signal, sys
from pathlib import Path
from swarm_pz import policies
from swarm_pz.evaluation.ray_pool import RayPool, _Task
from swarm_pz.evaluation.tournament import Tournament
from tests.evaluation.test_ray_pool import PLAYERS, SMALL

before, folder = signal.getsignal(signal.SIGTERM), Path(sys.argv[2])
with RayPool(sys.argv[1]) as pool:
    Tournament(PLAYERS, SMALL, folder, policies.load).play(pool=pool)
    try:
        pool.submit(divmod, 1, 0).result(timeout=60)
    except ZeroDivisionError:
        print("raised there, raised here")
assert signal.getsignal(signal.SIGTERM) == before
"""
SMALL = TournamentConfig(games=4, budget_ms=1e6, game=GameConfig(time_limit=2.0, drones_per_team=2))
PLAYERS = ("ring", "uniform", "champion")


def test_a_real_cluster_plays_the_same_games_and_leaves_signals_alone(tmp_path):
    Tournament(PLAYERS, SMALL, tmp_path / "alone", policies.load).play()
    with Cluster() as cluster:
        cluster.start()
        driver = subprocess.run(  # noqa: S603 - Ray looks for its secret once a process
            [sys.executable, "-c", DRIVER, cluster.address, str(tmp_path / "cluster")],
            cwd=Path(__file__).parents[2], env=os.environ | cluster.secret, capture_output=True, text=True, timeout=300,
        )  # fmt: skip
    assert driver.returncode == 0, driver.stderr
    assert driver.stdout == "Ray: 1 machine(s), 1 processor(s)\nraised there, raised here\n"
    assert without_times(tmp_path / "cluster") == without_times(tmp_path / "alone")
