"""What a model may not be, and that a process that tries it dies in its place."""

from __future__ import annotations

import copy
import json
import pickle
import subprocess
import sys

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from swarm_pz.policies import onnx_checks
from swarm_pz.policies.onnx_checks import ModelError, Network, TensorSpec, examine, inspect
from tests.policies.onnx_of_tests import build, doubler, follower, weights

node = helper.make_node
IDENTITY = [node("Identity", ["x"], ["y"])]


def with_functions():
    function = helper.make_function(
        "own", "Twice", ["a"], ["b"], [node("Add", ["a", "a"], ["b"])], [helper.make_opsetid("", 18)]
    )
    return build(
        [node("Twice", ["x"], ["y"], domain="own")],
        [("x", 1, [8, 3])],
        [("y", 1, [8, 3])],
        functions=[function],
    )


def with_branches():
    branch = helper.make_graph(
        [node("Identity", ["x"], ["y"])], "branch", [], [helper.make_tensor_value_info("y", 1, None)]
    )
    return doubler([node("If", ["yes"], ["y"], then_branch=branch, else_branch=branch)], [weights("yes", True, bool)])


def with_loop():
    body = helper.make_graph(
        [node("Identity", ["on"], ["on_"]), node("Add", ["v", "v"], ["v_"])],
        "body",
        [
            helper.make_tensor_value_info("i", 7, []),
            helper.make_tensor_value_info("on", 9, []),
            helper.make_tensor_value_info("v", 1, [8, 3]),
        ],
        [helper.make_tensor_value_info("on_", 9, []), helper.make_tensor_value_info("v_", 1, [8, 3])],
    )
    return doubler([node("Loop", ["many", "", "x"], ["y"], body=body)], [weights("many", 10**15, np.int64)])


def external():
    model = doubler([node("Add", ["x", "w"], ["y"])], [weights("w", [1, 2, 3])])
    tensor = model.graph.initializer[0]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="../../etc/passwd")
    return model


def external_in_a_constant():
    model = doubler([node("Constant", [], ["w"], value=weights("w", [1, 2, 3])), node("Add", ["x", "w"], ["y"])])
    tensor = model.graph.node[0].attribute[0].t
    tensor.external_data.add(key="location", value="weights.bin")
    return model


def lying_weights():
    model = doubler([node("Add", ["x", "w"], ["y"])], [weights("w", [1, 2, 3])])
    model.graph.initializer[0].dims[0] = 10**12
    return model


def other_domain():
    model = doubler([node("Gelu", ["x"], ["y"], domain="com.microsoft")])
    model.opset_import.append(helper.make_opsetid("com.microsoft", 1))
    return model


def expanded(name, *sizes):
    return doubler(
        [node(name, ["x", "by"], ["large"]), node("ReduceMean", ["large", "axes"], ["y"])],
        [weights("by", sizes, np.int64), weights("axes", [0], np.int64)],
    )


def grown():
    """Double a number of numbers again and again."""
    nodes = [node("Concat", [f"v{i}", f"v{i}"], [f"v{i + 1}"], axis=1) for i in range(40)]
    return doubler(
        [node("Identity", ["x"], ["v0"]), *nodes, node("ReduceMean", ["v40", "axes"], ["y"])],
        [weights("axes", [1], np.int64)],
    )


def sized_by_what_it_sees():
    return doubler(
        [
            node("ReduceMax", ["x"], ["most"], keepdims=0),
            node("Cast", ["most"], ["whole"], to=TensorProto.INT64),
            node("Reshape", ["whole", "one"], ["size"]),
            node("ConstantOfShape", ["size"], ["zeros"]),
            node("ReduceSum", ["zeros"], ["sum"], keepdims=0),
            node("Add", ["x", "sum"], ["y"]),
        ],
        [weights("one", [1], np.int64)],
    )


def mixing():
    return doubler(
        [node("ReduceMean", ["x", "axes"], ["mean"]), node("Add", ["x", "mean"], ["y"])],
        [weights("axes", [0], np.int64)],
    )


def long_by_sight(operator="GRU", gates=3):
    """Work through a sequence as far as what it sees says: zeros are done at once."""
    nodes = [
        node("ReduceMax", ["x", "axis"], ["most"], keepdims=0),
        node("Cast", ["most"], ["lengths"], to=TensorProto.INT32),
        node("Expand", ["x", "long"], ["sequence"]),
        node(operator, ["sequence", "w", "r", "", "lengths"], ["", "last"], hidden_size=3),
        node("Squeeze", ["last", "first"], ["y"]),
    ]
    recurrent = [weights(name, np.ones((1, 3 * gates, 3))) for name in ("w", "r")]
    sizes = [weights("axis", [1], np.int64), weights("long", [50, 8, 3], np.int64), weights("first", [0], np.int64)]
    return doubler(nodes, recurrent + sizes)


def changed(change):
    """Return a function that makes a model that does nothing, changed by hand."""

    def make():
        model = doubler(IDENTITY)
        change(model)
        return model

    return make


def of_opset(version):
    return changed(lambda model: setattr(model.opset_import[0], "version", version))


MALICIOUS = {
    "functions": (with_functions, "functions of its own"),
    "branches": (with_branches, "control flow"),
    "loop": (with_loop, "control flow"),
    "external data": (external, "external data"),
    "external data of a constant": (external_in_a_constant, "external data"),
    "lying weights": (lying_weights, "not of the size they say"),
    "custom operators": (other_domain, "operator Gelu of com.microsoft"),
    "NaN weights": (
        lambda: doubler([node("Add", ["x", "w"], ["y"])], [weights("w", [1, np.nan, 3])]),
        "finite weights",
    ),
    "infinite attribute": (lambda: doubler([node("LeakyRelu", ["x"], ["y"], alpha=float("inf"))]), "finite numbers"),
    "NaN answers": (lambda: doubler([node("Log", ["x"], ["y"])]), "answered NaN or infinity"),
    "Expand": (lambda: expanded("Expand", 10**9, 8, 3), "numbers in one run"),
    "Tile": (lambda: expanded("Tile", 10**6, 10**6), "numbers in one run"),
    "Concat": (grown, "numbers in one run"),
    "sizes by sight": (sized_by_what_it_sees, "not known before"),
    "chance": (lambda: doubler([node("RandomNormalLike", ["x"], ["y"])]), "operator RandomNormalLike"),
    "mixed games": (mixing, "keep games apart"),
    "those before": (  # the first game sees itself alone
        lambda: doubler([node("CumSum", ["x", "axis"], ["y"])], [weights("axis", 0, np.int64)]),
        "keep games apart",
    ),
    "time by sight": (long_by_sight, "GRU work as long as 'lengths' says"),
    "time of an LSTM by sight": (lambda: long_by_sight("LSTM", 4), "LSTM work as long as 'lengths' says"),
    "no opset": (changed(lambda model: model.ClearField("opset_import")), "one opset"),
    "old opset": (of_opset(7), "one opset"),
    "future opset": (of_opset(99), "one opset"),
    "training": (changed(lambda model: model.training_info.add()), "holds a training"),
    "sparse": (changed(lambda model: model.graph.sparse_initializer.add()), "sparse weights"),
    "texts": (lambda: build(IDENTITY, [("x", 8, [8, 3])], [("y", 8, [8, 3])]), "another type"),
    "open sizes": (lambda: build(IDENTITY, [("x", 1, [8, "n"])], [("y", 1, [8, "n"])]), "fix its shape"),
    "no games": (lambda: doubler([node("ReduceMean", ["x"], ["y"], keepdims=0)], shape=()), "must answer 8 games"),
    "many games": (lambda: doubler(IDENTITY, games=10**6), "as many games"),
    "games that differ": (
        lambda: build([node("MatMul", ["z", "x"], ["y"])], [("x", 1, [3, 3]), ("z", 1, [8, 3])], [("y", 1, [8, 3])]),
        "as many games",
    ),
    "unsound": (lambda: doubler([node("Add", ["x", "nothing"], ["y"])]), "no sound ONNX model"),
}


@pytest.mark.parametrize("name", MALICIOUS)
def test_a_malicious_or_broken_model_is_refused_by_name(name):
    make, message = MALICIOUS[name]
    with pytest.raises(ModelError, match=message):
        inspect(make().SerializeToString())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"\x3a\x00" * (onnx_checks.MOST_FIELDS + 1), "parts"),  # each an empty graph
        (b"\x3a" + b"\xff" * 9 + b"\x01", "torn"),
        (b"\x3b", "no ONNX file"),  # a group, which ONNX has none of
        (b"not a model", "torn|no ONNX file"),
        (b"", "one opset"),
    ],
)
def test_what_is_no_model_is_refused_before_it_is_parsed(data, message):
    with pytest.raises(ModelError, match=message):
        inspect(data)


def test_nodes_and_weights_are_counted_together_and_large_files_are_refused_unread(monkeypatch):
    nodes = [node("Add", ["x", "a"], ["b"]), node("Add", ["b", "c"], ["d"]), node("Add", ["d", "e"], ["y"])]
    data = doubler(nodes, [weights(name, [1, 2, 3]) for name in "ace"]).SerializeToString()
    for name, most, message in (("MOST_BYTES", 30, "30 bytes or fewer, got 36"), ("MOST_NODES", 2, "2 nodes or fewer")):
        monkeypatch.setattr(onnx_checks, name, most)
        with pytest.raises(ModelError, match=message):
            inspect(data)
    with pytest.raises(ModelError, match="too large: expected 30 bytes or fewer"):
        examine(data)


def test_a_model_is_tried_in_a_process_of_its_own_once():
    data = follower().SerializeToString()
    signature = examine(data)
    assert signature.rows == onnx_checks.ROWS
    assert signature.inputs == {"seen": TensorSpec("uint8", (8, 1, 5, 5))}
    assert signature.outputs == {"answer": TensorSpec("float32", (8, 5, 5))}
    assert examine(data) is signature
    with pytest.raises(ModelError, match="control flow"):
        examine(with_loop().SerializeToString())


def test_a_model_that_takes_the_process_down_is_refused_and_this_one_goes_on(monkeypatch):
    def killed(words, **options):
        return run([sys.executable, "-c", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"], **options)

    def endless(words, **options):
        raise subprocess.TimeoutExpired(words, options["timeout"])

    run = subprocess.run
    for stand_in, message in ((killed, "ended the process that tried it"), (endless, "takes more than")):
        monkeypatch.setattr(subprocess, "run", stand_in)
        with pytest.raises(ModelError, match=message):
            examine(doubler([node("Neg", ["x"], ["y"])]).SerializeToString())


def test_sequences_of_a_fixed_length_play():
    model = long_by_sight()
    del model.graph.node[:2]
    model.graph.initializer.append(weights("lengths", [50] * 8, np.int32))
    assert inspect(model.SerializeToString()).outputs == {"y": TensorSpec("float32", (8, 3))}
    model.graph.node[1].input[4] = ""
    assert inspect(model.SerializeToString()).outputs == {"y": TensorSpec("float32", (8, 3))}


@pytest.mark.parametrize("games", [1, 3])
def test_games_that_a_file_fixes_are_shown_at_once(games):
    assert inspect(follower(games=games).SerializeToString()).rows == games


def test_shapes_that_follow_from_those_of_inputs_are_known_before():
    nodes = [
        node("Shape", ["x"], ["shape"]),
        node("Slice", ["shape", "zero", "one"], ["games"]),
        node("Concat", ["games", "rest"], ["sizes"], axis=0),
        node("Reshape", ["x", "sizes"], ["y"]),
    ]
    numbers = [weights(name, [value], np.int64) for name, value in (("zero", 0), ("one", 1), ("rest", -1))]
    model = build(nodes, [("x", 1, ["n", 3])], [("y", 1, ["n", 3])], numbers)
    assert inspect(model.SerializeToString()).outputs["y"].shape == (8, 3)


def test_a_network_is_copied_and_sent_and_answers_the_same():
    network = Network(follower().SerializeToString())
    shown = {"seen": np.arange(8 * 25, dtype=np.uint8).reshape(8, 1, 5, 5)}
    for other in (copy.deepcopy(network), pickle.loads(pickle.dumps(network))):  # noqa: S301
        np.testing.assert_array_equal(other.run(shown)["answer"], network.run(shown)["answer"])
    with pytest.raises(ModelError, match="failed"):
        network.run({"seen": np.zeros((8, 2), np.uint8)})


def test_operators_that_may_play_are_operators_of_onnx():
    known = {schema.name for schema in onnx.defs.get_all_schemas() if schema.domain == ""}
    assert known >= onnx_checks.OPERATORS
    assert not onnx_checks.OPERATORS & {"If", "Loop", "Scan", "SequenceMap", "RandomNormal", "Bernoulli", "Multinomial"}


def test_the_program_says_what_it_found_in_one_line():
    data = doubler(IDENTITY).SerializeToString()
    done = subprocess.run([sys.executable, "-P", onnx_checks.__file__], input=data, capture_output=True, check=True)  # noqa: S603
    assert json.loads(done.stdout) == {"rows": 8, "tensors": [{"x": ["float32", [8, 3]]}, {"y": ["float32", [8, 3]]}]}
