"""The scripts do what they say, with a stand-in for the interpreter that they install into."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_what_is_installed_is_not_installed_again(tmp_path):
    interpreter = tmp_path / "venv/bin/python"
    interpreter.parent.mkdir(parents=True)
    interpreter.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path / "calls"}\n')
    interpreter.chmod(0o755)

    def installed(*extras):
        (tmp_path / "calls").write_text("")
        for extra in extras:
            environment = os.environ | {"VENV": str(tmp_path / "venv"), "PYTHON": sys.executable}
            subprocess.run([ROOT / "scripts/setup", extra], env=environment, check=True, capture_output=True)  # noqa: S603
        return [line.split(".[")[1] for line in (tmp_path / "calls").read_text().splitlines() if ".[" in line]

    assert installed("play", "training", "play", "training") == ["play]", "training]"]
    assert installed("test", "play", "docs", "peers", "peers") == ["test]", "peers]"]
