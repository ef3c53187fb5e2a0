"""The process that runs an ONNX model, which may be untrusted: it reads and writes JSON objects, one a line.

It imports nothing else of this project, so it starts at once. Once its libraries are loaded, it can open no file.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import sys
from typing import Any

import numpy as np
import onnxruntime


def _open(data: bytes) -> Any:
    """Return a session that runs a model on one thread, node by node as in its file."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL  # others change rounding
    options.add_session_config_entry("session.load_model_format", "ONNX")
    return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])


def _run(session: Any, feeds: dict[str, list[Any]]) -> dict[str, list[Any]]:
    """Return the outputs for some inputs; each array is its type, its shape and its bytes."""
    arrays = {
        name: np.frombuffer(base64.b64decode(data), dtype).reshape(shape)
        for name, (dtype, shape, data) in feeds.items()
    }
    names = [output.name for output in session.get_outputs()]
    return {
        name: [str(array.dtype), array.shape, base64.b64encode(array.tobytes()).decode()]
        for name, array in zip(names, session.run(names, arrays), strict=True)
    }


def _main() -> None:
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # ONNX Runtime prints to stdout
    print(json.dumps({"ready": True}), file=answers, flush=True)
    with contextlib.suppress(ImportError, ValueError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))
    session = None
    for line in sys.stdin:
        message, answer = json.loads(line), dict[str, Any]()
        try:
            if session is None:
                session = _open(base64.b64decode(message["model"]))
                answer = {"inputs": [[one.name, one.type, one.shape] for one in session.get_inputs()]}
            else:
                answer = {"outputs": _run(session, message)}
        except Exception as error:  # ONNX Runtime has classes of its own, which are not public
            answer = {"error": (str(error).strip().splitlines() or [repr(error)])[0][:300]}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    _main()
