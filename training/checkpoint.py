"""A run at one moment, as one file without code: arrays as safetensors, all else as JSON in its header."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import safe_open
from safetensors.numpy import save

from swarm_pz.errors import CheckpointError
from swarm_pz.files import draft_of

CHECKPOINT = "checkpoint.safetensors"
FORMAT = 1

Story = dict[str, Any]
Arrays = dict[str, NDArray[Any]]


def write(path: Path, story: Story, arrays: Arrays) -> None:
    """Write a checkpoint atomically.

    Parameters
    ----------
    path : Path
    story : dict
        Whatever JSON can say.
    arrays : dict of array
    """
    packed = save(arrays, metadata={"story": json.dumps(story | {"format": FORMAT})})
    with draft_of(path) as draft:
        draft.write_bytes(packed)


def read_story(path: Path) -> Story:
    """Read what a checkpoint says beside its arrays; arguments and errors as of `read`."""
    return _open(path, with_arrays=False)[0]


def read(path: Path) -> tuple[Story, Arrays]:
    """Read what `write` wrote.

    Raises
    ------
    CheckpointError
        If the file is corrupt or foreign.
    """
    return _open(path, with_arrays=True)


def _open(path: Path, *, with_arrays: bool) -> tuple[Story, Arrays]:
    try:
        with safe_open(path, framework="np") as file:
            story = json.loads((file.metadata() or {})["story"])
            arrays = {name: file.get_tensor(name) for name in file.keys()} if with_arrays else {}  # noqa: SIM118
        version = story["format"]
    except Exception as error:  # safetensors raises its own kinds, none of them public
        raise CheckpointError(f"{path} is corrupt or foreign ({error}); {BEGIN_AFRESH}") from error
    if version != FORMAT:
        raise CheckpointError(f"{path} must be of format {FORMAT}, got {version!r}; {BEGIN_AFRESH}")
    return story, arrays


BEGIN_AFRESH = "begin afresh with --overwrite, or in another folder (--out)"


def under(prefix: str, arrays: Arrays) -> Arrays:
    """Return arrays with a prefix before their names."""
    return {f"{prefix}.{name}": values for name, values in arrays.items()}


def of(prefix: str, arrays: Arrays) -> Arrays:
    """Return the arrays that `under` put a prefix before."""
    start = f"{prefix}."
    return {name.removeprefix(start): np.asarray(held) for name, held in arrays.items() if name.startswith(start)}
