from __future__ import annotations

import os
import shutil
from functools import cache
from pathlib import Path

import pytest
from hypothesis import settings

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("OMP_NUM_THREADS", "1")  # cores are shared, and waiting threads keep a core busy
settings.register_profile("ci", derandomize=True, deadline=None, max_examples=40)
settings.load_profile("ci")

HERE = Path(__file__).parent
BITS = (
    "envs/test_batch_env.py", "evaluation/test_match.py", "evaluation/test_rollout.py",
    "kernels/controllers/*.py", "kernels/test_capture.py", "kernels/test_game.py", "kernels/test_mirror.py",
    "kernels/test_released.py", "play/test_game.py", "play/recordings/test_playback.py",
    "play/recordings/test_verification.py", "policies/test_commanders.py", "policies/test_lookahead.py",
    "policies/test_planner.py", "policies/test_scripted.py", "simulator/*.py",
    "spaces/test_observation.py", "test_golden.py", "training/test_vec_env.py",
)  # fmt: skip
"""Tests that can depend on how the kernels round; marked `bits`, they run again compiled for a generic processor."""

PAGES = ("tests/play/test_journeys.py", "tests/play/test_journey_study.py", "tests/play/test_scenes.py")
"""Tests that wait for browsers and clocks."""
SERVERS = tuple(
    f"tests/play/{name}.py"
    for name in (
        "ros/test_bridge", "ros/test_rosbridge",
        "server/test_app", "server/test_lobby",
        "server/test_policy_workers", "server/test_room", "server/test_serve",
        "server/test_studies", "server/test_varied_rooms", "test_client", "test_study_run",
    )
)  # fmt: skip
"""Tests that wait for servers, processes and clocks."""
TOGETHER = {
    "servers": SERVERS,
    "learning": ("tests/training/", "tests/cli/test_cli.py", "tests/test_docs.py"),
    "jax": ("tests/jax/",),
    "standard": ("tests/standard/",),
    "site": ("tests/test_package.py", "tests/test_pages.py"),
}
"""Groups of tests that one process runs: they wait, or need libraries or fixtures that take long to prepare."""


def pytest_xdist_make_scheduler(config, log):
    """Keep a file in one process, since its tests share fixtures, and a group of `TOGETHER`."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            group = group_of(nodeid)
            return nodeid.split("::")[0] if group is None else group

    return Scheduling(config, log)


def group_of(nodeid):
    """Return the test's group of `TOGETHER`, or None."""
    return next((group for group, files in TOGETHER.items() if nodeid.startswith(files)), None)


@cache
def make_way():
    """Lower the priority of this process, for good."""
    if hasattr(os, "nice"):
        os.nice(10)


def pytest_runtest_setup(item):
    """Keep a worker's priority for its timed tests, which come first; lower it at its first other test."""
    if "PYTEST_XDIST_WORKER" in os.environ and not item.nodeid.startswith((*PAGES, *SERVERS)):
        make_way()


def depends_on_rounding(path):
    return HERE in path.parents and any(path.relative_to(HERE).match(pattern) for pattern in BITS)


def pytest_ignore_collect(collection_path, config):
    """With `-m bits`, do not even import other test files."""
    is_left_out = config.option.markexpr.startswith("bits") and collection_path.is_file()
    return True if is_left_out and not depends_on_rounding(collection_path) else None


def pytest_collection_modifyitems(items):
    # Tests that wait come first, so that others run meanwhile; then groups, which take one process long.
    items.sort(key=lambda item: (not item.nodeid.startswith((*PAGES, *SERVERS)), group_of(item.nodeid) is None))
    for item in items:
        if depends_on_rounding(item.path):
            item.add_marker(pytest.mark.bits)


@pytest.fixture(autouse=True)
def _folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
"""The first one installed is used; the headless shell needs half as much processor time."""
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
FLAGS = (
    "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update", "--no-first-run",
)  # fmt: skip


@pytest.fixture(scope="module")
def chromium():
    """Yield a browser for one module; if it lived longer, its event loop would disturb other tests."""
    if CHROMIUM is None:
        pytest.fail("there is no Chromium here: scripts/browser installs it, or leave these out with -m 'not browser'")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()
