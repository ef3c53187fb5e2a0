"""Players on the command line: how they are named, and which of those that are installed can play."""

from __future__ import annotations

import sys
from typing import Annotated

import tyro

from swarm_pz import systems
from swarm_pz.config import GameConfig
from swarm_pz.errors import KindError, SwarmError
from swarm_pz.policy import about, faults, load, registered

Player = Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="PLAYER")]
Players = Annotated[tuple[str, ...], tyro.conf.Positional, tyro.conf.arg(metavar="[PLAYER ...]")]
Opponent = Annotated[str, tyro.conf.arg(metavar="PLAYER")]


def known() -> dict[str, str]:
    """Return the names of installed policies that can be used, with a line about each; name others on stderr."""
    broken = faults()
    for fault in broken.values():
        print(f"left out: {fault}", file=sys.stderr)
    return {name: about(name) for name in sorted(registered()) if name not in broken}


def able_to_fly() -> dict[str, str]:
    """Return the names of installed control systems, with what each takes and is; name broken ones on stderr."""
    broken = systems.faults()
    for fault in broken.values():
        print(f"left out: {fault}", file=sys.stderr)
    names = sorted(set(systems.registered()) - set(broken))
    return {name: f"takes {systems.system_class(name).takes}: {systems.about(name)}" for name in names}


def able(game: GameConfig) -> tuple[str, ...]:
    """Return the names of installed policies that can play a game; name broken ones on stderr."""
    found = []
    for name in known():
        try:
            load(name, game)
        except KindError:  # it is for other control systems
            continue
        except SwarmError as error:
            print(f"left out: {name}: {error}", file=sys.stderr)
        else:
            found.append(name)
    return tuple(found)
