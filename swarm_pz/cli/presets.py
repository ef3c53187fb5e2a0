"""The option ``--preset``, which all commands with rules have in common."""

from __future__ import annotations

import argparse
import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.settings import Config


def take(arguments: Sequence[str]) -> tuple[GameConfig, list[str]]:
    """Take ``--preset NAME`` out of a command line; return its rules, those of `paper` if there is none, and the rest.

    Raises
    ------
    ConfigError
        If there is no such preset.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--preset", default="paper")
    known, rest = parser.parse_known_args(arguments)
    return GameConfig.preset(known.preset), rest


def begin_with(preset: GameConfig, function: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose rules are, unless options say otherwise, those of a preset."""
    signature = inspect.signature(function)

    @functools.wraps(function)
    def command(*given: Any, **named: Any) -> None:
        function(*given, **named)

    parameters = [
        parameter.replace(default=_with_rules(parameter.default, preset)) for parameter in signature.parameters.values()
    ]
    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return command


def _with_rules(value: Any, preset: GameConfig) -> Any:
    """Put into a configuration, or into the games that it holds, what a preset has of its own."""
    if isinstance(value, GameConfig):
        standard = GameConfig()
        names = [name for name in preset.to_dict() if getattr(preset, name) != getattr(standard, name)]
        return value.replace(**{name: getattr(preset, name) for name in names})
    if isinstance(value, Config):
        parts = {name: getattr(value, name) for name in value.to_dict()}
        changed = {name: _with_rules(part, preset) for name, part in parts.items() if isinstance(part, Config)}
        return value.replace(**changed)
    return value
