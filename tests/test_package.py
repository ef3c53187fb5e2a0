from __future__ import annotations

import subprocess
import sys
import types

import swarm_pz


def test_the_public_surface_is_what_all_says():
    public = {
        name
        for name, value in vars(swarm_pz).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert public - {"version"} == set(swarm_pz.__all__)


def test_importing_the_package_is_light():
    heavy = [
        "torch",
        "stable_baselines3",
        "PIL",
        "pygame",
        "matplotlib",
        "tyro",
        "rich",
        "policies",
        "training",
    ]
    code = f"import sys, swarm_pz; print([name for name in {heavy} if name in sys.modules])"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout  # noqa: S603
    assert printed.strip() == "[]"
