"""Where results come from: the rules that were played, their hash, the versions, and the command."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import importlib.util
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import entry_points, is_own
from swarm_pz.config.registry import GROUP as SYSTEMS
from swarm_pz.policy import FOLDERS, GROUP

_PACKAGES = ("swarm-pz", "numpy", "numba", "torch", "stable-baselines3")
"""What results depend on; the last two where somebody learned."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that results depend on, as far as they are installed."""
    found = {"python": platform.python_version()}
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found[name] = importlib.metadata.version(name)
    return found


@functools.cache
def required_versions() -> dict[str, str]:
    """Return what must be alike where the same games are to be played.

    Those are the versions, less that of Python, the source of swarm-pz, and the packages that add policies or control
    systems. Nothing that is installed meanwhile counts: it has not been loaded.
    """
    found = {name: version for name, version in versions().items() if name != "python"}
    found["swarm-pz"] = f"{found.get('swarm-pz', 'in a folder')}, source {_source()}"
    for group in (GROUP, FOLDERS, SYSTEMS):
        found |= {p.dist.name: p.dist.version for p in entry_points(group) if p.dist is not None and not is_own(p)}
    return found


def _source() -> str:
    """Return a hash of the code, wherever its folders are installed."""
    content = hashlib.sha256()
    roots = {}
    for package in ("swarm_pz", "swarm_pz.policies", "swarm_pz.training"):
        spec = importlib.util.find_spec(package)
        for place in (spec.submodule_search_locations or ()) if spec is not None else ():
            roots[package] = Path(place)
    apart = {roots["swarm_pz"] / name for name in ("policies", "training")}
    for package, root in roots.items():
        for path in sorted(root.rglob("*.py")):
            if package == "swarm_pz" and apart & set(path.parents):  # links, in a clone
                continue
            content.update(f"{package} {path.relative_to(root).as_posix()}\n".encode())
            content.update(path.read_bytes())
    return content.hexdigest()[:12]


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
