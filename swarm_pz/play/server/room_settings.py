"""A room's settings, as clients know them, and the plan of its games."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from swarm_pz.config import BLUE, RED
from swarm_pz.config.registry import system_of
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig

_PLAIN_COST = 0.8
"""Cost of any game for the server, in games of 10 against 10 by `ergodic` at normal speed."""
_ERGODIC_COST, _OTHER_COST = (0.0, 0.01), (1.5, 0.06)
"""Extra cost of a team, and of each of its drones, by `ergodic` or another control system, as measured."""
POLICY_COST = 0.25
"""Extra cost of a policy that plays or helps in a room."""
_UNTIMED = 1e6
"""Seconds that stand for no time limit."""


@dataclass(frozen=True, kw_only=True)
class Hosted:
    """A study's game: it begins when its participants are there, and goes on even if nobody sees it.

    - `path`: of the recording.
    - `over`: called when the game has ended.
    """

    path: Path
    over: Callable[[], None]


@dataclass(frozen=True, kw_only=True)
class RoomPlan:
    """The games of a room.

    - `seed`: of the next game's start; None draws one.
    - `once`: the room has a single game.
    - `lesson`: the games are lessons, and their recordings say so.
    """

    config: TableConfig
    seed: int | None = None
    once: bool = False
    lesson: bool = False
    hosted: Hosted | None = None


def table_config(settings: protocol.Settings, table: TableConfig) -> TableConfig:
    """Return a table with a room's settings; without drones on one side, there are no captures.

    Raises ConfigError if the settings are not valid.
    """
    sizes = (settings.red, settings.blue)
    rules = table.game
    named = zip((settings.red_system, settings.blue_system), rules.team_systems, strict=True)
    # A system of the table keeps its parameters.
    kept = {system.name: system for system in reversed(rules.team_systems)}
    game = rules.replace(
        controllers=tuple(own if name is None else kept.get(name) or system_of(name) for name, own in named),
        drones_per_team=sizes,
        time_limit=settings.time_limit if settings.time_limit is not None else _UNTIMED,
        capture=rules.capture.replace(enabled=rules.capture.enabled and min(sizes) > 0),
    )
    majority = settings.majority and min(sizes) > 0
    return table.replace(game=game, speed=settings.speed, majority=majority)


def cost_of(config: TableConfig) -> float:
    """Return the cost of a game for the server, in games of 10 against 10 by `ergodic` at normal speed."""
    cost = _PLAIN_COST
    for size, system in zip(config.game.team_sizes, config.game.team_systems, strict=True):
        team, drone = _ERGODIC_COST if system.name == "ergodic" else _OTHER_COST
        cost += team * (size > 0) + drone * size
    return round(config.speed * cost, 3)


def settings_of(config: TableConfig) -> protocol.Settings:
    """Return a table's settings as clients know them."""
    red, blue = config.game.team_sizes
    limit = config.game.time_limit
    return protocol.Settings(
        red=red,
        blue=blue,
        time_limit=limit if limit < _UNTIMED else None,
        speed=config.speed,
        majority=config.majority,
        red_system=config.game.team_controllers[RED],
        blue_system=config.game.team_controllers[BLUE],
    )
