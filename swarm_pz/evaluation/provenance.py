"""Where results come from: the rules that were played, their hash, the versions, and the command."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import importlib.util
import platform
from collections.abc import Callable, Mapping
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
    return {"python": platform.python_version(), **dict(_packages(importlib.metadata.version))}


@functools.lru_cache(maxsize=2)  # to look takes tens of milliseconds, and every checkpoint asks; what runs is loaded
def _packages(look: Callable[[str], str]) -> tuple[tuple[str, str], ...]:
    found = []
    for name in _PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            found.append((name, look(name)))
    return tuple(found)


@functools.cache
def required_versions() -> dict[str, str]:
    """Return the versions that must be alike on machines that share work: packages, plug-ins, swarm-pz's source.

    What is installed later does not count, since it has not been loaded.
    """
    found = {name: version for name, version in versions().items() if name != "python"}
    found["swarm-pz"] = f"{found.get('swarm-pz', 'in a folder')}, source {_source()}"
    for group in (GROUP, FOLDERS, SYSTEMS):
        found |= {p.dist.name: p.dist.version for p in entry_points(group) if p.dist is not None and not is_own(p)}
    return found


def _source() -> str:
    """Return a hash of the code, wherever its folders are installed."""
    content = hashlib.sha256()
    for package in ("swarm_pz", "swarm_pz.policies", "swarm_pz.training"):
        spec = importlib.util.find_spec(package)
        for root in map(Path, (spec.submodule_search_locations or ()) if spec is not None else ()):
            for path in sorted(root.rglob("*.py")):
                place = path.relative_to(root)
                if package != "swarm_pz" or place.parts[0] not in ("policies", "training"):  # links, in a clone
                    content.update(f"{package} {place.as_posix()}\n".encode() + path.read_bytes())
    return content.hexdigest()[:12]


def provenance(config: GameConfig | Mapping[str, GameConfig], command: str = "") -> dict[str, Any]:
    """Return what every file of results carries: the rules, their hash, versions and the command.

    Of several games, a mapping by names, rules and hashes are dicts by these names. Results may be compared where the
    hashes are equal.

    Examples
    --------
    >>> found = provenance(GameConfig(drones_per_team=5), "swarm-pz evaluate ring")
    >>> GameConfig.from_dict(found["rules"]).rules_hash == found["rules_hash"]
    True
    """
    if isinstance(config, GameConfig):
        of_game: dict[str, Any] = {"rules": config.rules, "rules_hash": config.rules_hash}
    else:
        of_game = {key: {name: getattr(game, key) for name, game in config.items()} for key in ("rules", "rules_hash")}
    return {**of_game, "versions": versions(), "command": command}
