"""A room's settings, as clients know them, and the table that they ask for."""

from __future__ import annotations

from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig

_UNTIMED = 1e6
"""Seconds that stand for no time limit."""


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
        drones_per_team=sizes,
        time_limit=settings.time_limit if settings.time_limit is not None else _UNTIMED,
        capture=rules.capture.replace(enabled=rules.capture.enabled and min(sizes) > 0),
    )
    return table.replace(game=game, mapping=settings.mapping, speed=settings.speed)


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
    )
