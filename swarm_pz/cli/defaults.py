"""Options that change the defaults of a command: ``--preset`` and ``--recipe``."""

from __future__ import annotations

import argparse
import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, check_choice
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, TrainConfig

Command = Callable[..., None]


def take(option: str, names: Iterable[str], arguments: Sequence[str]) -> tuple[str | None, list[str]]:
    """Remove an option from a command line; return its value, or None without the option, and the rest."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument(option, dest="name")
    try:
        known, rest = parser.parse_known_args(arguments)
    except argparse.ArgumentError as error:
        raise ConfigError(f"{option} expects one of {', '.join(names)}") from error
    return known.name, rest


def with_preset(command: Command, name: str) -> Command:
    """Return a command with the rules of a preset as defaults."""
    preset, standard = GameConfig.preset(name), GameConfig()
    changes = {key: getattr(preset, key) for key in preset.to_dict() if getattr(preset, key) != getattr(standard, key)}

    def put(value: Any) -> Any:
        """Apply the preset's changes to a game, or to the games inside a configuration."""
        if isinstance(value, GameConfig):
            return value.replace(**changes)
        parts = {key: getattr(value, key) for key in value.to_dict()}
        return value.replace(**{key: put(part) for key, part in parts.items() if isinstance(part, Config)})

    return _with_defaults(
        command, Config, put, "this command has no rules that a preset could begin: leave out --preset"
    )


def with_recipe(command: Command, name: str) -> Command:
    """Return a command with the settings of a recipe as defaults, except for `threads`."""
    check_choice(name, "--recipe", tuple(RECIPES))
    return _with_defaults(
        command,
        TrainConfig,
        lambda usual: RECIPES[name].replace(threads=usual.threads),
        "this command trains by no recipe: leave out --recipe, which train and sweep have",
    )


def _with_defaults(command: Command, kind: type[Config], change: Callable[[Any], Any], refusal: str) -> Command:
    """Return a command with changed defaults of type `kind`; if it has none, calls raise a ConfigError."""
    signature = inspect.signature(command)
    defaults = {name: one.default for name, one in signature.parameters.items()}
    changed = {name: change(default) for name, default in defaults.items() if isinstance(default, kind)}

    @functools.wraps(command)
    def changed_command(*arguments: Any, **keywords: Any) -> None:
        if not changed:
            raise ConfigError(refusal)
        command(*arguments, **keywords)

    parameters = [one.replace(default=changed.get(name, one.default)) for name, one in signature.parameters.items()]
    changed_command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return changed_command
