"""An untrusted model reads no file, can end only its own process, and must keep games apart."""

from __future__ import annotations

import copy
import os
import pickle
import re
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from swarm_pz.errors import CheckpointError, ForfeitError
from swarm_pz.policies import onnx_network
from swarm_pz.policies.onnx_network import MOST_BYTES, Network, TensorSpec
from swarm_pz.policy import program
from tests.policies.onnx_of_tests import follower, model

LOOP = """y = Loop(many, , x) <body = turn (int64 i, bool on, float[8,3] v) => (bool on_, float[8,3] v_)
    { on_ = Identity(on) v_ = Add(v, v) }>"""
EXPAND = "large = Expand(x, by) y = ReduceMean<keepdims = 0>(large, axes)"
BAD = {
    "external data": (model("y = Add(x, w)", 'float[3] w = ["location": "/etc/hostname"]'), "external data"),
    "a loop without end": (model(LOOP, "int64 many = {1000000000000000}"), "within 2 s"),
    "too much memory": (
        model(EXPAND, "int64[3] by = {1000000000,8,3}, int64[1] axes = {0}"),
        "cannot run: .*(alloc|memory)|ended",
    ),
    "NaN answers": (model("y = Log(x)"), "NaN or infinity"),
    "chance": (model("r = RandomNormalLike(x) y = Add(r, x)"), "twice in two ways"),
    "mixed games": (model("m = ReduceMean(x, axes) y = Add(x, m)", "int64[1] axes = {0}"), "keep games apart"),
    "many games": (model("y = Identity(x)", takes="float[257,3] x", gives="float[257,3] y"), "as many games"),
    "an answer too long": (model(EXPAND.replace("ReduceMean<keepdims = 0>(large, axes)", "Identity(large)"),
        "int64[2] by = {8,99999}", takes="float[8,1] x", gives="float[8,99999] y"), "bytes"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_a_malicious_or_broken_model_is_refused_with_the_reason(what, monkeypatch):
    made, message = BAD[what]
    if "2 s" in message:
        monkeypatch.setattr(program, "SECONDS", 2.0)
    with pytest.raises(CheckpointError, match=message):
        Network(made.SerializeToString())


@pytest.mark.parametrize("data", [b"not a model", b"\x3a" + b"\xff" * 9 + b"\x01", bytes(MOST_BYTES + 1)])
def test_no_model_is_refused(data):
    with pytest.raises(CheckpointError, match=r"cannot open|too large"):
        Network(data)


def test_a_model_that_hides_that_it_wants_a_file_gets_none(tmp_path, monkeypatch):
    monkeypatch.setattr(onnx_network, "_EXTERNAL", b"spelt in another way")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "w").write_bytes(np.ones(3, np.float32).tobytes())
    with pytest.raises(CheckpointError, match="cannot open"):
        Network(model("y = Add(x, w)", 'float[3] w = ["location": "w"]').SerializeToString())


def test_a_network_is_limited_and_copied_and_sent_and_starts_again_after_its_process_was_killed():
    network = Network(follower())
    if sys.platform == "linux":
        limits = Path(f"/proc/{network._pipe._process.pid}/limits").read_text()
        assert re.search(r"^Max open files +0 +0 ", limits, re.MULTILINE)
        assert re.search(rf"^Max data size +{program.MEMORY_BYTES} ", limits, re.MULTILINE)
    signature = network.signature
    assert signature.rows == 8
    assert signature.inputs == {"seen": TensorSpec("uint8", (8, 1, 5, 5))}
    assert signature.outputs == {"answer": TensorSpec("float32", (8, 5, 5))}
    shown = {"seen": np.arange(8 * 25, dtype=np.uint8).reshape(8, 1, 5, 5)}
    expected = network.run(shown)["answer"]
    for other in (copy.deepcopy(network), pickle.loads(pickle.dumps(network))):  # noqa: S301
        np.testing.assert_array_equal(other.run(shown)["answer"], expected)
    os.kill(network._pipe._process.pid, signal.SIGKILL)
    with pytest.raises(ForfeitError, match="must run, but ended"):
        network.run(shown)
    network.restart()
    np.testing.assert_array_equal(network.run(shown)["answer"], expected)


def test_games_that_a_file_fixes_are_shown_at_once():
    assert Network(follower(3)).signature.rows == 3
