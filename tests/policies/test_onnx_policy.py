"""A folder with a model and a card is a policy like any other; a faulty or forged folder is refused."""

from __future__ import annotations

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import CheckpointError, KindError, PolicyError
from swarm_pz.evaluation.match import play_match
from swarm_pz.policies import onnx_policy
from swarm_pz.policies.onnx_policy import CARD, MODEL, OnnxCard, write
from swarm_pz.policy import load, load_players
from swarm_pz.spaces.densities import named_commands
from tests.policies.onnx_of_tests import follower, parsed

GAME = GameConfig(drones_per_team=2, time_limit=4.0)
SEEN = ObservationConfig(grid=5, channels=("opposing_positions",))
FOLLOWER = OnnxCard(name="follower", origin="by hand", observation=SEEN, action="command", action_cells=5)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    place = tmp_path_factory.mktemp("written") / "follower"
    write(place, follower(), FOLLOWER)
    return place


@pytest.fixture
def folder(written, tmp_path):
    """A copy of the folder, which may be spoilt."""
    return shutil.copytree(written, tmp_path / "follower")


def boards(count):
    return np.random.default_rng(0).integers(0, 256, (count, 1, 5, 5)).astype(np.uint8)


def test_a_folder_is_a_policy_that_answers_as_its_model_does_and_depends_on_nobody_beside(folder):
    policy, images = load(folder, GAME.replace(command_cells=5)), boards(19)
    assert (policy.name, policy.answers, policy.observation) == ("follower", "density", SEEN)
    together = policy.act(images, np.arange(19))
    np.testing.assert_allclose(together, images[:, 0] / 255.0, atol=1e-6)
    for places in ([7], [18, 2], list(range(9))):
        np.testing.assert_array_equal(policy.act(images[places], np.array(places)), together[places])


def test_it_serves_systems_that_take_densities_or_the_one_that_it_was_made_for(folder):
    flocking = GAME.replace(controllers="flocking")
    assert load(folder, flocking).act(boards(1), np.zeros(1, int)).shape == (1, 10, 10)
    with pytest.raises(KindError, match="'density'"):
        load(folder, GAME.replace(controllers="direct"))
    coverage = GAME.replace(controllers="coverage")
    write(folder.parent / "m", follower(), replace(FOLLOWER, system="coverage"), coverage)
    assert load(folder.parent / "m", coverage).answers == "density"
    with pytest.raises(KindError, match="coverage, and not ergodic"):
        load(folder.parent / "m", GAME)


def test_answers_are_clipped_logarithms_of_densities(tmp_path):
    model = parsed(
        "uint8[n,2,5,5] x",
        "float[n,3,3] y",
        """int64[3] axes = {1,2,3}, int64[2] column = {-1,1}, float[1,9] w = {9,0,0,0,0,0,0,0,0},
        int64[3] shape = {-1,3,3}""",
        """f = Cast<to = 1>(x) m = ReduceMean<keepdims = 0>(f, axes) c = Reshape(m, column) flat = MatMul(c, w)
        y = Reshape(flat, shape)""",
    )
    observation = ObservationConfig(grid=5, channels=("own_positions", "time_left"))
    write(tmp_path / "m", model, OnnxCard(name="m", observation=observation, action_cells=3))
    answered = load(tmp_path / "m", GAME).act(np.full((2, 2, 5, 5), 255, np.uint8), np.arange(2))
    assert answered[0, 0, 0] == answered.max() == 1.0  # 9 times a mean of 255 is clipped to 1
    assert answered[0, 9, 9] == pytest.approx(np.exp(-4.0))


@pytest.mark.parametrize(
    ("output", "last"),
    [("float[n,57] values", ""), ("int64[n] number", "number = ArgMax<axis = 1, keepdims = 0>(values)")],
)
def test_discrete_answers_are_numbers_of_commands_or_what_each_is_worth(tmp_path, output, last):
    model = parsed(
        "uint8[n,1,5,5] x",
        output,
        "int64[1] from = {0}, int64[1] to = {57}, int64[1] axis = {1}",
        f"""f = Cast<to = 1>(x) flat = Flatten(f) wide = Concat<axis = 1>(flat, flat, flat)
        values = Slice(wide, from, to, axis) {last}""",
    )
    write(tmp_path / "m", model, OnnxCard(name="m", observation=SEEN, action="discrete"))
    images = np.zeros((2, 1, 5, 5), np.uint8)
    images[0, 0, 0, 3] = images[1, 0, 0, 1] = 200
    answered = load(tmp_path / "m", GAME).act(images, np.arange(2))
    np.testing.assert_array_equal(answered, named_commands(10)[[3, 1]])


def test_lists_of_drones_and_commands_of_other_systems_play(tmp_path):
    lists = parsed(
        "float[n,4,2] own_positions",
        "float[n,2,2] y",
        "int64[1] axis = {1}, float[2,4] w = {1,0,0,0, 0,1,0,0}, int64[3] shape = {-1,2,2}",
        "middle = ReduceMean<keepdims = 0>(own_positions, axis) flat = MatMul(middle, w) y = Reshape(flat, shape)",
    )
    rows = parsed(
        "float[n,4,5] x",
        "float[n,4,2] y",
        "int64[1] from = {0}, int64[1] to = {2}, int64[1] axis = {2}",
        "places = Slice(x, from, to, axis) y = Neg(places)",
    )
    observation, direct = ObservationConfig(kind="entities"), GAME.replace(controllers="direct")
    card = OnnxCard(name="lists", observation=observation, action="command", action_cells=2)
    write(tmp_path / "lists", lists, card, GAME)
    card = OnnxCard(name="rows", answers="accelerations", system="direct", observation=ObservationConfig(kind="drones"))
    write(tmp_path / "rows", rows, card, direct)
    for name, game in (("lists", GAME), ("rows", direct)):
        players = load_players(str(tmp_path / name), str(tmp_path / name), game)
        assert len(play_match(*players, games=2, config=game).games) == 2
    with pytest.raises(CheckpointError, match=r"observation float32 \(8, 6, 5\), the model takes x"):
        load(tmp_path / "rows", direct.replace(drones_per_team=3))


def test_what_a_model_remembers_belongs_to_one_game(tmp_path):
    model = parsed(  # its output grows by 0.1 at every step of a game
        "uint8[n,1,5,5] x, float[n,1] memory",
        "float[n,2,2] y, float[n,1] remembered",
        """int64[3] axes = {1,2,3}, int64[2] column = {-1,1}, float[1] zero = {0}, float[1] tenth = {0.1},
        float[1,4] w = {1,1,1,1}, int64[3] shape = {-1,2,2}""",
        """f = Cast<to = 1>(x) most = ReduceMax<keepdims = 0>(f, axes) c = Reshape(most, column) nothing = Mul(c, zero)
        more = Add(memory, tenth) remembered = Add(more, nothing) flat = MatMul(remembered, w)
        y = Reshape(flat, shape)""",
    )
    state = {"memory": "remembered"}
    card = OnnxCard(name="m", observation=SEEN, action="command", action_cells=2, state=state)
    write(tmp_path / "m", model, card)
    policy = load(tmp_path / "m", GAME)

    def answers(*rows):
        return policy.act(boards(len(rows)), np.array(rows))[:, 0, 0].round(3).tolist()

    policy.reset([0, 1], np.array([5, 20]))
    assert [answers(5, 20), answers(5), answers(20, 5)] == [[0.1, 0.1], [0.2], [0.2, 0.3]]
    policy.reset([2], np.array([5]))
    assert answers(5, 20) == [0.1, 0.3]


def link(folder):
    (folder / MODEL).rename(folder.parent / "elsewhere")
    (folder / MODEL).symlink_to(folder.parent / "elsewhere")


def pipe(folder):
    (folder / MODEL).unlink()
    os.mkfifo(folder / MODEL)


def put(name, content):
    return lambda folder: (folder / name).write_bytes(content)


def say(*, is_signed=False, **fields):
    """Change fields of a card by hand; with `is_signed`, renew its digest, as a forger would."""

    def change(folder):
        content = json.loads((folder / CARD).read_text()) | fields
        if is_signed:
            card = OnnxCard.from_dict({name: content[name] for name in content if name not in ("format", "digest")})
            content["digest"] = onnx_policy.digest_of(card, (folder / MODEL).read_bytes())
        (folder / CARD).write_text(json.dumps({name: value for name, value in content.items() if value is not ...}))

    return change


LIES = {
    "a model of another name": (lambda folder: (folder / MODEL).rename(folder / "model.onnx"), "model.onnx"),
    "no digest": (say(digest=...), "was changed"),
    "words for cells": (say(action_cells="ten"), r"card.action_cells must be .* in \[2, 50\] or None, got 'ten'"),
    "a changed model": (
        lambda folder: (folder / MODEL).write_bytes((folder / MODEL).read_bytes() + b"\x32\x01x"),
        "was changed",
    ),
    "a changed card": (say(origin="by us"), "was changed"),
    "a linked model": (link, "got a link"),
    "a sparse file of 2 GB": (lambda folder: os.truncate(folder / MODEL, 2**31), "too large"),
    "a pipe": (pipe, "a regular file"),
    "two policies": (put("policy.safetensors", b""), "holds two policies"),
    "a large card": (put(CARD, b" " * 10**6), "too large"),
    "a missing card": (lambda folder: (folder / CARD).unlink(), "has no policy.json"),
    "no JSON": (put(CARD, b"{"), "is no card"),
    "a deep card": (put(CARD, b"[" * 60000), "is no card"),
    "a list": (put(CARD, b"[]"), "is no card"),
    "another format": (say(format="onnx-2"), "of format 'onnx-1'"),
    "an unknown field": (say(chanels=[]), "chanels"),
    "a wrong grid": (
        say(is_signed=True, observation={"grid": 10, "channels": ["own_positions"]}),
        r"observation uint8 \(8, 1, 10, 10\), the model takes seen",
    ),
    "wrong answers": (say(is_signed=True, action_cells=4), r"fractions \(8, 4, 4\)"),
    "discrete answers": (say(is_signed=True, action="discrete", action_cells=None), "whole numbers"),
    "no memory": (say(is_signed=True, state={"memory": "next"}), "the inputs of its state"),
    "a wrong memory": (say(is_signed=True, state={"seen": "answer"}), "'answer' becomes 'seen'"),
}


@pytest.mark.parametrize("lie", LIES)
def test_a_folder_that_lies_is_refused_by_name(folder, lie):
    make, message = LIES[lie]
    make(folder)
    with pytest.raises(CheckpointError, match=message):
        load(folder, GAME)


def test_nan_in_a_game_is_the_policys_fault(tmp_path):
    model = parsed(
        "uint8[1,1,5,5] x",
        "float[1,5,5] y",
        "float[1] limit = {254.5}, int64[1] axis = {1}",
        "f = Cast<to = 1>(x) left = Sub(limit, f) root = Sqrt(left) y = ReduceMean<keepdims = 0>(root, axis)",
    )
    write(tmp_path / "m", model, FOLLOWER)
    policy = load(tmp_path / "m", GAME)
    with pytest.raises(PolicyError, match="'follower': answered NaN or infinity"):
        policy.act(np.full((1, 1, 5, 5), 255, np.uint8), np.zeros(1, int))


TO_WHOLE = "f = Cast<to = 1>(x) m = ReduceMean<keepdims = 0>(f, axes) y = Cast<to = 7>(m)"
WHOLE = parsed("uint8[n,1,5,5] x", "int64[n,5,5] y", "int64[1] axes = {1}", TO_WHOLE)


@pytest.mark.parametrize(
    ("model", "fields", "error", "message"),
    [
        (WHOLE, {}, CheckpointError, "is to answer fractions"),
        (follower(), {"system": "direct"}, KindError, "to command direct, and not ergodic"),
        (follower(), {"answers": "atractors"}, KindError, "kind 'atractors', but the control system ergodic"),
    ],
)
def test_what_may_not_play_is_not_written(tmp_path, model, fields, error, message):
    with pytest.raises(error, match=message):
        write(tmp_path / "m", model, replace(FOLLOWER, **fields))
    assert not (tmp_path / "m").exists()
