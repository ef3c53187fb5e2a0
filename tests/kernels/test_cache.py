from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import swarm_pz

CODE = """
import numpy as np
from swarm_pz.simulator import Simulator
from swarm_pz.kernels.game import advance_games
simulator = Simulator()
simulator.reset([0])
simulator.advance(3)
print(simulator.positions[0, 0, 0], sum(advance_games.stats.cache_hits.values()))
"""


def run(folder: Path) -> list[str]:
    command = [sys.executable, "-c", CODE]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout.split()  # noqa: S603


def test_changing_a_rule_recompiles_what_calls_it(tmp_path):
    package = tmp_path / "swarm_pz"
    shutil.copytree(Path(swarm_pz.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    first, again = run(tmp_path), run(tmp_path)
    assert first[0] == again[0]
    assert (first[1], again[1]) == ("0", "1")
    dynamics = package / "kernels" / "dynamics.py"
    dynamics.write_text(dynamics.read_text().replace("accelerations[i, axis] * tick", "accelerations[i, axis] * 0.0"))
    changed = run(tmp_path)
    assert changed[0] != first[0]
    assert changed[1] == "0"
