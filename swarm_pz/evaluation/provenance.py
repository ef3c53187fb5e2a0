"""Where results come from: the rules that were played, their hash, the versions, and the command."""

from __future__ import annotations

import contextlib
import importlib.metadata
import platform
from collections.abc import Mapping
from typing import Any

from swarm_pz.config import GameConfig

_PACKAGES = ("swarm-pz", "numpy", "numba", "torch", "stable-baselines3")
"""What results depend on; the last two where somebody learned."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that results depend on, as far as they are installed."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found


def provenance(config: GameConfig | Mapping[str, GameConfig], command: str = "") -> dict[str, Any]:
    """Return what every file of results carries, as plain values.

    Parameters
    ----------
    config : GameConfig or mapping of str to GameConfig
        What was played; by name, if several games were.
    command : str
        What was called; empty where it was not the command line.

    Returns
    -------
    dict
        ``rules`` and ``rules_hash`` (dicts by the names of the games, if they have names): results may be
        compared where the hashes are equal; ``versions`` and ``command``.

    Examples
    --------
    >>> found = provenance(GameConfig(drones_per_team=5), "swarm-pz evaluate ring")
    >>> GameConfig.from_dict(found["rules"]).rules_hash == found["rules_hash"]
    True
    """
    rules: dict[str, Any]
    rules_hash: str | dict[str, str]
    if isinstance(config, GameConfig):
        rules, rules_hash = config.rules, config.rules_hash
    else:
        rules = {name: game.rules for name, game in config.items()}
        rules_hash = {name: game.rules_hash for name, game in config.items()}
    return {"rules": rules, "rules_hash": rules_hash, "versions": versions(), "command": command}
