"""What runs other people's policies is interrupted, ended, and puts everything back."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from swarm_pz.evaluation.processes import alarm, end_processes

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs signals")


def test_an_alarm_rings_until_it_is_heard_and_is_put_away():
    before, reached = signal.getsignal(signal.SIGALRM), []

    def stubborn():
        with alarm(0.02):
            for answer in ("the first is caught", "the second is not"):
                try:
                    time.sleep(2.0)
                except TimeoutError:
                    if reached:
                        raise
                reached.append(answer)

    with pytest.raises(TimeoutError, match=r"no command within 0.02 s"):
        stubborn()
    assert reached == ["the first is caught"]
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    with alarm(60.0):
        assert signal.getitimer(signal.ITIMER_REAL)[0] > 0.0
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


SLOW_MODULE = """
import time
for _ in range(50):
    time.sleep(0.01)
done = True
"""


def test_an_import_is_finished_before_who_is_late_is_interrupted(tmp_path, monkeypatch):
    (tmp_path / "takes_long.py").write_text(SLOW_MODULE)
    monkeypatch.syspath_prepend(tmp_path)

    def answer():
        with alarm(0.02):
            import takes_long  # noqa: F401

            time.sleep(5.0)

    with pytest.raises(TimeoutError):
        answer()
    assert sys.modules.pop("takes_long").done, "half a module would stay behind for all others"


def test_compilation_is_finished_before_who_is_late_is_interrupted():
    from numba.core.compiler_lock import global_compiler_lock

    done = []

    def answer():
        with alarm(0.02):
            with global_compiler_lock:
                for _ in range(50):
                    time.sleep(0.01)
                done.append("compiled")
            time.sleep(5.0)

    with pytest.raises(TimeoutError):
        answer()
    assert done == ["compiled"]


def test_code_that_is_called_while_something_else_is_imported_is_interrupted(tmp_path, monkeypatch):
    (tmp_path / "experiment.py").write_text(
        "import time\nfrom swarm_pz.evaluation.processes import alarm\n"
        "try:\n    with alarm(0.02):\n        time.sleep(5.0)\nexcept TimeoutError:\n    heard = True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    began = time.monotonic()
    import experiment

    assert experiment.heard and time.monotonic() - began < 4.0


def test_what_is_waited_for_a_processor_does_not_count(tmp_path, monkeypatch):
    told = tmp_path / "schedstat"
    told.write_text("5 1000000000 3\n")
    monkeypatch.setattr("swarm_pz.evaluation.processes._WAITS", told)
    with alarm(0.1):
        told.write_text("5 9000000000 3\n")
        time.sleep(0.3)
    with pytest.raises(TimeoutError), alarm(0.1):
        time.sleep(0.3)
    told.unlink()  # as on systems that do not tell
    with pytest.raises(TimeoutError), alarm(0.1):
        time.sleep(0.3)


def test_where_no_alarm_can_ring_who_is_late_is_told_afterwards():
    said = []

    def work(seconds, limit):
        try:
            with alarm(limit):
                time.sleep(seconds)
                said.append("worked")
        except TimeoutError as error:
            said.append(str(error))

    for given in ((0.0, 60.0), (0.02, 0.01)):
        thread = threading.Thread(target=work, args=given)
        thread.start()
        thread.join()
    assert said == ["worked", "worked", "no command within 0.01 s"]


def test_processes_that_were_started_are_ended():
    process = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(600,))  # no heir to handlers
    process.start()
    end_processes()
    process.join(30)
    assert process.exitcode == -signal.SIGTERM


PARENT = """
import multiprocessing, os, signal, sys, time
from swarm_pz.evaluation.processes import prepare_process

def work():
    prepare_process()
    os.kill(os.getpid(), signal.SIGINT)  # as a terminal does to all: it is for the parent
    print("prepared", os.environ["OMP_NUM_THREADS"], flush=True)
    time.sleep(60)
    print("still there", flush=True)

os.environ["OMP_NUM_THREADS"] = "7"
before = signal.getsignal(signal.SIGINT)  # ignored already, where a shell has started this in the background
prepare_process()  # which has no parent to end with
print("alone", os.environ["OMP_NUM_THREADS"], signal.getsignal(signal.SIGINT) == before, flush=True)
multiprocessing.get_context("fork").Process(target=work).start()
time.sleep(60)
"""


def test_a_process_ends_with_the_one_that_started_it_and_not_by_ctrl_c():
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:  # noqa: S603
        assert parent.stdout.readline() == "alone 1 True\n"
        assert parent.stdout.readline() == "prepared 1\n"
        parent.send_signal(signal.SIGKILL)
        # It comes to an end when the child has ended, too.
        assert parent.stdout.read() == ""
