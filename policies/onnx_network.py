"""A neural network in an ONNX file, which runs in its own process with the limits of `swarm_pz.policy.program`."""

from __future__ import annotations

import base64
import hashlib
import os
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.policy.program import Pipe

MOST_BYTES = 64 * 2**20
"""Largest size of a file."""
ROWS = 8
"""Batch size of a model that takes any number of games."""
_MOST_ROWS = 256
_EXTERNAL = b"\x0a\x08location"
"""A key of every tensor stored in another file. If it is encoded otherwise, the worker still cannot open the file."""
_START_SECONDS = 120.0
"""Longest wait until ONNX Runtime is loaded, however busy the machine."""
_TYPES = {"float": "float32", "double": "float64"} | {
    name: name for name in ("float16", "bool", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
}

Arrays = dict[str, NDArray[Any]]


class TensorSpec(NamedTuple):
    """An input or an output of a model: its type, and its shape for `Signature.rows` games."""

    dtype: str
    shape: tuple[int, ...]


class Signature(NamedTuple):
    """The inputs and outputs of a model, `rows` games at once."""

    rows: int
    inputs: dict[str, TensorSpec]
    outputs: dict[str, TensorSpec]


_known: dict[str, Signature] = {}
"""Signatures of the models tried so far, by digest."""


class Network:
    """Runs a model from its file's bytes; raises a CheckpointError, a text to follow its name, if it cannot play."""

    def __init__(self, data: bytes) -> None:
        if len(data) > MOST_BYTES:
            raise CheckpointError(f"is too large: expected {MOST_BYTES:,} bytes or fewer, got {len(data):,}")
        if _EXTERNAL in data:
            raise CheckpointError("keeps weights in another file (external data): save it as one file")
        self.data = data
        digest = hashlib.sha256(data).hexdigest()
        try:
            rows, inputs = _shaped(self._start())
            if digest not in _known:
                _known[digest] = self._try(rows, inputs)
        except PolicyError as error:
            raise CheckpointError(str(error)) from error
        self.signature = _known[digest]

    def __getstate__(self) -> dict[str, Any]:
        return {"data": self.data}  # a process can be neither copied nor sent

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["data"])  # type: ignore[misc]

    def _start(self) -> list[Any]:
        """Start the process; return name, type and shape of each input."""
        words = [sys.executable, "-P", str(Path(__file__).with_name("onnx_worker.py"))]
        self._pipe = Pipe("it", words, dict(os.environ) | {"OMP_NUM_THREADS": "1"}, Path.cwd())
        self._pipe.receive("load ONNX Runtime", _START_SECONDS)
        return list(self._ask("open", {"model": base64.b64encode(self.data).decode()})["inputs"])

    def _ask(self, what: str, message: dict[str, Any]) -> dict[str, Any]:
        self._pipe.send(message)
        answer = self._pipe.receive(what)
        if "error" in answer:
            raise PolicyError(f"cannot {what}: {answer['error']}")
        return answer

    def restart(self) -> None:
        """Start the process again if it has ended."""
        if self._pipe.is_over:
            self._start()

    def run(self, feeds: Arrays) -> Arrays:
        """Return all outputs for `Signature.rows` games; raise a ForfeitError or a PolicyError if the model fails."""
        packed = {
            name: [str(array.dtype), array.shape, base64.b64encode(array.tobytes()).decode()]
            for name, array in feeds.items()
        }
        answers = {}
        for name, (dtype, shape, data) in self._ask("run", packed)["outputs"].items():
            answers[name] = np.frombuffer(base64.b64decode(data), dtype).reshape(shape)
            if not np.isfinite(answers[name]).all():
                raise PolicyError(f"answered NaN or infinity by its output {name!r}")
        return answers

    def _try(self, rows: int, inputs: dict[str, TensorSpec]) -> Signature:
        """Run the model on zeros and on noise: its outputs must repeat, and depend on one game alone."""
        random = np.random.default_rng(0)
        zeros = {name: np.zeros(spec.shape, spec.dtype) for name, spec in inputs.items()}
        noise = {
            name: (random.random(shape) * (256 if kind == "uint8" else 2 if "int" in kind else 1)).astype(kind)
            for name, (kind, shape) in inputs.items()
        }
        of_zeros, answers, again = self.run(zeros), self.run(noise), self.run(noise)
        for name, values in of_zeros.items():
            if values.shape[:1] != (rows,):
                raise PolicyError(f"must answer {rows} games by {name!r} if it is shown {rows}, got {values.shape}")
        if any(not np.array_equal(answers[name], again[name]) for name in answers):
            raise PolicyError("answers the same twice in two ways")
        alone = self.run({name: np.concatenate([values[:1], zeros[name][1:]]) for name, values in noise.items()})
        for name, values in alone.items():
            expected = np.concatenate([answers[name][:1], of_zeros[name][1:]])
            if not np.allclose(values, expected, rtol=1e-3, atol=1e-3):
                raise PolicyError(
                    f"answers one game by what it sees of others, by its output {name!r}: keep games apart"
                )
        outputs = {name: TensorSpec(str(values.dtype), values.shape) for name, values in of_zeros.items()}
        return Signature(rows, inputs, outputs)


def _shaped(inputs: list[Any]) -> tuple[int, dict[str, TensorSpec]]:
    """Return the batch size and the inputs of such a batch, from name, type and shape of each input."""
    firsts, found = set(), {}
    for name, kind, shape in inputs:
        dtype = _TYPES.get(kind.removeprefix("tensor(").removesuffix(")"))
        if dtype is None or not shape or not all(isinstance(size, int) and size > 0 for size in shape[1:]):
            raise PolicyError(
                f"must take numbers of known shapes, the games first, got {name!r} {kind} {shape}: fix its shape"
            )
        firsts.add(shape[0] if isinstance(shape[0], int) else 0)
        found[name] = TensorSpec(dtype, tuple(shape[1:]))
    rows = max(firsts - {0}, default=ROWS)
    if not found or firsts - {0, rows} or not 0 < rows <= _MOST_ROWS:
        raise PolicyError(f"must take as many games, from 1 to {_MOST_ROWS}, by all inputs, got {sorted(firsts)}")
    return rows, {name: TensorSpec(dtype, (rows, *shape)) for name, (dtype, shape) in found.items()}
