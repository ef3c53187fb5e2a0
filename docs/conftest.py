"""The pages' examples run in a folder of their own each."""

import warnings

import pytest

collect_ignore = ["site_hooks.py"]  # MkDocs runs it


@pytest.fixture(autouse=True)
def _folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # What torch.onnx.export does inside; here warnings are errors.
    warnings.filterwarnings("ignore", message=r"`isinstance\(treespec, LeafSpec\)`", category=FutureWarning)
