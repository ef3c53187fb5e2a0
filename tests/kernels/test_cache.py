from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import swarm_pz

PLAY = """
import hashlib
from swarm_pz.simulator import Simulator
simulator = Simulator(num_games=8)
simulator.reset(range(8))
simulator.advance(600)
print(hashlib.sha256(simulator.games.memory.tobytes() + simulator.positions.tobytes()).hexdigest())
"""
SMALL = """
import numpy as np
from swarm_pz.kernels import entry_point
from swarm_pz.kernels.dynamics import move

@entry_point
def push(positions, velocities, accelerations):
    move(positions, velocities, accelerations, np.float32(1.0), np.float32(1.0))

def main():
    position, velocity, acceleration = np.full((3, 1, 2), np.float32(0.25))
    push(position, velocity, acceleration)
    print(position[0, 0], sum(push.stats.cache_hits.values()))
"""
"""A small entry point that calls a kernel of another file."""


def run(code: str, folder: Path, **environment: str) -> tuple[list[str], bool]:
    """Return the words that code prints, and whether it says that it compiles."""
    result = subprocess.run(  # noqa: S603
        [sys.executable, "-c", code],
        cwd=folder,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.split(), "compiles its kernels" in result.stderr


def test_machine_code_is_kept_for_each_kind_of_processor_until_a_rule_changes(tmp_path):
    package = tmp_path / "swarm_pz"
    shutil.copytree(Path(swarm_pz.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "kernels" / "small.py").write_text(SMALL)
    code = "from swarm_pz.kernels.small import main; main()"
    native = os.environ.get("NUMBA_CPU_NAME", "host")
    other = "x86-64" if native == "generic" else "generic"
    assert run(code, tmp_path) == (["0.75", "0"], True)
    assert run(code, tmp_path) == (["0.75", "1"], False)
    assert run(code, tmp_path, NUMBA_CPU_NAME=other) == (["0.75", "0"], True)
    assert run(code, tmp_path, NUMBA_CPU_NAME=other) == (["0.75", "1"], False)
    assert run(code, tmp_path) == (["0.75", "1"], False)
    dynamics = package / "kernels" / "dynamics.py"
    dynamics.write_text(dynamics.read_text().replace("accelerations[i, axis] * tick", "accelerations[i, axis] * 0.0"))
    assert run(code, tmp_path) == (["0.5", "0"], True)


def test_other_garbage_in_memory_and_another_layout_of_it_do_not_show():
    folder = Path(swarm_pz.__file__).parents[1]
    assert run(PLAY, folder)[0] == run(PLAY, folder, MALLOC_PERTURB_="85", MALLOC_TOP_PAD_="12345")[0]


def test_kernels_run_as_plain_python_for_debuggers(tmp_path):
    code = PLAY.replace("num_games=8", "num_games=1").replace("range(8)", "[0]").replace("600", "3")
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)  # noqa: S603
