"""What a neural network of anybody's in an ONNX file may hold, and a process that tries it for the first time.

A file from elsewhere may ask for any amount of work. So it is first opened by a process of its own, with little memory
and time, which answers what the file takes and gives, or why it is refused. This module is that process's program, too,
and imports nothing else of this project, so that it begins at once.

The sizes in a model must follow from the shapes of its inputs alone: then a trial with zeros takes the time and memory
of every game.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MOST_BYTES = 64 * 2**20
"""Of a file."""
MOST_FIELDS = 200_000
"""Of the file's structure, weights aside: each takes more memory than bytes."""
MOST_NODES = 5_000
MOST_VALUES = 2**26
"""Numbers that all nodes together may make in one run."""
MOST_ROWS = 256
SECONDS, MEMORY = 30, 4 * 2**30
"""What the process that tries a model may take."""
_HANGS_S = 20 * SECONDS
"""Seconds after which that process is killed, however busy the machine; it limits its own work by itself."""
ROWS = 8
"""Games that are shown at once to a model that takes any number."""
DOMAINS = ("", "ai.onnx")
OPSETS = range(13, 27)
_DTYPES = {
    1: "float32",
    2: "uint8",
    3: "int8",
    4: "uint16",
    5: "int16",
    6: "int32",
    7: "int64",
    9: "bool",
    10: "float16",
    11: "float64",
    12: "uint32",
    13: "uint64",
}
"""By their numbers in ONNX."""
OPERATORS = frozenset(
    """Abs Acos Acosh Add And ArgMax ArgMin Asin Asinh Atan Atanh Attention AveragePool BatchNormalization Cast CastLike
    Ceil Celu Clip Concat Constant ConstantOfShape Conv ConvTranspose Cos Cosh CumSum DepthToSpace Div Einsum Elu Equal
    Erf Exp Expand EyeLike Flatten Floor GRU Gather GatherElements GatherND Gelu Gemm GlobalAveragePool GlobalMaxPool
    Greater GreaterOrEqual GroupNormalization HardSigmoid HardSwish Hardmax Identity InstanceNormalization IsInf IsNaN
    LRN LSTM LayerNormalization LeakyRelu Less LessOrEqual Log LogSoftmax LpNormalization MatMul Max MaxPool Mean
    MeanVarianceNormalization Min Mish Mod Mul Neg Not OneHot Or PRelu Pad Pow RMSNormalization RNN Range Reciprocal
    ReduceL1 ReduceL2 ReduceLogSum ReduceLogSumExp ReduceMax ReduceMean ReduceMin ReduceProd ReduceSum ReduceSumSquare
    Relu Reshape Resize Round ScatterElements ScatterND Selu Shape Sigmoid Sign Sin Sinh Size Slice Softmax Softplus
    Softsign SpaceToDepth Split Sqrt Squeeze Sub Sum Swish Tan Tanh ThresholdedRelu Tile TopK Transpose Trilu Unsqueeze
    Where Xor""".split()  # noqa: SIM905  (a hundred lines, else)
)
"""What a model may be made of: arithmetic of known cost. No control flow, no chance, no texts, no files."""
_LENGTHS = {"RNN": 4, "GRU": 4, "LSTM": 4, "Attention": 6}
"""The input of an operator that says how much of its other inputs counts."""

Arrays = dict[str, NDArray[Any]]


class ModelError(ValueError):
    """A model may not play; the message says why, in words that follow its name. All functions here raise it."""


class TensorSpec(NamedTuple):
    """An input or an output of a model: its numbers, and its shape for `Signature.rows` games."""

    dtype: str
    shape: tuple[int, ...]


class Signature(NamedTuple):
    """What a model takes and gives, `rows` games at once."""

    rows: int
    inputs: dict[str, TensorSpec]
    outputs: dict[str, TensorSpec]


def open_session(data: bytes) -> Any:
    """Return what runs a model: on one thread, as its file says it, with nothing rearranged."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.use_deterministic_compute = True
    options.log_severity_level = 4
    # Rearranging runs parts of the model before anybody asked, and takes liberties with rounding.
    options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_DISABLE_ALL
    options.add_session_config_entry("session.load_model_format", "ONNX")
    try:
        return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # its errors are classes of their own, which are not public
        raise ModelError(f"cannot be opened by ONNX Runtime: {first_line(error)}") from error


def run_session(session: Any, feeds: Arrays) -> Arrays:
    """Return all outputs for some inputs."""
    names = [output.name for output in session.get_outputs()]
    try:
        answers = dict(zip(names, session.run(names, feeds), strict=True))
    except Exception as error:
        raise ModelError(f"failed: {first_line(error)}") from error
    for name, values in answers.items():
        if not np.isfinite(values).all():
            raise ModelError(f"answered NaN or infinity by its output {name!r}")
    return answers


def first_line(error: Exception) -> str:
    """Return the beginning of what an error says."""
    return (str(error).strip().splitlines() or [repr(error)])[0][:300]


def check_structure(data: bytes) -> None:
    """Walk the file's fields without reading them: a file of few bytes could ask for much memory."""
    import onnx

    parts, fields = [(0, len(data), onnx.ModelProto.DESCRIPTOR)], 0
    while parts:
        place, end, message = parts.pop()
        while place < end:
            fields += 1
            if fields > MOST_FIELDS:
                raise ModelError(f"is of more than {MOST_FIELDS:,} parts")
            tag, place = _number(data, place, end)
            kind, field = tag & 7, message.fields_by_number.get(tag >> 3)
            if kind == 0:
                _, place = _number(data, place, end)
            elif kind == 2:
                size, place = _number(data, place, end)
                if field is not None and field.message_type is not None:
                    parts.append((place, place + size, field.message_type))
                place += size
            elif kind in (1, 5):
                place += 8 if kind == 1 else 4
            else:
                raise ModelError("is no ONNX file")
            if place > end:
                raise ModelError("is torn, or no ONNX file")


def _number(data: bytes, place: int, end: int) -> tuple[int, int]:
    """Return the whole number that begins at a place, and where it ends."""
    value = 0
    for shift in range(0, 70, 7):
        if place >= end:
            break
        byte = data[place]
        place += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, place
    raise ModelError("is torn, or no ONNX file")


def parts_of(message: Any) -> Iterator[Any]:
    """Yield a message and all that it holds."""
    rest = [message]
    while rest:
        yield (part := rest.pop())
        for field, value in part.ListFields():
            if field.message_type is not None:
                rest.extend([value] if hasattr(value, "ListFields") else value)


def check_contents(model: Any) -> None:
    """Refuse what a model may not hold, by its name."""
    opsets = [entry.version for entry in model.opset_import if entry.domain in DOMAINS]
    if len(opsets) != 1 or opsets[0] not in OPSETS:
        raise ModelError(f"must be of one opset from {OPSETS[0]} to {OPSETS[-1]}, got {opsets}: export it for another")
    if model.functions:
        raise ModelError(f"brings functions of its own, such as {model.functions[0].name!r}: export it without")
    if model.training_info:
        raise ModelError("holds a training: export it for inference")
    if len(model.graph.node) > MOST_NODES:
        raise ModelError(f"must have {MOST_NODES:,} nodes or fewer, got {len(model.graph.node):,}")
    _check_lengths(model.graph)
    weights = 0
    for part in parts_of(model):
        kind = part.DESCRIPTOR.name
        if kind == "NodeProto":
            if part.domain not in DOMAINS:
                raise ModelError(f"asks for the operator {part.op_type} of {part.domain}: expected those of ai.onnx")
        elif kind == "AttributeProto":
            if part.HasField("g") or part.graphs:
                raise ModelError(f"has control flow (a graph in the attribute {part.name!r}): export it unrolled")
            if not all(map(math.isfinite, (part.f, *part.floats))):
                raise ModelError(f"must hold finite numbers, got NaN or infinity in the attribute {part.name!r}")
        elif kind == "SparseTensorProto":
            raise ModelError("holds sparse weights: export them dense")
        elif kind == "TensorProto":
            weights += _check_tensor(part)
    if weights > MOST_BYTES:
        raise ModelError(f"must have weights of {MOST_BYTES:,} bytes or fewer, got {weights:,}")
    for node in model.graph.node:
        if node.op_type not in OPERATORS:
            raise ModelError(
                f"asks for the operator {node.op_type}, which is none of those that may play: export it for inference, "
                f"without control flow or chance"
            )


def _check_lengths(graph: Any) -> None:
    """Refuse lengths of sequences that a model works out: the trial would be short, and a game long."""
    fixed = {"", *(tensor.name for tensor in graph.initializer)} - {value.name for value in graph.input}
    for node in graph.node:
        place = _LENGTHS.get(node.op_type, len(node.input))
        for name in node.input[place : place + 1]:
            if name not in fixed:
                raise ModelError(f"lets {node.op_type} work as long as {name!r} says: export it for a fixed length")


def _check_tensor(tensor: Any) -> int:
    """Return how many bytes weights take, if they are numbers, finite and here."""
    from onnx import numpy_helper

    name = tensor.name or "without a name"
    if tensor.data_location == tensor.EXTERNAL or tensor.external_data:
        raise ModelError(f"keeps the weights {name!r} in another file (external data): save it as one file")
    if tensor.data_type not in _DTYPES:
        raise ModelError(f"holds values {name!r} of type {tensor.data_type}, which are no numbers of NumPy's")
    try:
        values = numpy_helper.to_array(tensor)
    except Exception as error:
        raise ModelError(f"has weights {name!r} that are not of the size they say: {first_line(error)}") from error
    if not np.isfinite(values).all():
        raise ModelError(f"must have finite weights, got NaN or infinity in {name!r}")
    return int(values.nbytes)


def fix_rows(model: Any) -> int:
    """Give the model's inputs a fixed number of games, their first size, and return it."""
    weights = {tensor.name for tensor in model.graph.initializer}
    inputs = [value for value in model.graph.input if value.name not in weights]
    for value in (*inputs, *model.graph.output):
        kind = value.type.tensor_type
        if kind.elem_type not in _DTYPES:
            raise ModelError(f"must take and give numbers, got {value.name!r} of another type")
    firsts = set()
    for value in inputs:
        sizes = value.type.tensor_type.shape.dim
        if not len(sizes) or not all(size.dim_value > 0 for size in sizes[1:]):
            raise ModelError(f"must take inputs of known shapes, the games first, got {value.name!r}: fix its shape")
        firsts.add(sizes[0].dim_value)
    rows = max(firsts - {0}, default=ROWS)
    if not inputs or firsts - {0, rows} or not 0 < rows <= MOST_ROWS:
        raise ModelError(f"must take as many games, from 1 to {MOST_ROWS}, by all inputs, got {sorted(firsts)}")
    for value in inputs:
        value.type.tensor_type.shape.dim[0].dim_value = rows
    return rows


def infer(model: Any) -> dict[str, TensorSpec]:
    """Return what each node makes, told before it is run."""
    import onnx

    del model.graph.value_info[:]  # what a file claims of its values is not asked
    try:
        onnx.checker.check_model(model)
        for value in model.graph.output:
            value.type.tensor_type.ClearField("shape")
        inferred = onnx.shape_inference.infer_shapes(model, check_type=True, strict_mode=True, data_prop=True)
    except Exception as error:
        raise ModelError(f"is no sound ONNX model: {first_line(error)}") from error
    known = {value.name: value.type.tensor_type for value in (*inferred.graph.value_info, *inferred.graph.output)}
    made, numbers = {}, 0
    for node in inferred.graph.node:
        for name in filter(None, node.output):
            kind = known.get(name)
            sizes = [] if kind is None else kind.shape.dim
            if kind is None or not kind.HasField("shape") or not all(size.HasField("dim_value") for size in sizes):
                raise ModelError(
                    f"makes {name!r} by {node.op_type} of a size that is not known before: export it with fixed shapes"
                )
            made[name] = TensorSpec(_DTYPES.get(kind.elem_type, "?"), tuple(size.dim_value for size in sizes))
            numbers += math.prod(made[name].shape)
            if numbers > MOST_VALUES:
                raise ModelError(f"makes more than {MOST_VALUES:,} numbers in one run, by {node.op_type} and before")
    return made


def inspect(data: bytes) -> Signature:
    """Check and try a model in this process; return what it takes and gives."""
    import onnx

    check_structure(data)
    try:
        model = onnx.ModelProto.FromString(data)
    except Exception as error:
        raise ModelError(f"is torn, or no ONNX file: {first_line(error)}") from error
    check_contents(model)
    rows = fix_rows(model)
    made = infer(model)
    weights = {tensor.name for tensor in model.graph.initializer}
    inputs = {
        value.name: TensorSpec(
            _DTYPES[value.type.tensor_type.elem_type],
            tuple(size.dim_value for size in value.type.tensor_type.shape.dim),
        )
        for value in model.graph.input
        if value.name not in weights
    }
    outputs = {value.name: made.get(value.name) for value in model.graph.output}
    for name, spec in outputs.items():
        if spec is None or spec.shape[:1] != (rows,):
            shape = None if spec is None else spec.shape
            raise ModelError(f"must answer {rows} games by {name!r} if it is shown {rows}, got the shape {shape}")
    signature = Signature(rows, inputs, outputs)  # type: ignore[arg-type]
    _try(open_session(data), signature)
    return signature


def _try(session: Any, signature: Signature) -> None:
    """Run a model on zeros and on noise: its answers must be finite, the same again, and each of one game alone."""
    zeros = {name: np.zeros(spec.shape, spec.dtype) for name, spec in signature.inputs.items()}
    of_zeros = run_session(session, zeros)
    for name, spec in signature.outputs.items():
        if of_zeros[name].shape != spec.shape or of_zeros[name].dtype != spec.dtype:
            raise ModelError(f"answers {name!r} of another shape than it says: {of_zeros[name].shape}, {spec.shape}")
    random = np.random.default_rng(0)
    noise = {
        name: (random.random(spec.shape) * (256 if spec.dtype == "uint8" else 2 if "int" in spec.dtype else 1)).astype(
            spec.dtype
        )
        for name, spec in signature.inputs.items()
    }
    answers = run_session(session, noise)
    again = run_session(session, noise)
    if any((answers[name] != again[name]).any() for name in answers):
        raise ModelError("answers the same twice in two ways")
    if signature.rows == 1:
        return
    for name in noise:
        noise[name][1:] = 0
    alone = run_session(session, noise)
    for name, values in answers.items():
        values[1:] = of_zeros[name][1:]
        if not np.allclose(values, alone[name], rtol=1e-3, atol=1e-3):
            raise ModelError(f"answers one game by what it sees of others, by its output {name!r}: keep games apart")


_known: dict[str, Signature | str] = {}
"""What was found, by digests: each model is tried once."""


def examine(data: bytes) -> Signature:
    """Check and try a model in a process of its own; return what it takes and gives."""
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
    words = [sys.executable, "-P", __file__]
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
    specs = [
        {name: TensorSpec(dtype, tuple(shape)) for name, (dtype, shape) in part.items()} for part in said["tensors"]
    ]
    return Signature(said["rows"], *specs)


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
        self._session = open_session(data)

    def __getstate__(self) -> dict[str, Any]:
        return {"data": self.data}  # a session can be neither copied nor sent

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["data"])  # type: ignore[misc]

    def run(self, feeds: Arrays) -> Arrays:
        """Return all outputs of `Signature.rows` games."""
        return run_session(self._session, feeds)


def _main() -> None:
    with contextlib.suppress(ImportError):
        import resource  # not on every system

        # Libraries are loaded before the seconds begin, which are the model's: a cold machine takes long for them.
        import onnx  # noqa: F401
        import onnxruntime  # noqa: F401

        seconds = math.ceil(time.process_time()) + SECONDS
        for what, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, seconds)):
            with contextlib.suppress(ValueError, OSError):
                resource.setrlimit(what, (most, most))
    try:
        signature = inspect(sys.stdin.buffer.read(MOST_BYTES + 1))
        said: dict[str, Any] = {"rows": signature.rows, "tensors": [signature.inputs, signature.outputs]}
    except ModelError as error:
        said = {"refused": str(error)}
    print(json.dumps(said))  # noqa: T201


if __name__ == "__main__":
    _main()
