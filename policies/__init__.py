"""Policies: tactics written by hand, learned tactics, and how to find them by name."""

from __future__ import annotations

import os
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError, require_extra
from swarm_pz.policy import Player, registered
from swarm_pz.policy import load as _load

__all__ = ["load", "names"]

# Between two of torch's operations OpenMP's workers wait in a busy loop, on the cores that the
# simulator's threads or other processes want by then. With short waits training is a quarter faster, and
# matches on a busy machine many times; this has an effect only before torch is imported.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")


def names() -> list[str]:
    """Return the names of all installed policies, in alphabetical order."""
    return sorted(registered())


def load(name: str | Path, config: GameConfig | None = None) -> Player:
    """Return the policy of a name, or of a folder that training wrote.

    Parameters
    ----------
    name : str or Path
        One of `names()`, or a folder that holds ``policy.safetensors`` and ``policy.json``.
    config : GameConfig, optional
        The game that it will play.

    Raises
    ------
    PolicyError
        If there is no such name; the message gives the nearest.
    CheckpointError
        If the folder's files are corrupt or do not fit the game.
    """
    config = config if config is not None else GameConfig()
    first, folder = str(name).split(":", 1)[0], Path(name)
    if first not in registered() and folder.is_dir():
        require_extra("torch", "training")
        from swarm_pz.policies.learned import LearnedPolicy

        return LearnedPolicy.read(folder, config)
    if first not in registered() and folder.exists():
        raise PolicyError(f"expected a policy or a folder that training wrote, got the file {str(name)!r}")
    if first not in registered() and os.sep in first:
        raise PolicyError(f"there is no folder {first!r}, nor a policy of that name; there are {', '.join(names())}")
    return _load(str(name), config)
