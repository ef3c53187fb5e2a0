"""Runs the examples of each page in a temporary folder of its own."""

import pytest

collect_ignore = ["site_hooks.py"]  # MkDocs runs it


@pytest.fixture(autouse=True)
def _folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
