"""Runs the examples of each page in a temporary folder of its own."""

import warnings

import pytest

collect_ignore = ["site_hooks.py"]  # MkDocs runs it


@pytest.fixture(autouse=True)
def _folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # torch.onnx.export itself causes this warning; here warnings are errors.
    warnings.filterwarnings("ignore", message=r"`isinstance\(treespec, LeafSpec\)`", category=FutureWarning)
