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

_PLAIN_COST = 0.8
"""What every game takes of the server, in games of 10 against 10 by `ergodic` at normal speed."""
_COSTS = {
    "ergodic": (0.0, 0.01),
    "direct": (1.2, 0.01),
    "flocking": (1.4, 0.02),
    "potential_field": (1.4, 0.02),
    "formation": (2.0, 0.03),
    "coverage": (1.9, 0.08),
    "kernel_ergodic": (1.0, 0.08),
    "leader_follower": (2.9, 0.08),
}
"""What a team that a control system flies takes besides, and each of its drones, as measured on one game by itself."""
_UNKNOWN_COST = 3.0, 0.1
"""The same, of another package's system."""
POLICY_COST = 0.25
"""The same, of a policy that plays, helps or responds in a room."""
_UNTIMED = 1e6
"""Seconds that stand for no time limit."""


@dataclass(frozen=True, kw_only=True)
class Hosted:
    """What a host has decided of a room: one game, which begins when all who have a seat are there.

    - `seed`: of the game's start.
    - `path`: of its recording.
    - `over`: told when the game has ended.
    """

    config: TableConfig
    seed: int
    path: Path
    over: Callable[[], None]


def table_config(settings: protocol.Settings, table: TableConfig) -> TableConfig:
    """Return a table with a room's settings; one side without drones makes a practice arena.

    Raises ConfigError if there is no such game.
    """
    sizes = (settings.red, settings.blue)
    rules = table.game
    game = rules.replace(
        controllers=(_system(settings.red_system, RED, rules), _system(settings.blue_system, BLUE, rules)),
        drones_per_team=sizes,
        time_limit=settings.time_limit if settings.time_limit is not None else _UNTIMED,
        capture=rules.capture.replace(enabled=rules.capture.enabled and min(sizes) > 0),
    )
    majority = settings.majority and min(sizes) > 0
    return table.replace(game=game, mapping=settings.mapping or table.mapping, speed=settings.speed, majority=majority)


def cost_of(config: TableConfig) -> float:
    """Return what a game takes of the server, in games of 10 against 10 by `ergodic` at normal speed."""
    cost = _PLAIN_COST
    for size, system in zip(config.game.team_sizes, config.game.team_systems, strict=True):
        team, drone = _COSTS.get(system.name, _UNKNOWN_COST)
        cost += team * (size > 0) + drone * size
    return round(config.speed * cost, 3)


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
        majority=config.majority,
        red_system=config.game.team_controllers[RED],
        blue_system=config.game.team_controllers[BLUE],
    )
