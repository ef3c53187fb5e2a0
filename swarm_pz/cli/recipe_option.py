"""The option ``--recipe``, which the commands that train one tactic have in common."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from typing import Any

from swarm_pz.cli.preset_option import take_name
from swarm_pz.config.base import check_choice
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, TrainConfig


def take(arguments: Sequence[str]) -> tuple[TrainConfig | None, list[str]]:
    """Take ``--recipe NAME`` out of a command line; return its settings, None if there is none, and the rest.

    Raises
    ------
    ConfigError
        If there is no such recipe.
    """
    name, rest = take_name("--recipe", RECIPES, arguments)
    if name is None:
        return None, rest
    check_choice(name, "--recipe", tuple(RECIPES))
    return RECIPES[name], rest


def begin_with(recipe: TrainConfig, function: Callable[..., None]) -> Callable[..., None]:
    """Return a command whose training has, unless options say otherwise, the settings of a recipe.

    Raises
    ------
    ConfigError
        When it is called, if the command does not train by such settings.
    """
    signature = inspect.signature(function)
    trains = {name: one for name, one in signature.parameters.items() if isinstance(one.default, TrainConfig)}
    begun = {name: one.replace(default=recipe.replace(threads=one.default.threads)) for name, one in trains.items()}

    @functools.wraps(function)
    def command(*given: Any, **named: Any) -> None:
        if not trains:
            raise ConfigError("this command trains by no recipe: leave out --recipe, which train and sweep have")
        function(*given, **named)

    command.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[begun.get(name, one) for name, one in signature.parameters.items()]
    )
    return command
