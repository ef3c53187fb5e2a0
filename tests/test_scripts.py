"""`scripts/setup` installs each extra once, seen by a stand-in for Python that records its arguments."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def setup(tmp_path):
    """Run scripts/setup in a stand-in environment, and return the extras that it installs."""
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text(f'#!/bin/sh\necho "$@" >> {tmp_path}/said\n')
    python.chmod(0o755)

    def run(extras):
        (tmp_path / "said").write_text("")
        environment = os.environ | {"VENV": str(tmp_path)}
        script = [ROOT / "scripts/setup", extras]
        done = subprocess.run(script, check=True, env=environment, capture_output=True, text=True)  # noqa: S603
        installed = re.findall(r"--(?:editable [.]\[|requirement )([^\]\n]*)", (tmp_path / "said").read_text())
        assert ("minutes in all" in done.stdout) is bool(installed)
        return installed

    return run


def test_what_is_installed_is_not_installed_again(setup):
    assert setup("train,play") == ["train,play"]
    assert setup("train") == setup("play") == setup("play,train") == []
    assert setup("lab") == ["lab"]
    assert setup("lab,play") == []


def test_the_developers_extra_holds_all_but_what_other_libraries_need(setup):
    peers = "benchmarks/peers-requirements.txt"
    assert setup("dev") == ["dev"]
    assert setup("cluster") == setup("train,play") == []
    assert setup(peers) == [peers]
