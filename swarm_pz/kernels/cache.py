"""The stamp of the sources that machine code was compiled from.

A compiled function contains the code of all functions that it calls and the value of every constant that it
uses. So the stamp covers the whole package `swarm_pz.kernels`, with its subpackages, and `swarm_pz.config`,
whose constants kernels use. Kernels may use nothing from elsewhere.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import llvmlite.binding
import numba

SOURCES = ("kernels", "config")
"""Modules and whole packages of swarm_pz whose text the stamp covers."""


def sources(package: Path) -> list[Path]:
    """Return the files that the stamp covers, in the folder of swarm_pz or a copy of it."""
    return sorted(path for name in SOURCES for path in (*package.glob(f"{name}.py"), *package.glob(f"{name}/**/*.py")))


def stamp_of(package: Path) -> str:
    """Return a digest of the names and texts of those files."""
    digest = hashlib.sha256()
    for path in sources(package):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()} {len(text)}\n".encode())
        digest.update(text)
    return digest.hexdigest()[:16]


STAMP = stamp_of(Path(__file__).parents[1])
"""The stamp of the sources as this process found them."""


def processor() -> str:
    """Return the kind of processor that machine code is made for; on another kind a game may differ."""
    return str(getattr(numba.config, "CPU_NAME", None) or llvmlite.binding.get_host_cpu_name())
