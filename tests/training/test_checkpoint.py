from __future__ import annotations

import json

import numpy as np
import pytest
from safetensors.numpy import save_file

from swarm_pz.errors import CheckpointError
from swarm_pz.training.checkpoint import of, read, read_story, under, write


def test_what_is_written_is_read_and_the_story_alone_if_no_more_is_asked_for(tmp_path):
    arrays = {"a": np.arange(3, dtype=np.int64), "b.c": np.full((2, 2), 0.5, np.float32)}
    write(tmp_path / "run", {"steps": 3, "names": ["x", None]}, arrays)
    story, found = read(tmp_path / "run")
    assert story == read_story(tmp_path / "run") == {"steps": 3, "names": ["x", None], "format": 1}
    assert found.keys() == arrays.keys()
    for name, values in arrays.items():
        assert found[name].dtype == values.dtype
        np.testing.assert_array_equal(found[name], values)


def test_arrays_are_found_under_their_own_prefix_alone():
    one, two, three = np.zeros(1), np.ones(2), np.ones(3)
    together = under("game", {"a": one}) | under("games", {"a": two, "b.c": three})
    assert set(together) == {"game.a", "games.a", "games.b.c"}
    assert {name: len(values) for name, values in of("game", together).items()} == {"a": 1}
    assert {name: len(values) for name, values in of("games", together).items()} == {"a": 2, "b.c": 3}


def test_a_file_of_another_format_is_refused_with_what_to_do(tmp_path):
    save_file({"a": np.zeros(1)}, tmp_path / "run", metadata={"story": json.dumps({"format": 2})})
    for reads in (read, read_story):
        with pytest.raises(CheckpointError, match="must be of format 1, got 2; begin afresh with --overwrite"):
            reads(tmp_path / "run")
