"""Machine code is kept on disk until one of its sources changes; numba keeps that of kinds of processors apart."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import swarm_pz
from swarm_pz import kernels
from swarm_pz.errors import SwarmError
from swarm_pz.kernels.cache import SOURCES
from swarm_pz.kernels.compiler import _Files
from swarm_pz.simulator import Simulator

PACKAGE = Path(swarm_pz.__file__).parent

SMALL = """
from typing import NamedTuple
import numpy as np
from swarm_pz.kernels import entry_point
from swarm_pz.kernels.inner.gain import gain

class Body(NamedTuple):
    positions: np.ndarray

@entry_point
def push(body):
    body.positions[0] += gain()

def main():
    positions = np.full(1, np.float32(0.25))
    push(Body(positions))
    print(positions[0], sum(push.stats.cache_hits.values()))
"""
"""A small entry point that takes a named tuple and calls a kernel of another file."""
GAIN = """
import numpy as np
from swarm_pz.kernels import kernel

@kernel
def gain():
    return np.float32(0.5)
"""


def run(code: str, folder: Path, **environment: str) -> tuple[list[str], bool]:
    """Run code; return the words that it prints, and whether it reports that it compiles."""
    command, environment = [sys.executable, "-c", code], os.environ | environment
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)  # noqa: S603
    return done.stdout.split(), "compiles its kernels" in done.stderr


def edit(path: Path, before: str, after: str) -> None:
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))


def test_machine_code_is_kept_until_a_source_changes(tmp_path):
    for name in ("kernels", "config"):
        shutil.copytree(PACKAGE / name, tmp_path / "swarm_pz" / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(PACKAGE / "errors.py", tmp_path / "swarm_pz")
    (tmp_path / "swarm_pz" / "__init__.py").touch()  # the package's own would import the environments
    folder = tmp_path / "swarm_pz" / "kernels"
    (folder / "inner").mkdir()
    (folder / "inner" / "__init__.py").touch()
    (folder / "inner" / "gain.py").write_text(GAIN)
    (folder / "small.py").write_text(SMALL)
    small = "from swarm_pz.kernels.small import main; main()"
    assert run(small, tmp_path) == (["0.75", "0"], True)
    assert run(small, tmp_path) == (["0.75", "1"], False)
    edit(folder / "inner" / "gain.py", "0.5", "0.0")
    edit(folder / "small.py", "Body", "Pair")  # old machine code names this class, which is gone
    assert run(small, tmp_path) == (["0.25", "0"], True)
    kept = sorted(path.suffix for path in (folder / "__pycache__").glob("small.push*"))
    assert kept == [".nbc", ".nbi"], "what is of other sources is removed"


def test_processes_that_compile_at_once_for_other_arguments_keep_their_code_apart(tmp_path, monkeypatch):
    one, other = (_Files(str(tmp_path), "push", "stamp") for _ in range(2))
    write = one._save_data

    def write_last(name, data):
        other.save("float64", "code for float64")
        write(name, data)

    monkeypatch.setattr(one, "_save_data", write_last)
    monkeypatch.setattr(other, "_load_index", dict)  # as if `other` read it before `one` wrote it
    one.save("float32", "code for float32")
    files = _Files(str(tmp_path), "push", "stamp")
    assert files.load("float64") == "code for float64"
    assert files.load("float32") is None, "what is not in the index is compiled again"


def test_kernels_take_nothing_of_ours_that_the_stamp_does_not_cover():
    for path in (PACKAGE / "kernels").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and path.name != "compiler.py":  # it holds no kernels
                package, _, rest = str(node.module).partition(".")
                assert package != "swarm_pz" or rest.split(".")[0] in SOURCES, (path, node.module)


def test_an_entry_point_elsewhere_is_refused_with_what_to_do():
    with pytest.raises(SwarmError, match=r"run of .*test_cache.*numba\.njit"):
        kernels.entry_point(run)


PLAY = """
from swarm_pz.simulator import Simulator
simulator = Simulator(num_games=2)
simulator.reset(range(2))
simulator.advance(90)
print((simulator.games.memory.tobytes() + simulator.positions.tobytes()).hex())
"""


def test_other_garbage_in_memory_and_another_layout_of_it_do_not_show():
    """A kernel that reads uninitialised memory would find other numbers there."""
    simulator = Simulator(num_games=2)
    simulator.reset(range(2))
    simulator.advance(90)
    expected = (simulator.games.memory.tobytes() + simulator.positions.tobytes()).hex()
    assert run(PLAY, PACKAGE.parent, MALLOC_PERTURB_="85", MALLOC_TOP_PAD_="12345")[0] == [expected]


def test_kernels_run_as_plain_python_for_debuggers(tmp_path):
    code = "from swarm_pz import GameConfig, Simulator; Simulator(GameConfig(drones_per_team=1)).advance(1); print(1)"
    assert run(code, tmp_path, NUMBA_DISABLE_JIT="1") == (["1"], False)
