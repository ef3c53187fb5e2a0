"""The option ``--preset``, which all commands with rules have in common."""

from __future__ import annotations

import argparse
import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from swarm_pz.config import PRESETS, GameConfig
from swarm_pz.config.base import Config
from swarm_pz.errors import ConfigError


def take(arguments: Sequence[str]) -> tuple[GameConfig | None, list[str]]:
    """Take ``--preset NAME`` out of a command line; return its rules, None if there is none, and the rest.

    Raises
    ------
    ConfigError
        If there is no such preset.
    """
    name, rest = take_name("--preset", PRESETS, arguments)
    return None if name is None else GameConfig.preset(name), rest


def take_name(option: str, names: Iterable[str], arguments: Sequence[str]) -> tuple[str | None, list[str]]:
    """Take an option with a name out of a command line; return the name, None if it is not there, and the rest.

    Raises
    ------
    ConfigError
        If the option is there without a name.
    """
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument(option, dest="name")
    try:
        known, rest = parser.parse_known_args(arguments)
    except argparse.ArgumentError as error:
        raise ConfigError(f"{option} expects one of {', '.join(names)}") from error
    return known.name, rest


def begin_with(preset: GameConfig, function: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose rules are, unless options say otherwise, those of a preset.

    Raises
    ------
    ConfigError
        When it is called, if the command has no rules.
    """
    signature = inspect.signature(function)
    parameters = [
        parameter.replace(default=_with_rules(parameter.default, preset)) for parameter in signature.parameters.values()
    ]
    has_rules = any(isinstance(parameter.default, Config) for parameter in parameters)

    @functools.wraps(function)
    def command(*given: Any, **named: Any) -> None:
        if not has_rules:
            raise ConfigError("this command has no rules that a preset could begin: leave out --preset")
        function(*given, **named)

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
