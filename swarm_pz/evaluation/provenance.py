"""Origin of results: rules, their hash, versions, and the command."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import importlib.util
import platform
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import entry_points, is_own
from swarm_pz.config.registry import GROUP as SYSTEMS
from swarm_pz.policy import FOLDERS, GROUP

_PACKAGES = ("swarm-pz", "numpy", "numba", "torch", "stable-baselines3")
"""Packages that results depend on; the last two matter for training."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the installed packages that results depend on."""
    return {"python": platform.python_version()} | {name: v for name in _PACKAGES if (v := _version(name)) is not None}


@functools.cache  # it takes tens of milliseconds, and every checkpoint asks
def _version(name: str) -> str | None:
    with contextlib.suppress(importlib.metadata.PackageNotFoundError):
        return importlib.metadata.version(name)
    return None


@functools.cache
def required_versions() -> dict[str, str]:
    """Return the versions that must agree on machines that share work: of packages, plug-ins, swarm-pz's source."""
    required = {name: version for name, version in versions().items() if name != "python"}
    required["swarm-pz"] = f"{required.get('swarm-pz', 'in a folder')}, source {_source()}"
    for group in (GROUP, FOLDERS, SYSTEMS):
        required |= {p.dist.name: p.dist.version for p in entry_points(group) if p.dist is not None and not is_own(p)}
    return required


def _source() -> str:
    """Return a hash of swarm-pz's Python files."""
    content = hashlib.sha256()
    for package in ("swarm_pz", "swarm_pz.policies", "swarm_pz.training"):
        spec = importlib.util.find_spec(package)
        for root in map(Path, (spec.submodule_search_locations or ()) if spec is not None else ()):
            for path in sorted(root.rglob("*.py")):
                place = path.relative_to(root)
                if package != "swarm_pz" or place.parts[0] not in ("policies", "training"):  # symbolic links in a clone
                    content.update(f"{package} {place.as_posix()}\n".encode() + path.read_bytes())
    return content.hexdigest()[:12]


def provenance(config: GameConfig, command: str = "") -> dict[str, Any]:
    """Return rules, their hash, versions and the command, for a file of results.

    Results may be compared if their hashes are equal.

    Examples
    --------
    >>> found = provenance(GameConfig(drones_per_team=5), "swarm-pz evaluate ring")
    >>> GameConfig.from_dict(found["rules"]).rules_hash == found["rules_hash"]
    True
    """
    return {"rules": config.rules, "rules_hash": config.rules_hash, "versions": versions(), "command": command}
