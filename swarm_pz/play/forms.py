"""Commands as clients write them, and what a client is told of a table and of its seat's commands."""

from __future__ import annotations

import importlib.metadata
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import FAULTS
from swarm_pz.config.registry import registered, system_class
from swarm_pz.config.system import ControlSystem, serves_densities
from swarm_pz.errors import CommandError, ConfigError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.opponents import opponents_among

if TYPE_CHECKING:
    from swarm_pz.play.game import TableConfig

_NUMBER = re.compile(r"[0-9]{1,4}")


def read_form(form: Any, system: ControlSystem, config: GameConfig, name: str) -> NDArray[np.float64]:
    """Return a command in JSON as the array that its control system takes; raise CommandError if invalid."""
    try:
        if isinstance(form, Mapping):  # keys are always text in JSON
            form = {int(key) if _NUMBER.fullmatch(key) else key: value for key, value in form.items()}
        values = np.asarray(system.parse(form, config, name), np.float64)
    except SwarmError as error:
        raise CommandError(str(error)) from error
    except FAULTS as error:
        raise CommandError(f"{name} cannot be read by the control system {system.name}: {error!r}") from error
    expected = system.space(config).shape
    if values.shape != expected or not np.isfinite(values).all():
        raise CommandError(
            f"{name}: {system.name} turned it into {values.shape} numbers, expected {expected}, all finite"
        )
    return values


def commands_of(system: ControlSystem, config: GameConfig) -> protocol.Commands:
    """Return the description of a seat's commands; raise ConfigError if the control system gives none."""
    try:
        space = system.space(config)
        return protocol.Commands(
            system=system.name,
            takes=system.takes,
            shape=[int(size) for size in space.shape],
            low=_numbers(space.low),
            high=_numbers(space.high),
            default=np.asarray(system.default(config), np.float64).tolist(),
            serves_densities=serves_densities(system, config),
            shapes=list(system.shapes),
        )
    except SwarmError:
        raise
    except FAULTS as error:
        raise ConfigError(f"the control system {system.name} does not say what it takes: {error!r}") from error


def _numbers(values: NDArray[Any]) -> float | list[Any]:
    least = values.min(initial=np.inf)
    if (values == least).all():
        return _exact(least)
    return np.vectorize(_exact, otypes=[object])(values).tolist()  # type: ignore[no-any-return]


def _exact(value: Any) -> float:
    """Return the shortest number that rounds to the float32 `value`."""
    return float(str(np.float32(value)))


def installed_systems(config: GameConfig) -> list[protocol.SystemInfo]:
    """Return the control systems that may fly a seat, without those that raise errors."""
    systems = []
    for name in sorted(registered()):
        try:
            system = system_class(name)()
            serves_densities(system, config)  # may raise, too
        except FAULTS:  # `swarm-pz policies` reports it
            continue
        systems.append(protocol.SystemInfo(name=name, takes=system.takes))
    return systems


def welcome_of(
    table: TableConfig, policies: Mapping[str, str], cards: Mapping[str, protocol.Card], **more: Any
) -> protocol.Welcome:
    """Return the answer to a client's hello, with `more` fields; `policies` have a line about each."""
    return protocol.Welcome(
        version=importlib.metadata.version("swarm-pz"),
        policies=[protocol.PolicyInfo(name=name, about=text, card=cards.get(name)) for name, text in policies.items()],
        min_command_interval=table.min_command_interval,
        command_cells=table.game.command_cells,
        server_ms=0.0,
        systems=installed_systems(table.game),
        default_systems=list(table.game.team_controllers),
        opponents=opponents_among(policies),
        **more,
    )
