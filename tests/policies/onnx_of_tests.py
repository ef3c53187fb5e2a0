"""Small models for the tests, made by hand."""

from __future__ import annotations

import numpy as np
from onnx import TensorProto, helper, numpy_helper, parser


def weights(name, values, dtype=np.float32):
    return numpy_helper.from_array(np.asarray(values, dtype), name)


def build(nodes, inputs, outputs, initializers=(), opset=18, **more):
    """Return a model; inputs and outputs are (name, type, shape)."""
    graph = helper.make_graph(
        nodes,
        "model",
        [helper.make_tensor_value_info(*one) for one in inputs],
        [helper.make_tensor_value_info(*one) for one in outputs],
        initializers,
    )
    return helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=9, **more)


def follower(games="games", channels=1, grid=5):
    """Return a model that asks for what one channel of bytes shows, (channels, grid, grid) to log-densities."""
    return build(
        [
            helper.make_node("Cast", ["seen"], ["float"], to=TensorProto.FLOAT),
            helper.make_node("Div", ["float", "full"], ["bright"]),
            helper.make_node("ReduceMean", ["bright", "axis"], ["answer"], keepdims=0),
        ],
        [("seen", TensorProto.UINT8, [games, channels, grid, grid])],
        [("answer", TensorProto.FLOAT, [games, grid, grid])],
        [weights("full", 255.0), weights("axis", [1], np.int64)],
    )


def doubler(nodes, initializers=(), games=8, shape=(3,)):
    """Return a model from x to y, both floats (games, 3)."""
    return build(
        nodes,
        [("x", TensorProto.FLOAT, [games, 3])],
        [("y", TensorProto.FLOAT, [games, *shape])],
        initializers,
    )


def parsed(inputs, outputs, weights_, nodes):
    """Return the bytes of a model written as ONNX's own text, with the games left open as `n`."""
    text = f'<ir_version: 9, opset_import: ["": 18]> model ({inputs}) => ({outputs}) <{weights_}> {{ {nodes} }}'
    return parser.parse_model(text).SerializeToString()
