"""The options ``--preset`` and ``--recipe``: what is configured begins with rules, or with a training, of that name."""

from __future__ import annotations

import argparse
import functools
import inspect
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from swarm_pz.config import PRESETS, GameConfig
from swarm_pz.config.base import Config, check_choice
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, TrainConfig


def take_preset(arguments: Sequence[str]) -> tuple[GameConfig | None, list[str]]:
    """Take ``--preset NAME`` out of a command line; return its rules, None if there is none, and the rest.

    Raises
    ------
    ConfigError
        If there is no such preset.
    """
    name, rest = take_name("--preset", PRESETS, arguments)
    return None if name is None else GameConfig.preset(name), rest


def take_recipe(arguments: Sequence[str]) -> tuple[TrainConfig | None, list[str]]:
    """Take ``--recipe NAME`` out of a command line; return its settings, None if there is none, and the rest.

    Raises
    ------
    ConfigError
        If there is no such recipe.
    """
    name, rest = take_name("--recipe", RECIPES, arguments)
    if name is not None:
        check_choice(name, "--recipe", tuple(RECIPES))
    return None if name is None else RECIPES[name], rest


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


def begin_with_preset(preset: GameConfig, function: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose rules are, unless options say otherwise, those of a preset; without any it is refused."""
    refusal = "this command has no rules that a preset could begin: leave out --preset"
    return _begin_with(function, Config, lambda given: _with_rules(given, preset), refusal)


def begin_with_recipe(recipe: TrainConfig, function: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose training has, unless options say otherwise, the settings of a recipe, or is refused."""
    refusal = "this command trains by no recipe: leave out --recipe, which train and sweep have"
    return _begin_with(function, TrainConfig, lambda given: recipe.replace(threads=given.threads), refusal)


def _begin_with(
    function: Callable[..., None], kind: type, change: Callable[[Any], Any], refusal: str
) -> Callable[..., None]:
    """Return a command whose configurations of a kind are changed, or that raises a ConfigError if it has none."""
    signature = inspect.signature(function)
    parameters = [
        one.replace(default=change(one.default)) if isinstance(one.default, kind) else one
        for one in signature.parameters.values()
    ]
    has_any = any(isinstance(one.default, kind) for one in parameters)

    @functools.wraps(function)
    def command(*given: Any, **named: Any) -> None:
        if not has_any:
            raise ConfigError(refusal)
        function(*given, **named)

    command.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    return command


def _with_rules(value: Any, preset: GameConfig) -> Any:
    """Put into a configuration, or into the games that it holds, what a preset has of its own."""
    if isinstance(value, GameConfig):
        standard = GameConfig()
        names = [name for name in preset.to_dict() if getattr(preset, name) != getattr(standard, name)]
        return value.replace(**{name: getattr(preset, name) for name in names})
    parts = {name: getattr(value, name) for name in value.to_dict()}
    return value.replace(
        **{name: _with_rules(part, preset) for name, part in parts.items() if isinstance(part, Config)}
    )
