"""Recordings as a stranger forges them, a few of each kind; `benchmarks.table.forged` judges all 200."""

from __future__ import annotations

import itertools

import pytest

from benchmarks.table.forged import COUNT, forgeries, run
from tests.play.recordings.test_format import record
from tests.play.recordings.test_playback import CALM


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """Give the bytes of a real game's file."""
    path = tmp_path_factory.mktemp("games") / "a.jsonl"
    record(path, ticks=90, config=CALM)
    return path.read_bytes()


@pytest.mark.parametrize("kind", ["rules", "header", "event", "frame", "file"])
def test_every_forgery_is_named_and_ends_no_process(kind, honest, tmp_path):
    found = forgeries(honest)
    assert len(found) >= COUNT
    of_kind = [one for one in found if one.kind == kind]
    chosen = list(itertools.islice(of_kind, 0, None, -(-len(of_kind) // 8)))
    assert len(chosen) >= 6 and run(honest, chosen, tmp_path) == []
