"""Code that runs other people's policies can be interrupted, and its processes end when they should."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from swarm_pz.evaluation.processes import alarm, interrupts_blocked

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals")


def test_an_alarm_rings_until_it_is_heard_and_is_put_away():
    before, reached = signal.getsignal(signal.SIGALRM), []

    def stubborn():
        with alarm(0.02):
            for answer in ("the first is caught", "the second is not"):
                try:
                    time.sleep(5.0)
                except TimeoutError:
                    if reached:
                        raise
                reached.append(answer)

    with pytest.raises(TimeoutError, match=r"no command within 0.02 s"):
        stubborn()
    assert reached == ["the first is caught"]
    with alarm(60.0):
        assert signal.getitimer(signal.ITIMER_REAL)[0] > 0.0
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


SLOWLY = "import time\nfor _ in range(30):\n    time.sleep(0.01)\ndone = True\n"


def compile_slowly():
    from numba.core.compiler_lock import global_compiler_lock

    with global_compiler_lock:
        exec(SLOWLY, namespace := {})  # noqa: S102
    return namespace["done"]


def import_slowly():
    import takes_long

    return takes_long.done


@pytest.mark.parametrize("prepare", [import_slowly, compile_slowly])
def test_an_import_or_a_compilation_is_finished_before_late_code_is_interrupted(prepare, tmp_path, monkeypatch):
    """Catches a half-imported module or half-compiled function that stays behind for later users."""
    (tmp_path / "takes_long.py").write_text(SLOWLY)
    monkeypatch.syspath_prepend(tmp_path)
    done = []

    def answer():
        with alarm(0.02):
            done.append(prepare())
            time.sleep(5.0)

    with pytest.raises(TimeoutError):
        answer()
    sys.modules.pop("takes_long", None)
    assert done == [True]


def test_code_that_an_import_calls_is_interrupted(tmp_path, monkeypatch):
    (tmp_path / "experiment.py").write_text(
        "import time\nfrom swarm_pz.evaluation.processes import alarm\n"
        "try:\n    with alarm(0.02):\n        time.sleep(60.0)\n        heard = False\n"
        "except TimeoutError:\n    heard = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    import experiment

    assert experiment.heard


def test_time_spent_waiting_for_a_processor_does_not_count(tmp_path, monkeypatch):
    path, clock = tmp_path / "schedstat", [0.0]
    monkeypatch.setattr("swarm_pz.evaluation.processes._WAITS", path)
    monkeypatch.setattr("swarm_pz.evaluation.processes.time.monotonic", lambda: clock[0])

    def work(waited):
        """Take 7 s, some of them waiting for a processor."""
        with alarm(5.0):
            clock[0] += 7.0
            if waited is not None:
                path.write_text(f"5 {waited * 10**9} 3\n")

    path.write_text("5 1000000000 3\n")
    work(9)
    with pytest.raises(TimeoutError):
        work(9)
    path.unlink()  # as on systems without it
    with pytest.raises(TimeoutError):
        work(None)


def test_where_no_alarm_can_ring_late_code_is_told_afterwards():
    messages = []

    def work():
        try:
            with alarm(0.01):
                time.sleep(0.02)
        except TimeoutError as error:
            messages.append(str(error))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert messages == ["no command within 0.01 s"]


PARENT = """
import multiprocessing, os, signal, time
from swarm_pz.evaluation.processes import interrupts_blocked, prepare_process

def work():
    os.kill(os.getpid(), signal.SIGINT)  # as a terminal does to all: it is for the parent
    prepare_process()
    os.kill(os.getpid(), signal.SIGINT)
    print("prepared", os.environ["OMP_NUM_THREADS"], signal.pthread_sigmask(signal.SIG_BLOCK, []), flush=True)
    time.sleep(60)
    print("still there", flush=True)

os.environ["OMP_NUM_THREADS"] = "7"
before = signal.getsignal(signal.SIGINT)  # ignored already, where a shell has started this in the background
prepare_process()  # which has no parent to end with
print("alone", os.environ["OMP_NUM_THREADS"], signal.getsignal(signal.SIGINT) == before, flush=True)
with interrupts_blocked():
    multiprocessing.get_context("fork").Process(target=work).start()
print("unblocked", signal.pthread_sigmask(signal.SIG_BLOCK, []), flush=True)
time.sleep(60)
"""


def test_a_process_ends_with_the_one_that_started_it_and_not_by_ctrl_c():
    """Catches a pool that dies if Ctrl-C comes while its workers start."""
    with interrupts_blocked():
        assert signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:  # noqa: S603
        assert parent.stdout.readline() == "alone 1 True\n"
        assert sorted([parent.stdout.readline(), parent.stdout.readline()]) == [
            "prepared 1 set()\n",
            "unblocked set()\n",
        ]
        parent.send_signal(signal.SIGKILL)
        assert parent.stdout.read() == "", "it comes to an end when the child has ended, too"
