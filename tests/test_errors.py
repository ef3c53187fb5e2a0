from __future__ import annotations

import importlib.metadata
import json
import shlex
import sys

import pytest

from swarm_pz.errors import MissingExtraError, installing, require_extra


def came_from(monkeypatch, origin):
    class Installed:
        def read_text(self, name):
            assert name == "direct_url.json"
            return None if origin is None else json.dumps(origin)

    monkeypatch.setattr(importlib.metadata, "distribution", lambda name: Installed())


@pytest.mark.parametrize(
    ("origin", "wanted"),
    [
        (None, "swarm-pz[play]"),
        ({"url": "file:///a/b/swarm_pz-1-py3-none-any.whl", "archive_info": {}},
         "swarm-pz[play] @ file:///a/b/swarm_pz-1-py3-none-any.whl"),
        ({"url": "file:///a/clone", "dir_info": {}}, "swarm-pz[play] @ file:///a/clone"),
        ({"url": "https://x.org/s.git", "vcs_info": {"vcs": "git", "commit_id": "abc"}},
         "swarm-pz[play] @ git+https://x.org/s.git@abc"),
    ],
)  # fmt: skip
def test_a_missing_extra_is_installed_from_where_swarm_pz_came(monkeypatch, origin, wanted):
    came_from(monkeypatch, origin)
    assert shlex.split(installing("play")) == [sys.executable, "-m", "pip", "install", wanted]


def test_without_an_installation_the_name_is_given(monkeypatch):
    def none(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "distribution", none)
    with pytest.raises(
        MissingExtraError, match=r"no_such_module is not installed; .* -m pip install 'swarm-pz\[play\]'"
    ):
        require_extra("no_such_module.part", "play")
