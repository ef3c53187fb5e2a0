from __future__ import annotations

import ast
import textwrap

import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.policies import held_out, scripted
from swarm_pz.standard.identity import _canonical, identity_of, source_digest


def test_a_learned_player_is_its_weights_and_card():
    champion = policies.load("champion")
    assert identity_of("champion", champion) == champion.digest


def test_scripts_differ_from_each_other_and_not_from_themselves():
    digests = [source_digest(script) for script in scripted.SCRIPTS]
    assert len(set(digests)) == len(digests)
    assert identity_of("ring", policies.load("ring")) == source_digest(scripted.ring)


def test_others_are_named_with_their_version():
    assert identity_of("planner:ring", policies.load("planner:ring", GameConfig())).startswith(
        "swarm-pz 0.1.0: planner"
    )


def canonical(text):
    return _canonical(ast.parse(textwrap.dedent(text)).body[0])


@pytest.mark.parametrize(
    "changed", ["def f(x):\n    # why\n    return x + 1", 'def f(x: int) -> int:\n    """W."""\n    return (x + 1)']
)
def test_words_and_form_change_no_digest(changed):
    assert canonical(changed) == canonical("def f(x): return x + 1")


def test_code_changes_a_digest():
    assert canonical("def f(x): return x + 2") != canonical("def f(x): return x + 1")


def test_what_a_script_calls_and_its_constants_count(monkeypatch):
    before = source_digest(held_out.drifting)
    monkeypatch.setattr(held_out, "_blob", held_out._in_turn)
    assert source_digest(held_out.drifting) != before
