"""Control systems that other packages register: working ones are listed, broken ones are refused."""

from __future__ import annotations

import importlib.metadata
import sys
import types
from dataclasses import dataclass

import pytest
from gymnasium import spaces

from swarm_pz.cli import main
from swarm_pz.config import GameConfig, registry
from swarm_pz.config.registry import GROUP, faults, registered, system_class
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from tests.systems_of_tests import Magnet


class MuteError(Exception):
    __repr__ = None


def raises(error):
    def method(*_):
        raise error

    return method


def guest(name, **members):
    """Return a control system like `Magnet`, but for its name and these members."""
    return dataclass(frozen=True, kw_only=True)(type(name.title(), (Magnet,), {"name": name, **members}))


REFUSED = {
    "gone": ("no_such_package:System", "ModuleNotFoundError"),
    "attribute": ("guests:missing", "nothing called missing"),
    "exits": ("guests:exits", "SystemExit"),
    "number": (3, "got 3"),
    "plain": (GameConfig, "subclass"),
    "iron": (Magnet, "name = 'iron'"),
    "silent": (guest("silent", takes=None), "takes"),
    "undecorated": (type("Undecorated", (Magnet,), {"name": "undecorated"}), "frozen dataclass"),
    "borrowed": (guest("borrowed", kernel="ergodic"), "its own solve"),
    "../evil": (guest("../evil"), "name of letters"),
    "muted": (guest("muted", __post_init__=raises(MuteError())), "<MuteError that cannot be shown>"),
    "fragile": (guest("fragile", __post_init__=raises(RuntimeError("no licence"))), "no licence"),
}
"""Entry points that are no control systems, and their errors."""
SENSELESS = {
    "endless": ({"space": lambda *_: spaces.Box(-float("inf"), float("inf"), (2,))}, "bounded Box"),
    "lost": ({"default": lambda *_: [0.5, 0.5, 0.5]}, r"begin with .* got shape \(3,\)"),
    "outside": ({"default": lambda *_: [0.5, 0.9]}, r"begin with .* \[0.5, 0.9\]"),
    "images": ({"takes": "density"}, r"shape \(10, 10\), got a space of shape \(2,\)"),
    "unseen": ({"to_densities": lambda _, commands, config: commands}, r"by to_densities: .* got shape \(1, 2\)"),
    "clumsy": ({"from_densities": lambda _, densities, config: densities}, "cannot serve densities: .*from_densities"),
    "torn": ({"space": raises(KeyError("which"))}, r"cannot say what it takes: KeyError\('which'\)"),
}
"""Control systems whose commands make no sense."""


@pytest.fixture(autouse=True)
def guests(monkeypatch):
    """A package whose systems are broken in every way, and one that works."""
    module = types.ModuleType("guests")

    def missing(name):
        if name == "exits":
            sys.exit("needs another system")
        raise AttributeError(f"nothing called {name}")

    module.__getattr__ = missing
    monkeypatch.setitem(sys.modules, "guests", module)
    installed, points = importlib.metadata.entry_points, []

    def add(name, value, package="guests"):
        if not isinstance(value, str):
            setattr(module, place := name.strip("./"), value)
            value = f"guests:{place}"
        point = importlib.metadata.EntryPoint(name, value, GROUP)
        vars(point)["dist"] = types.SimpleNamespace(name=package)
        points.append(point)

    for name, (value, _) in REFUSED.items():
        add(name, value)
    for name, (members, _) in SENSELESS.items():
        add(name, guest(name, **members))
    for name in ("magnet", "ergodic"):
        add(name, Magnet)
    add("magnet", "no_such_package:Magnet", "latecomers")

    def entry_points(**wanted):
        own = installed(**wanted)
        return (*points, *own) if wanted.get("group") == GROUP else own

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    for cached in (system_class, registry._find):
        monkeypatch.setattr(registry, cached.__name__, cached.__wrapped__)


@pytest.mark.parametrize("name", REFUSED | SENSELESS)
def test_a_system_that_cannot_fly_or_whose_commands_make_no_sense_is_refused_with_what_is_wrong(name):
    message = rf"'{name}' of guests .*{REFUSED[name][1]}" if name in REFUSED else f"{name} .*{SENSELESS[name][1]}"
    with pytest.raises(ConfigError, match=message):
        Simulator(GameConfig(controllers=name))


def test_the_own_system_stays_where_another_package_takes_its_name_and_else_the_first():
    assert registered()["ergodic"].value == "swarm_pz.systems.ergodic:Ergodic"
    assert system_class("magnet") is Magnet
    reasons = faults()
    assert set(reasons) == {*REFUSED, "ergodic of guests", "magnet of latecomers"}
    assert "swarm-pz has a system of that name" in reasons["ergodic of guests"]
    assert "guests has a system of that name" in reasons["magnet of latecomers"]


def test_what_is_installed_is_listed_and_broken_ones_are_named(capsys):
    main(["policies"])
    printed = capsys.readouterr()
    _, _, listed = printed.out.partition("control systems, for --game.controllers:\n")
    names = [line.split()[0] for line in listed.splitlines()]
    assert names == sorted(names) and {"ergodic", "flocking", "direct", "magnet"} <= set(names)
    assert not set(names) & set(REFUSED)
    assert printed.err.count("left out: control system") == len(REFUSED) + 2


@pytest.mark.parametrize("name", [3, "a\x1b[31m\n", ""])
def test_a_name_that_no_line_can_show_is_refused(name, monkeypatch):
    monkeypatch.setattr(Magnet, "name", name)
    with pytest.raises(ConfigError, match="must have a name of letters"):
        GameConfig(controllers=Magnet())
