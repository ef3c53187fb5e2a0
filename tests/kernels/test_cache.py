from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import swarm_pz

CODE = """
import hashlib
from swarm_pz.simulator import Simulator
from swarm_pz.kernels.game import advance_games
simulator = Simulator(num_games=8)
simulator.reset(range(8))
simulator.advance(600)
state = simulator.games.memory.tobytes() + simulator.positions.tobytes()
print(hashlib.sha256(state).hexdigest(), sum(advance_games.stats.cache_hits.values()))
"""


def run(folder: Path, **environment: str) -> list[str | bool]:
    command = [sys.executable, "-c", CODE]
    result = subprocess.run(  # noqa: S603
        command, cwd=folder, env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return [*result.stdout.split(), "compiles its kernels" in result.stderr]


def test_changing_a_rule_recompiles_what_calls_it(tmp_path):
    package = tmp_path / "swarm_pz"
    shutil.copytree(Path(swarm_pz.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    first, again = run(tmp_path), run(tmp_path)
    assert first[0] == again[0]
    assert (first[1:], again[1:]) == (["0", True], ["1", False])
    # Other garbage in memory and another layout of it must not show, either.
    assert run(tmp_path, MALLOC_PERTURB_="85", MALLOC_TOP_PAD_="12345")[0] == first[0]
    dynamics = package / "kernels" / "dynamics.py"
    dynamics.write_text(dynamics.read_text().replace("accelerations[i, axis] * tick", "accelerations[i, axis] * 0.0"))
    changed = run(tmp_path)
    assert changed[0] != first[0]
    assert changed[1] == "0"


def test_kernels_run_as_plain_python_for_debuggers(tmp_path):
    code = CODE.split("print")[0].replace("num_games=8", "num_games=1").replace("range(8)", "[0]").replace("600", "3")
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, check=True)  # noqa: S603
