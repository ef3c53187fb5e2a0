from __future__ import annotations

import os
import shutil

import pytest
from hypothesis import settings
from playwright.sync_api import sync_playwright

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
settings.register_profile("ci", derandomize=True, deadline=None, max_examples=40)
settings.load_profile("ci")


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
