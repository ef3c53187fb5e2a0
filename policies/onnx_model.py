"""A neural network of anybody's in an ONNX file, which was tried before it runs here."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from typing import Any

from swarm_pz.policies import onnx_checks
from swarm_pz.policies.onnx_checks import MEMORY, MOST_BYTES, SECONDS, Arrays, ModelError, Plug, Signature


class Network:
    """A model that runs: on one thread, as its file says it, with nothing rearranged.

    Parameters
    ----------
    data : bytes
        The file.

    Raises
    ------
    ModelError
        If it is not such as may play.
    """

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.signature = examine(data)
        self._session = onnx_checks.open_session(data)

    def __getstate__(self) -> dict[str, Any]:
        return {"data": self.data}  # a session can be neither copied nor sent

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["data"])  # type: ignore[misc]

    def run(self, feeds: Arrays) -> Arrays:
        """Return all outputs of `Signature.rows` games.

        Raises
        ------
        ModelError
            If it fails, or answers NaN or infinity.
        """
        return onnx_checks.run_session(self._session, feeds)


_HANGS_S = 20 * SECONDS
"""Seconds after which the process that tries a model is ended, however busy the machine: it counts its own work, and
ends itself."""
_known: dict[str, Signature | str] = {}
"""What was found, by digests: each model is tried once."""


def examine(data: bytes) -> Signature:
    """Try a model in a process of its own; return what it takes and gives.

    Raises
    ------
    ModelError
        If it is not such as may play.
    """
    if len(data) > MOST_BYTES:
        raise ModelError(f"is too large: expected {MOST_BYTES:,} bytes or fewer, got {len(data):,}")
    digest = hashlib.sha256(data).hexdigest()
    if digest not in _known:
        _known[digest] = _tried(data)
    if isinstance(found := _known[digest], str):
        raise ModelError(found)
    return found


def _tried(data: bytes) -> Signature | str:
    """Return what a model is, or why it is refused."""
    # -P: what stands beside that file must not be taken for a library.
    words = [sys.executable, "-P", onnx_checks.__file__]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        done = subprocess.run(words, input=data, capture_output=True, timeout=_HANGS_S, env=environment)  # noqa: S603
    except subprocess.TimeoutExpired as error:
        raise ModelError(f"takes more than {_HANGS_S} s to open and to answer four times") from error
    lines = done.stdout.decode(errors="replace").splitlines()
    if done.returncode or not lines:
        last = (done.stderr.decode(errors="replace").strip().splitlines() or ["no word"])[-1]
        raise ModelError(
            f"ended the process that tried it (status {done.returncode}: {last[:300]}): it takes more than "
            f"{SECONDS} s or {MEMORY / 2**30:g} GiB, or is broken"
        )
    said = json.loads(lines[-1])
    if "refused" in said:
        return str(said["refused"])
    plugs = [{name: Plug(dtype, tuple(shape)) for name, (dtype, shape) in part.items()} for part in said["plugs"]]
    return Signature(said["rows"], *plugs)
