"""Policies that other packages register, and what is done about broken ones."""

from __future__ import annotations

import importlib.metadata
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

BROKEN = {"gone", "attribute", "crashes", "exits", "syntax", "number"}


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


@pytest.fixture
def guests(monkeypatch, tmp_path):
    """A package whose policies are broken in every way, and one that works."""
    module = types.ModuleType("guests_tactics")
    module.number, module.fail, module.leave, module.halo, module.picky = 3, fail, leave, halo, picky
    module.__getattr__ = raising
    monkeypatch.setitem(sys.modules, "guests_tactics", module)
    (tmp_path / "guests_unreadable.py").write_text("def tactic(:\n")
    monkeypatch.syspath_prepend(tmp_path)
    distribution = types.SimpleNamespace(name="guests")
    installed = importlib.metadata.entry_points
    points = installed(group=GROUP)

    def point(name, value):
        made = importlib.metadata.EntryPoint(name, value, GROUP)
        vars(made)["dist"] = distribution
        return made

    broken = [
        point("gone", "no_such_package:tactic"),
        point("attribute", "guests_tactics:missing"),
        point("crashes", "guests_tactics:crashes"),
        point("exits", "guests_tactics:exits"),
        point("syntax", "guests_unreadable:tactic"),
        point("number", "guests_tactics:number"),
        point("ring", "guests_tactics:halo"),
        point("fails", "guests_tactics:fail"),
        point("leaves", "guests_tactics:leave"),
        point("works", "guests_tactics:halo"),
        point("picky", "guests_tactics:picky"),
    ]

    def entry_points(**wanted):
        # Other groups stay as they are: torch, imported meanwhile, asks for its own, and half imported it crashes.
        return (*broken, *points) if wanted.get("group") == GROUP else installed(**wanted)

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    return len(points)


def test_broken_policies_are_named_with_their_package_and_error(guests):
    found = faults()
    assert set(found) == {*BROKEN, "ring of guests"}
    assert all("of guests (" in fault for fault in found.values())
    assert "No module named 'no_such_package'" in found["gone"]
    assert "nothing called missing" in found["attribute"]
    assert "crashed while it was imported" in found["crashes"]
    assert "SystemExit('needs another system')" in found["exits"]
    assert "SyntaxError" in found["syntax"]
    assert "must be callable, got 3" in found["number"]
    assert "swarm-pz has a policy of that name already" in found["ring of guests"]


def test_what_is_installed_is_looked_through_once_and_again_when_more_is_installed(monkeypatch, tmp_path):
    installed, asked = importlib.metadata.entry_points, []

    def entry_points(**wanted):
        asked.append(wanted)
        return installed(**wanted)

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    monkeypatch.syspath_prepend(tmp_path)
    faults()
    assert [about(name) for name in registered()]
    assert len(asked) == 1
    told = tmp_path / "guests-1.0.dist-info"
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: guests\nVersion: 1.0\n")
    (told / "entry_points.txt").write_text(f"[{GROUP}]\nnewly = guests_tactics:halo\n")
    assert "newly" in registered()
    assert len(asked) == 2


def test_the_own_policy_stays_where_another_package_takes_its_name(guests):
    assert registered()["ring"].value == "swarm_pz.policies.scripted:ring"


def test_commands_name_broken_policies_and_go_on(guests, capsys):
    main(["policies"])
    printed = capsys.readouterr()
    players, _, _ = printed.out.partition("\n\ncontrol systems")
    assert len(players.splitlines()) == guests + 4
    assert re.search(r"^works +Make a broad ring", printed.out, re.M)
    assert printed.err.count("left out: policy") == 7
    assert set(known()) == set(registered()) - BROKEN


def test_a_tournament_of_all_leaves_out_who_cannot_play(guests, capsys):
    field = able(GameConfig(drones_per_team=2))
    assert "works" in field and not {"fails", "leaves", "picky"} & set(field)
    said = capsys.readouterr().err
    assert "left out: fails: policy 'fails' (guests_tactics:fail) cannot be made" in said
    assert "left out: leaves: policy 'leaves' (guests_tactics:leave) cannot be made: SystemExit('no licence')" in said
    assert "left out: picky: this tactic wants ten drones" in said
    others = {script.__name__ for script in commanders.SCRIPTS}  # those who command other control systems
    assert {*BROKEN, *others, "fails", "leaves", "picky"} == set(registered()) - {*field, "trained"}
    assert "picky" in able(GameConfig())


def test_a_broken_policy_is_still_refused_where_it_is_asked_for(guests):
    assert [about(name) for name in ("gone", "crashes", "exits", "syntax")] == [""] * 4
    for name in ("gone", "exits"):
        with pytest.raises(PolicyError, match="cannot be made"):
            policies.load(name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("runs/nothing", "there is no folder 'runs/nothing', nor a policy of that name"),
        ("rign", "there is no policy 'rign', and no such folder; did you mean 'ring'"),
        (__file__, "expected a policy or a folder that training wrote, got the file"),
    ],
)
def test_what_is_neither_a_policy_nor_a_folder_is_said_to_be_so(name, message):
    with pytest.raises(PolicyError, match=message):
        policies.load(name)
