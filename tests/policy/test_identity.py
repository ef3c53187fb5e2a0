"""A digest of a player changes with its code or weights, and with nothing else."""

import ast
import subprocess
import sys
import textwrap

import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.policies import generated, open_loop, scripted
from swarm_pz.policy.identity import _canonical, identity_of, source_digest


def test_a_learned_player_is_its_weights_a_script_its_source_and_another_its_version():
    champion = policies.load("champion")
    assert identity_of("champion", champion) == champion.digest
    assert identity_of("ring", policies.load("ring")) == source_digest(scripted.ring)
    assert len({source_digest(script) for script in scripted.SCRIPTS}) == len(scripted.SCRIPTS)
    planner = policies.load("planner:ring", GameConfig())
    assert identity_of("planner:ring", planner).startswith("swarm-pz 0.1.0: planner")


@pytest.mark.parametrize(
    ("changed", "is_same"),
    [('def f(x: int) -> int:\n    """W."""\n    # why\n    return (x + 1)', True), ("def f(x): return x + 2", False)],
)
def test_only_code_changes_a_digest(changed, is_same):
    def canonical(text):
        return _canonical(ast.parse(textwrap.dedent(text)).body[0])

    assert (canonical(changed) == canonical("def f(x): return x + 1")) is is_same


def test_a_digest_holds_no_place_in_memory():
    """`generated` refers to a tuple of tactics, and the repr of a tactic holds its memory address."""
    words = "from swarm_pz import policies; from swarm_pz.policy import identity_of\n"
    words += "print(identity_of('generated', policies.load('generated')))"
    digests = {subprocess.run([sys.executable, "-c", words], capture_output=True, check=True).stdout for _ in range(2)}  # noqa: S603
    assert len(digests) == 1


def test_what_a_script_calls_and_its_constants_count(monkeypatch):
    before = source_digest(generated.hide), source_digest(open_loop.best_constant)
    monkeypatch.setattr(generated, "_anywhere", generated._around)
    monkeypatch.setattr(open_loop, "CONSTANT", ((1, ((0.5, 1.0), (1.0, 1.0))),))
    assert source_digest(generated.hide) != before[0] and source_digest(open_loop.best_constant) != before[1]
