"""The stamp that says of which sources machine code is.

A compiled function holds the code of all that it calls and the value of every constant that it names. So
its machine code is of the sources of the whole package `swarm_pz.kernels`, folders within it too, and of
`swarm_pz.config`, whose constants kernels take; they may take nothing from elsewhere.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import llvmlite.binding
import numba

SOURCES = ("kernels", "config")
"""Modules and whole packages of swarm_pz whose text makes the stamp of machine code."""


def sources(package: Path) -> list[Path]:
    """Return the files that machine code is of, in the folder of swarm_pz or a copy of it."""
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
"""Of the sources as this process found them."""


def processor() -> str:
    """Return the kind of processor that machine code is made for; on another a game may go another way."""
    return str(getattr(numba.config, "CPU_NAME", None) or llvmlite.binding.get_host_cpu_name())
