from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from swarm_pz.errors import CheckpointError
from swarm_pz.training.checkpoint import read, write


def test_what_is_written_is_read_and_the_story_alone_if_no_more_is_asked_for(tmp_path):
    arrays = {"a": np.arange(3, dtype=np.int64), "b.c": np.full((2, 2), 0.5, np.float32)}
    write(tmp_path / "run", {"steps": 3, "names": ["x", None]}, arrays)
    story, found = read(tmp_path / "run")
    assert story == {"steps": 3, "names": ["x", None], "format": 1}
    assert read(tmp_path / "run", with_arrays=False) == (story, {})
    assert {name: (values.dtype, values.tolist()) for name, values in found.items()} == {
        name: (values.dtype, values.tolist()) for name, values in arrays.items()
    }


def test_what_is_no_checkpoint_is_refused_with_what_to_do(tmp_path):
    path = tmp_path / "run"
    save_file({"a": np.zeros(1)}, path, metadata={"story": json.dumps({"format": 2})})
    with pytest.raises(CheckpointError, match=r"format 1, got 2; .*--out"):
        read(path)
    save_file({"something": np.zeros(3)}, path)
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        read(path)
    path.write_bytes(b"PK\x03\x04 torn")
    with pytest.raises(CheckpointError, match="corrupt or foreign"):
        read(path)


def test_a_checkpoint_that_is_being_written_is_not_seen(tmp_path, monkeypatch):
    path, write_bytes = tmp_path / "run", Path.write_bytes
    write(path, {"told": 1}, {"numbers": np.zeros(2)})

    def killed(file, content):
        write_bytes(file, content[: len(content) // 2])
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", killed)
    with pytest.raises(KeyboardInterrupt):
        write(path, {"told": 2}, {"numbers": np.ones(2)})
    story, arrays = read(path)
    assert story["told"] == 1 and not arrays["numbers"].any()
    assert [file.name for file in tmp_path.iterdir()] == ["run"]
