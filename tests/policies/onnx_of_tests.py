"""Small models, written in ONNX's text format."""

from __future__ import annotations

from onnx import parser


def model(nodes, weights="", takes="float[8,3] x", gives="float[8,3] y", opset='"": 18', functions=""):
    """Return a model."""
    head = f"<ir_version: 9, opset_import: [{opset}]> model ({takes}) => ({gives}) <{weights}>"
    return parser.parse_model(f"{head} {{ {nodes} }} {functions}")


def parsed(takes, gives, weights, nodes):
    """Return the bytes of a model."""
    return model(nodes, weights, takes, gives).SerializeToString()


def follower(games="n"):
    """Return the bytes of a model that returns the brightness of its one channel, from 0 to 1."""
    return parsed(
        f"uint8[{games},1,5,5] seen",
        f"float[{games},5,5] answer",
        "float full = {255}, int64[1] axis = {1}",
        "f = Cast<to = 1>(seen) bright = Div(f, full) answer = ReduceMean<keepdims = 0>(bright, axis)",
    )
