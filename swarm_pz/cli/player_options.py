"""Players and control systems on the command line: their names, and which can play."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Annotated

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from swarm_pz import systems
from swarm_pz.config import GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import KindError, SwarmError
from swarm_pz.policy import about, faults, load, registered

Player = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="PLAYER")]
Players = Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[PLAYER ...]")]
Opponent = Annotated[str, tyro.conf.arg(metavar="PLAYER")]
REGISTRY = ConstructorRegistry()
"""Rules by which tyro reads control systems."""


@REGISTRY.primitive_rule
def _by_name(info: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[ControlSystem] | None:
    """Read a control system by its name, with its default numbers."""
    if info.type is not ControlSystem:
        return None
    return PrimitiveConstructorSpec(
        nargs=1,
        metavar="SYSTEM",
        instance_from_str=lambda words: system_of(words[0]),
        is_instance=lambda value: isinstance(value, ControlSystem),
        str_from_instance=lambda system: [system.name],
    )


def known() -> dict[str, str]:
    """Return the names of installed policies that can be used, with a line about each; name broken ones on stderr."""
    return {name: about(name) for name in _usable(registered(), faults())}


def able_to_fly() -> dict[str, str]:
    """Return the names of installed control systems, with a line about each; name broken ones on stderr."""
    names = _usable(systems.registered(), systems.faults())
    return {name: f"takes {systems.system_class(name).takes}: {systems.about(name)}" for name in names}


def _usable(names: Iterable[str], broken: dict[str, str]) -> list[str]:
    for fault in broken.values():
        print(f"left out: {fault}", file=sys.stderr)
    return sorted(set(names) - set(broken))


def able(game: GameConfig) -> tuple[str, ...]:
    """Return the names of installed policies that can play a game; name broken ones on stderr."""
    names = []
    for name in known():
        try:
            load(name, game)
        except KindError:  # it is for another control system
            continue
        except SwarmError as error:
            print(f"left out: {name}: {error}", file=sys.stderr)
        else:
            names.append(name)
    return tuple(names)
