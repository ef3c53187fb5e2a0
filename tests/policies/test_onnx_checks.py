"""What a model may not be, and that a process that tries it dies in its place."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys

import numpy as np
import onnx
import pytest

from swarm_pz.policies import onnx_checks
from swarm_pz.policies.onnx_checks import ModelError, Network, TensorSpec, examine, inspect
from tests.policies.onnx_of_tests import follower, model

IDENTITY = "y = Identity(x)"
EXPANDED = "large = Expand(x, by) y = ReduceMean(large, axes)"
LOOP = """y = Loop(many, , x) <body = turn (int64 i, bool on, float[8,3] v) => (bool on_, float[8,3] v_)
    { on_ = Identity(on) v_ = Add(v, v) }>"""


def recurrent(lengths="lengths = Cast<to = 6>(most)", weights="", by="lengths"):
    """Work through a sequence as far as what it sees says: zeros are done at once."""
    ones = ",".join(["1"] * 27)
    return model(
        f"""most = ReduceMax<keepdims = 0>(x, axis) {lengths} sequence = Expand(x, long)
        , last = GRU<hidden_size = 3>(sequence, w, r, , {by}) y = Squeeze(last, first)""",
        f"""float[1,9,3] w = {{{ones}}}, float[1,9,3] r = {{{ones}}}, int64[1] axis = {{1}},
        int64[3] long = {{50,8,3}}, int64[1] first = {{0}}{weights}""",
    )


def changed(change):
    made = model("y = Add(x, w)", "float[3] w = {1, 2, 3}")
    change(made)
    return made


CONCATENATED = " ".join(f"v{i + 1} = Concat<axis = 1>(v{i}, v{i})" for i in range(40))
MALICIOUS = {
    "functions": (
        lambda: model(
            "y = own.Twice(x)",
            opset='"": 18, "own": 1',
            functions='<domain: "own", opset_import: ["": 18]> Twice (a) => (b) { b = Add(a, a) }',
        ),
        "functions of its own",
    ),
    "loop": (lambda: model(LOOP, "int64 many = {1000000000000000}"), "control flow"),
    "external data": (
        lambda: model("y = Add(x, w)", 'float[3] w = ["location": "../../etc/passwd"]'),
        "external data",
    ),
    "external data of a constant": (
        lambda: model('w = Constant<value = float[3] c ["location": "weights.bin"]>() y = Add(x, w)'),
        "external data",
    ),
    "lying weights": (changed, lambda made: made.graph.initializer[0].dims.__setitem__(0, 10**12), "not of the size"),
    "custom operators": (
        lambda: model("y = com.microsoft.Gelu(x)", opset='"": 18, "com.microsoft": 1'),
        "operator Gelu of com.microsoft",
    ),
    "NaN weights": (lambda: model("y = Add(x, w)", "float[3] w = {1, nan, 3}"), "finite weights"),
    "infinite attribute": (lambda: model("y = LeakyRelu<alpha = inf>(x)"), "finite numbers"),
    "NaN answers": (lambda: model("y = Log(x)"), "answered NaN or infinity"),
    "Expand": (lambda: model(EXPANDED, "int64[3] by = {1000000000,8,3}, int64[1] axes = {0}"), "numbers in one run"),
    "Concat": (
        lambda: model(f"v0 = Identity(x) {CONCATENATED} y = ReduceMean(v40, axes)", "int64[1] axes = {1}"),
        "numbers in one run",
    ),
    "sizes by sight": (
        lambda: model(
            """most = ReduceMax<keepdims = 0>(x) whole = Cast<to = 7>(most) size = Reshape(whole, one)
            zeros = ConstantOfShape(size) sum = ReduceSum<keepdims = 0>(zeros) y = Add(x, sum)""",
            "int64[1] one = {1}",
        ),
        "not known before",
    ),
    "chance": (lambda: model("y = RandomNormalLike(x)"), "operator RandomNormalLike"),
    "mixed games": (lambda: model("m = ReduceMean(x, axes) y = Add(x, m)", "int64[1] axes = {0}"), "keep games apart"),
    "those before": (lambda: model("y = CumSum(x, axis)", "int64 axis = {0}"), "keep games apart"),
    "time by sight": (recurrent, "GRU work as long as 'lengths' says"),
    "no opset": (lambda: model(IDENTITY, opset=""), "one opset"),
    "future opset": (lambda: model(IDENTITY, opset='"": 99'), "one opset"),
    "training": (changed, lambda made: made.training_info.add(), "holds a training"),
    "sparse": (changed, lambda made: made.graph.sparse_initializer.add(), "sparse weights"),
    "texts": (lambda: model(IDENTITY, takes="string[8,3] x", gives="string[8,3] y"), "another type"),
    "open sizes": (lambda: model(IDENTITY, takes="float[8,n] x", gives="float[8,n] y"), "fix its shape"),
    "no games": (lambda: model("y = ReduceMean<keepdims = 0>(x)", gives="float y"), "must answer 8 games"),
    "many games": (
        lambda: model(IDENTITY, takes="float[1000000,3] x", gives="float[1000000,3] y"),
        "as many games",
    ),
    "games that differ": (
        lambda: model("y = MatMul(z, x)", takes="float[3,3] x, float[8,3] z"),
        "as many games",
    ),
    "unsound": (lambda: model("y = Add(x, nothing)"), "no sound ONNX model"),
}


@pytest.mark.parametrize("name", MALICIOUS)
def test_a_malicious_or_broken_model_is_refused_by_name(name):
    make, *change, message = MALICIOUS[name]
    with pytest.raises(ModelError, match=message):
        inspect(make(*change).SerializeToString())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x3a\x00" * 21, "of more than 20 parts"),  # each an empty graph
        (b"\x3a" + b"\xff" * 9 + b"\x01", "torn"),
        (b"\x3b", "no ONNX file"),  # a group, which ONNX has none of
        (b"not a model", "torn|no ONNX file"),
        (b"", "one opset"),
    ],
)
def test_what_is_no_model_is_refused_before_it_is_parsed(monkeypatch, data, message):
    monkeypatch.setattr(onnx_checks, "MOST_FIELDS", 20)
    with pytest.raises(ModelError, match=message):
        inspect(data)


def test_nodes_and_weights_are_counted_together_and_large_files_are_refused_unread(monkeypatch):
    weights = ", ".join(f"float[3] {name} = {{1, 2, 3}}" for name in "ace")
    data = model("b = Add(x, a) d = Add(b, c) y = Add(d, e)", weights).SerializeToString()
    for name, most, message in (("MOST_BYTES", 30, "30 bytes or fewer, got 36"), ("MOST_NODES", 2, "2 nodes or fewer")):
        monkeypatch.setattr(onnx_checks, name, most)
        with pytest.raises(ModelError, match=message):
            inspect(data)
    with pytest.raises(ModelError, match="too large"):
        examine(data)


def test_a_model_is_tried_in_a_process_of_its_own_once_and_a_network_is_copied_and_sent(monkeypatch):
    network = Network(follower())
    signature = network.signature
    assert signature.rows == onnx_checks.ROWS
    assert signature.inputs == {"seen": TensorSpec("uint8", (8, 1, 5, 5))}
    assert signature.outputs == {"answer": TensorSpec("float32", (8, 5, 5))}
    with pytest.raises(ModelError, match="control flow"):
        examine(model(LOOP, "int64 many = {1000000000000000}").SerializeToString())
    monkeypatch.setattr(subprocess, "run", None)
    assert examine(follower()) is signature, "each is tried once"
    shown = {"seen": np.arange(8 * 25, dtype=np.uint8).reshape(8, 1, 5, 5)}
    for other in (copy.deepcopy(network), pickle.loads(pickle.dumps(network))):  # noqa: S301
        np.testing.assert_array_equal(other.run(shown)["answer"], network.run(shown)["answer"])
    with pytest.raises(ModelError, match="failed"):
        network.run({"seen": np.zeros((8, 2), np.uint8)})


def test_a_model_that_takes_the_process_down_is_refused_and_this_one_goes_on(monkeypatch):
    def killed(words, **options):
        return run([sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"], **options)

    def endless(words, **options):
        raise subprocess.TimeoutExpired(words, options["timeout"])

    run = subprocess.run
    for stand_in, message in ((killed, "ended the process that tried it"), (endless, "takes more than")):
        monkeypatch.setattr(subprocess, "run", stand_in)
        with pytest.raises(ModelError, match=message):
            examine(model("y = Neg(x)").SerializeToString())


def test_sequences_of_a_fixed_length_play():
    fifty = ", int32[8] lengths = {50,50,50,50,50,50,50,50}"
    for made in (recurrent(lengths="", weights=fifty), recurrent(lengths="", by="")):
        assert inspect(made.SerializeToString()).outputs == {"y": TensorSpec("float32", (8, 3))}


@pytest.mark.parametrize("games", [1, 3])
def test_games_that_a_file_fixes_are_shown_at_once(games):
    assert inspect(follower(games)).rows == games


def test_shapes_that_follow_from_those_of_inputs_are_known_before():
    made = model(
        """shape = Shape(x) games = Slice(shape, zero, one) sizes = Concat<axis = 0>(games, rest)
        y = Reshape(x, sizes)""",
        "int64[1] zero = {0}, int64[1] one = {1}, int64[1] rest = {-1}",
        "float[n,3] x",
        "float[n,3] y",
    )
    assert inspect(made.SerializeToString()).outputs["y"].shape == (8, 3)


def test_operators_that_may_play_are_operators_of_onnx():
    known = {schema.name for schema in onnx.defs.get_all_schemas() if schema.domain == ""}
    assert known >= onnx_checks.OPERATORS
    assert not onnx_checks.OPERATORS & {"If", "Loop", "Scan", "SequenceMap", "RandomNormal", "Bernoulli", "Multinomial"}
