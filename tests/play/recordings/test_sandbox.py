"""A process of its own for files of strangers: its death is an error, and nobody else's."""

import os
import resource
import signal

import pytest

from swarm_pz.errors import OutputError, RecordingError
from swarm_pz.play.recordings import sandbox as module
from swarm_pz.play.recordings.sandbox import Sandbox


def die(how):
    os.kill(os.getpid(), how)


def spin():
    signal.setitimer(signal.ITIMER_PROF, 0.05)
    while True:
        pass


def refuse():
    raise OutputError("the disk is full")


def count(upto, tell):
    for number in range(upto):
        tell(number)
    return os.getpid()


def test_whatever_becomes_of_the_process_is_an_error_that_names_the_file_and_the_next_one_is_well():
    told = []
    with Sandbox() as sandbox:
        for work, given, error, said in (
            (int, ("x",), RecordingError, r"game\.jsonl .* ValueError"),
            (refuse, (), OutputError, "the disk is full"),
            (bytearray, (2 * module.MEMORY,), RecordingError, r"game\.jsonl .* 4 GiB of memory"),
            (die, (signal.SIGSEGV,), RecordingError, r"game\.jsonl .*\(SIGSEGV\)"),
            (spin, (), RecordingError, r"game\.jsonl was given up"),
        ):
            with pytest.raises(error, match=said):
                sandbox.do("game.jsonl", work, *given)
            assert sandbox.do("next.jsonl", len, "abc") == 3
        assert sandbox.do("next.jsonl", resource.getrlimit, resource.RLIMIT_AS) == (module.MEMORY, module.MEMORY)
        process = sandbox.do("a.jsonl", count, 3, progress=told.append)
        assert told == [0, 1, 2] and process == sandbox.do("b.jsonl", os.getpid) != os.getpid()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)
    with pytest.raises(RecordingError, match="ending"):
        sandbox.do("c.jsonl", os.getpid)
