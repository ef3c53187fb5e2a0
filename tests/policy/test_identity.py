"""A digest of a player changes with its code or weights, and with nothing else."""

import ast
import sys
import textwrap

import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.policies import generated, open_loop, scripted
from swarm_pz.policy import allow_files
from swarm_pz.policy.identity import _canonical, _gather, digest_of, identity_of, source_digest


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
    gathered = {}
    _gather(generated.generated.play, gathered)
    assert {f"{kind.play.__module__}.{kind.__name__}" for kind in generated.TRAINING} <= gathered.keys()
    assert not [name for name, part in gathered.items() if " at 0x" in _canonical(part)]


TACTIC = """import helper
from swarm_pz.policies.scripted import tactic

@tactic(grid=1, sees=("time_left",))
def mine(view):
    return view.every(helper.LEVEL)
"""


def test_a_tactic_in_a_file_is_the_file_with_what_it_imports_from_its_folder(tmp_path, monkeypatch):
    name = f"{tmp_path}/mine.py:mine"
    (tmp_path / "mine.py").write_text(TACTIC)
    (tmp_path / "helper.py").write_text("LEVEL = 1.0\n")
    allow_files([name])

    def digest():
        for module in (f"{tmp_path}/mine.py", "helper"):
            monkeypatch.delitem(sys.modules, module, raising=False)
        return digest_of(name, policies.load(name))

    digests = [digest()]
    for changed in ("mine.py", "helper.py", "beside.py"):
        with (tmp_path / changed).open("a") as file:
            file.write("# better\n")
        digests.append(digest())
    assert len(set(digests[:3])) == 3 and digests[3] == digests[2], "nobody imports beside.py"


def test_what_a_script_calls_and_its_constants_count(monkeypatch):
    before = source_digest(generated.hide), source_digest(open_loop.best_constant)
    monkeypatch.setattr(generated, "_anywhere", generated._around)
    monkeypatch.setattr(open_loop, "CONSTANT", ((1, ((0.5, 1.0), (1.0, 1.0))),))
    assert source_digest(generated.hide) != before[0] and source_digest(open_loop.best_constant) != before[1]
