"""Checkpoints of a run: files without code, the learner's state in them, and the process's random streams.

The file holds arrays as safetensors; its header holds everything else, the story, as JSON.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import safe_open
from safetensors.numpy import save
from stable_baselines3 import PPO

from swarm_pz.errors import CheckpointError
from swarm_pz.files import draft_of
from swarm_pz.policies.learned import CARD

CHECKPOINT = "checkpoint.safetensors"
FORMAT = 1
BEGIN_AFRESH = "delete the folder, or choose another one (--out)"
LEAGUE, SEARCH = "league.json", "search.json"
"""Files that mark the folders of a league and of a search for exploiters."""

Story = dict[str, Any]
Arrays = dict[str, NDArray[Any]]


# --- the file -------------------------------------------------------------------------------------


def is_begun(folder: Path, mark: str) -> bool:
    """Return True if a folder's work can be resumed: it has the file `mark`; refuse a folder that holds other work."""
    if (folder / mark).is_file():
        return True
    for name in (CHECKPOINT, LEAGUE, SEARCH, CARD):
        if (folder / name).is_file():
            raise CheckpointError(f"{folder} holds another run, its {name}: choose another folder (--out)")
    return False


def write(path: Path, story: Story, arrays: Arrays) -> None:
    """Write a checkpoint atomically; JSON must be able to hold the story."""
    packed = save(arrays, metadata={"story": json.dumps(story | {"format": FORMAT})})
    with draft_of(path) as draft:
        draft.write_bytes(packed)


def read(path: Path, *, with_arrays: bool = True) -> tuple[Story, Arrays]:
    """Return story and arrays (if asked for); raise a CheckpointError if the file is corrupt or foreign."""
    try:
        with safe_open(path, framework="np") as file:
            story = json.loads((file.metadata() or {})["story"])
            arrays = {name: file.get_tensor(name) for name in file.keys()} if with_arrays else {}  # noqa: SIM118
        version = story["format"]
    except Exception as error:  # safetensors raises classes of its own
        raise CheckpointError(f"{path} is corrupt or foreign ({error}); {BEGIN_AFRESH}") from error
    if version != FORMAT:
        raise CheckpointError(f"{path} must be of format {FORMAT}, got {version!r}; {BEGIN_AFRESH}")
    return story, arrays


# --- random streams ---------------------------------------------------------------------------------


def random_streams() -> tuple[Any, Any]:
    """Return the states of PyTorch's and NumPy's global random streams, from which SB3 draws."""
    return torch.get_rng_state(), np.random.get_state()  # noqa: NPY002  (SB3's)


def set_random_streams(states: tuple[Any, Any]) -> None:
    """Set the process's streams to what `random_streams` returned."""
    torch.set_rng_state(states[0])
    np.random.set_state(states[1])  # noqa: NPY002


@contextmanager
def random_streams_kept() -> Iterator[None]:
    """Restore the process's streams at the end."""
    streams = random_streams()
    try:
        yield
    finally:
        set_random_streams(streams)


# --- the learner ------------------------------------------------------------------------------------


def learner_state(model: PPO) -> tuple[Story, Arrays]:
    """Return weights, optimizer and counters of a learner; call it only between two rollouts."""
    story: Story = {
        "steps": model.num_timesteps,
        "updates": model._n_updates,
        "episodes": [{key: float(value) for key, value in info.items()} for info in model.ep_info_buffer or ()],
    }
    arrays = {f"policy.{name}": values.numpy() for name, values in model.policy.state_dict().items()}
    for number, held in model.policy.optimizer.state_dict()["state"].items():
        arrays |= {f"optimizer.{number}.{name}": values.numpy() for name, values in held.items()}
    return story, arrays


def restore_learner(model: PPO, story: Story, arrays: Arrays) -> None:
    """Give a learner the state that `learner_state` returned."""
    held: dict[int, dict[str, torch.Tensor]] = {}
    weights: dict[str, torch.Tensor] = {}
    for name, values in arrays.items():
        part, rest = name.split(".", 1)
        number, _, entry = rest.partition(".")
        where, key = (weights, rest) if part == "policy" else (held.setdefault(int(number), {}), entry)
        where[key] = torch.from_numpy(values.copy())
    model.policy.load_state_dict(weights)
    groups = model.policy.optimizer.state_dict()["param_groups"]
    model.policy.optimizer.load_state_dict({"state": held, "param_groups": groups})
    model.num_timesteps, model._n_updates = int(story["steps"]), int(story["updates"])
    model.ep_info_buffer = deque(story["episodes"], maxlen=model._stats_window_size)
    model.ep_success_buffer = deque(maxlen=model._stats_window_size)
