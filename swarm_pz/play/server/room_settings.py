"""A room's settings, as clients know them, and the table that they ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.config.system import ControlSystem
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig

_UNTIMED = 1e6
"""Seconds that stand for no time limit."""


@dataclass(frozen=True, kw_only=True)
class Hosted:
    """What a host has decided of a room: one game, which begins when all who have a seat are there.

    Attributes
    ----------
    config : TableConfig
    seed : int
        Of the game's start.
    path : Path
        Of its recording.
    over : callable
        Told when the game has ended.
    """

    config: TableConfig
    seed: int
    path: Path
    over: Callable[[], None]


def table_config(settings: protocol.Settings, table: TableConfig) -> TableConfig:
    """Return a table with a room's settings; one side without drones makes a practice arena.

    Raises
    ------
    ConfigError
        If there is no such game.
    """
    sizes = (settings.red, settings.blue)
    rules = table.game
    game = rules.replace(
        controllers=(_system(settings.red_system, RED, rules), _system(settings.blue_system, BLUE, rules)),
        drones_per_team=sizes,
        time_limit=settings.time_limit if settings.time_limit is not None else _UNTIMED,
        capture=rules.capture.replace(enabled=rules.capture.enabled and min(sizes) > 0),
    )
    return table.replace(game=game, mapping=settings.mapping, speed=settings.speed)


def _system(name: str | None, team: int, rules: GameConfig) -> ControlSystem:
    """Return what a room wants to fly a team: of the table's own systems the one of that name, with its numbers."""
    own = rules.team_systems
    if name is None:
        return own[team]
    return next((system for system in own if system.name == name), None) or system_of(name)


def settings_of(config: TableConfig) -> protocol.Settings:
    """Return a table's settings as clients know them."""
    red, blue = config.game.team_sizes
    limit = config.game.time_limit
    return protocol.Settings(
        red=red,
        blue=blue,
        time_limit=limit if limit < _UNTIMED else None,
        mapping=config.mapping,
        speed=config.speed,
        red_system=config.game.team_controllers[RED],
        blue_system=config.game.team_controllers[BLUE],
    )
