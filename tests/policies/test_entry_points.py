"""Policies that other packages register; broken ones are reported and left out."""

from __future__ import annotations

import re
import sys
import types

import pytest

from swarm_pz import policies
from swarm_pz.cli import main
from swarm_pz.cli.player_options import able, known
from swarm_pz.config import GameConfig
from swarm_pz.errors import PolicyError
from swarm_pz.policies import commanders
from swarm_pz.policies.scripted import halo
from swarm_pz.policy import GROUP, about, faults, registered


def fail(config):
    raise RuntimeError("no luck")


def leave(config):
    sys.exit("no licence")


def picky(config):
    if config.drones_per_team != 10:
        raise PolicyError("this tactic wants ten drones")
    return halo(config)


def raising(name):
    if name == "crashes":
        raise RuntimeError("crashed while it was imported")
    if name == "exits":
        sys.exit("needs another system")
    raise AttributeError(f"nothing called {name}")


BROKEN = {
    "gone": ("no_such_package:tactic", "No module named 'no_such_package'"),
    "attribute": ("guests_tactics:missing", "nothing called missing"),
    "crashes": ("guests_tactics:crashes", "crashed while it was imported"),
    "exits": ("guests_tactics:exits", "SystemExit('needs another system')"),
    "syntax": ("guests_unreadable:tactic", "SyntaxError"),
    "number": ("guests_tactics:number", "must be callable, got 3"),
}
OTHERS = {"ring": "halo", "fails": "fail", "leaves": "leave", "works": "halo", "picky": "picky"}


@pytest.fixture
def guests(monkeypatch, tmp_path):
    """Install a package whose policies are broken in every way, but for one that works."""
    module = types.ModuleType("guests_tactics")
    module.number, module.fail, module.leave, module.halo, module.picky = 3, fail, leave, halo, picky
    module.__getattr__ = raising
    monkeypatch.setitem(sys.modules, "guests_tactics", module)
    (tmp_path / "guests_unreadable.py").write_text("def tactic(:\n")
    values = {name: value for name, (value, _) in BROKEN.items()}
    install(tmp_path, values | {name: f"guests_tactics:{made}" for name, made in OTHERS.items()})
    monkeypatch.syspath_prepend(tmp_path)


def install(folder, points, name="guests"):
    dist = folder / f"{name}-1.0.dist-info"
    dist.mkdir()
    (dist / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [f"{point} = {value}" for point, value in points.items()]
    (dist / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines]))


def test_broken_policies_are_named_with_their_package_and_error_and_commands_go_on(guests, capsys):
    reasons = faults()
    assert set(reasons) == {*BROKEN, "ring of guests"}
    for name, fault in reasons.items():
        assert "of guests (" in fault and BROKEN.get(name, ("", "has a policy of that name already"))[1] in fault
    assert registered()["ring"].value == "swarm_pz.policies.scripted:ring"  # ours stays
    assert [about(name) for name in ("gone", "crashes", "exits", "syntax")] == [""] * 4
    for name in ("gone", "exits"):
        with pytest.raises(PolicyError, match="cannot be made"):
            policies.load(name)
    main(["policies"])
    printed = capsys.readouterr()
    assert re.search(r"^works +Make a broad ring", printed.out, re.M)
    assert printed.err.count("left out: policy") == 7
    assert set(known()) == set(registered()) - set(BROKEN)


def test_a_tournament_of_all_leaves_out_who_cannot_play(guests, capsys):
    field = able(GameConfig(drones_per_team=2))
    printed = capsys.readouterr().err
    for part in ("fails: policy 'fails'", "leaves: policy 'leaves'", "picky: this tactic wants ten drones"):
        assert f"left out: {part}" in printed
    for_other_systems = {script.__name__ for script in commanders.SCRIPTS}
    left_out = {*BROKEN, *for_other_systems, "fails", "leaves", "picky"}
    assert set(registered()) - {*field, "trained"} == left_out and "works" in field


def test_what_is_installed_while_it_runs_is_found(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(tmp_path)
    assert "newly" not in registered()
    install(tmp_path, {"newly": "guests_tactics:halo"})
    assert "newly" in registered()
