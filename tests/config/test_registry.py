"""Control systems that other packages register, and what is done about broken ones."""

from __future__ import annotations

import importlib.metadata
import sys
import types
from dataclasses import dataclass
from typing import ClassVar

import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig, registry
from swarm_pz.config.registry import GROUP, faults, registered, system_class
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from tests.systems_of_tests import Magnet


@dataclass(frozen=True, kw_only=True)
class Silent(Magnet):
    """Its commands are of no kind."""

    name: ClassVar[str] = "silent"
    takes: ClassVar[None] = None


@dataclass(frozen=True, kw_only=True)
class Fragile(Magnet):
    """Cannot be made."""

    name: ClassVar[str] = "fragile"

    def __post_init__(self):
        raise RuntimeError("no licence")


@dataclass(frozen=True, kw_only=True)
class Endless(Magnet):
    """Takes commands without end."""

    name: ClassVar[str] = "endless"

    def space(self, config):
        from gymnasium import spaces

        return spaces.Box(-float("inf"), float("inf"), (2,))


@dataclass(frozen=True, kw_only=True)
class Lost(Magnet):
    """Does not know its first command."""

    name: ClassVar[str] = "lost"

    def default(self, config):
        return [0.5, 0.5, 0.5]


@dataclass(frozen=True, kw_only=True)
class Torn(Magnet):
    """Cannot say what it takes."""

    name: ClassVar[str] = "torn"

    def space(self, config):
        raise KeyError("which")


@dataclass(frozen=True, kw_only=True)
class Outside(Magnet):
    """Begins with what it does not take."""

    name: ClassVar[str] = "outside"

    def default(self, config):
        return [0.5, 0.9]


@dataclass(frozen=True, kw_only=True)
class Images(Magnet):
    """Says that places are densities."""

    name: ClassVar[str] = "images"
    takes: ClassVar[str] = "density"


class Undecorated(Magnet):
    """Its numbers are no fields."""

    name: ClassVar[str] = "undecorated"


@dataclass(frozen=True, kw_only=True)
class Borrowed(Magnet):
    """Wants to fly in the games' own loop."""

    name: ClassVar[str] = "borrowed"
    kernel: ClassVar[str] = "ergodic"


class MuteError(Exception):
    def __repr__(self):
        raise RuntimeError("nothing to show")


@dataclass(frozen=True, kw_only=True)
class Evil(Magnet):
    """Is called as a path."""

    name: ClassVar[str] = "../evil"


@dataclass(frozen=True, kw_only=True)
class Muted(Magnet):
    """Cannot be made, nor say why."""

    name: ClassVar[str] = "muted"

    def __post_init__(self):
        raise MuteError


def raising(name):
    if name == "exits":
        sys.exit("needs another system")
    raise AttributeError(f"nothing called {name}")


@dataclass(frozen=True, kw_only=True)
class Unseen(Magnet):
    """Shows its commands in another form."""

    name: ClassVar[str] = "unseen"

    def to_densities(self, commands, config):
        return commands


@dataclass(frozen=True, kw_only=True)
class Clumsy(Magnet):
    """Serves densities by commands of another shape."""

    name: ClassVar[str] = "clumsy"

    def from_densities(self, densities, config):
        return densities


BROKEN = (Silent, Fragile, Undecorated, Borrowed, Evil, Muted)
TAKEN = (Magnet, Endless, Lost, Torn, Outside, Images, Unseen, Clumsy)
"""What is found; all but the first cannot be made part of a game."""
REFUSED = {
    "gone": ("no_such_package:System", "cannot be imported: ModuleNotFoundError"),
    "attribute": ("guest_systems:missing", "nothing called missing"),
    "exits": ("guest_systems:exits", r"SystemExit\('needs another system'\)"),
    "number": ("guest_systems:number", r"must be a subclass of swarm_pz.systems.ControlSystem, got 3"),
    "plain": ("guest_systems:GameConfig", "must be a subclass of swarm_pz.systems.ControlSystem, got <class"),
    "iron": ("guest_systems:Magnet", "must say name = 'iron' as its entry point does, got 'magnet'"),
    "silent": ("guest_systems:Silent", "must say by takes"),
    "undecorated": ("guest_systems:Undecorated", r"must be a frozen dataclass: put @dataclass\(frozen=True"),
    "borrowed": ("guest_systems:Borrowed", "must fly by its own solve"),
    "../evil": ("guest_systems:Evil", "must have a name of letters, digits"),
    "muted": ("guest_systems:Muted", "cannot be made: <MuteError that cannot be shown>"),
    "fragile": ("guest_systems:Fragile", r"cannot be made: RuntimeError\('no licence'\)"),
}


@pytest.fixture(autouse=True)
def guests(monkeypatch):
    """A package whose systems are broken in every way, and one that works."""
    module = types.ModuleType("guest_systems")
    for found in (*BROKEN, *TAKEN, GameConfig):
        setattr(module, found.__name__, found)
    module.number, module.__getattr__ = 3, raising
    monkeypatch.setitem(sys.modules, "guest_systems", module)
    installed = importlib.metadata.entry_points

    def point(name, value, package="guests"):
        made = importlib.metadata.EntryPoint(name, value, GROUP)
        vars(made)["dist"] = types.SimpleNamespace(name=package)
        return made

    points = [point(name, value) for name, (value, _) in REFUSED.items()]
    points += [point(one.name, f"guest_systems:{one.__name__}") for one in TAKEN]
    points += [point("ergodic", "guest_systems:Magnet"), point("magnet", "no_such_package:Magnet", "latecomers")]

    def entry_points(**wanted):
        own = installed(**wanted)
        return (*points, *own) if wanted.get("group") == GROUP else own

    monkeypatch.setattr(importlib.metadata, "entry_points", entry_points)
    for cached in (system_class, registry._find):
        monkeypatch.setattr(registry, cached.__name__, cached.__wrapped__)


@pytest.mark.parametrize("name", REFUSED)
def test_a_system_that_cannot_fly_is_refused_with_its_package_and_what_is_wrong(name):
    value, said = REFUSED[name]
    with pytest.raises(ConfigError, match=rf"control system '{name}' of guests \({value}\).*{said}"):
        Simulator(GameConfig(controllers=name))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("endless", "endless must take commands of a bounded Box"),
        ("lost", r"lost must begin with a command of its space, Box.*, got shape \(3,\)"),
        (
            "outside",
            r"outside must begin with a command of its space, Box.* with \[0.5, 0.9\]",
        ),
        ("images", r"images says that it takes densities, which are of shape \(10, 10\), got a space of shape \(2,\)"),
        ("unseen", r"unseen cannot show its commands by to_densities: densities must be numbers .* got shape \(1, 2\)"),
        ("clumsy", r"clumsy cannot serve densities: what .* of shape \(1, 2\), got shape \(1, 10, 10\)"),
        ("torn", r"torn cannot say what it takes: KeyError\('which'\)"),
    ],
)
def test_a_system_whose_commands_make_no_sense_is_refused_when_games_are_made(name, said):
    with pytest.raises(ConfigError, match=said):
        Simulator(GameConfig(controllers=name))


def test_the_own_system_stays_where_another_package_takes_its_name_and_else_the_first():
    assert registered()["ergodic"].value == "swarm_pz.systems.ergodic:Ergodic"
    assert system_class("magnet") is Magnet
    found = faults()
    assert set(found) == {*REFUSED, "ergodic of guests", "magnet of latecomers"}
    assert "swarm-pz has a system of that name already" in found["ergodic of guests"]
    assert "guests has a system of that name already" in found["magnet of latecomers"]


def test_what_is_installed_is_listed_and_broken_ones_are_named(capsys):
    main(["policies"])
    printed = capsys.readouterr()
    _, _, listed = printed.out.partition("control systems, by --game.controllers:\n")
    names = [line.split()[0] for line in listed.splitlines()]
    assert names == sorted(names) and {"ergodic", "flocking", "direct", "magnet"} <= set(names)
    assert not set(names) & set(REFUSED)
    assert "magnet           takes place: Everybody flies to one place" in listed
    assert printed.err.count("left out: control system") == len(REFUSED) + 2


def test_a_name_that_nobody_has_is_refused_with_the_nearest():
    with pytest.raises(ConfigError, match="no control system 'flock'; did you mean 'flocking'"):
        GameConfig(controllers="flock")


@pytest.mark.parametrize("name", [3, "a\x1b[31m\n", ""])
def test_a_name_that_no_line_can_show_is_refused(name, monkeypatch):
    monkeypatch.setattr(Magnet, "name", name)
    with pytest.raises(ConfigError, match="must have a name of letters"):
        GameConfig(controllers=Magnet())
