from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import settings
from playwright.sync_api import sync_playwright

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("OMP_NUM_THREADS", "1")  # cores are shared, and threads that wait for others are busy with it
settings.register_profile("ci", derandomize=True, deadline=None, max_examples=40)
settings.load_profile("ci")

HERE = Path(__file__).parent
BITS = (
    "envs/test_batch_env.py", "evaluation/test_match.py", "evaluation/test_rollout.py", "kernels/*.py",
    "kernels/controllers/*.py", "play/test_game.py", "play/recordings/*.py", "policies/*.py",
    "simulator/*.py", "spaces/test_observation.py", "test_golden.py", "test_variants.py", "training/test_vec_env.py",
)  # fmt: skip
"""Tests whose outcome can depend on how the processor rounds; those marked `bits` run a second time as on another."""


def pytest_configure(config):
    """Let tests that the clock measures come first on a busy machine: they are the largest group, which gw0 takes."""
    if os.environ.get("PYTEST_XDIST_WORKER", "gw0") != "gw0" and hasattr(os, "nice"):
        os.nice(10)


def pytest_collection_modifyitems(items):
    for item in items:
        if HERE not in item.path.parents:
            continue
        path = item.path.relative_to(HERE)
        if any(path.match(pattern) for pattern in BITS):
            item.add_marker(pytest.mark.bits)
        if path.parts[0] == "play":  # what is measured by the clock is measured one at a time
            item.add_marker(pytest.mark.xdist_group("play"))


@pytest.fixture(autouse=True)
def _folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
)


@pytest.fixture(scope="module")
def chromium():
    """Give a browser; not for longer, since its event loop would be in the way of others."""
    if CHROMIUM is None:
        pytest.fail("there is no Chromium here: scripts/browser installs it, or leave these out with -m 'not browser'")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()
