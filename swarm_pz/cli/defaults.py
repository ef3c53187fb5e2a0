"""Options that change the defaults of a command: ``--preset``, ``--recipe``, and ``--resume`` of a training."""

from __future__ import annotations

import argparse
import functools
import inspect
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, check_choice
from swarm_pz.errors import CheckpointError, ConfigError, require_extra
from swarm_pz.training.config import MAY_CHANGE, RECIPES, TrainConfig

Command = Callable[..., None]


def take(option: str, names: Iterable[str], arguments: Sequence[str]) -> tuple[str | None, list[str]]:
    """Take an option with a name out of a command line; return the name, None without the option, and the rest."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument(option, dest="name")
    try:
        known, rest = parser.parse_known_args(arguments)
    except argparse.ArgumentError as error:
        raise ConfigError(f"{option} expects one of {', '.join(names)}") from error
    return known.name, rest


def with_preset(command: Command, name: str) -> Command:
    """Return a command whose rules are those of a preset, unless options say otherwise."""
    preset, standard = GameConfig.preset(name), GameConfig()
    changes = {key: getattr(preset, key) for key in preset.to_dict() if getattr(preset, key) != getattr(standard, key)}

    def put(value: Any) -> Any:
        """Put what the preset changes into a game, or into the games inside a configuration."""
        if isinstance(value, GameConfig):
            return value.replace(**changes)
        parts = {key: getattr(value, key) for key in value.to_dict()}
        return value.replace(**{key: put(part) for key, part in parts.items() if isinstance(part, Config)})

    return _with_defaults(
        command, Config, put, "this command has no rules that a preset could begin: leave out --preset"
    )


def with_recipe(command: Command, name: str) -> Command:
    """Return a command whose training has the settings of a recipe, unless options say otherwise."""
    check_choice(name, "--recipe", tuple(RECIPES))
    return _with_defaults(
        command,
        TrainConfig,
        lambda usual: RECIPES[name].replace(threads=usual.threads),
        "this command trains by no recipe: leave out --recipe, which train and sweep have",
    )


def _with_defaults(command: Command, kind: type[Config], change: Callable[[Any], Any], refusal: str) -> Command:
    """Return a command with other defaults where they are of a kind; without one, it refuses when it is called."""
    parameters = inspect.signature(command).parameters.values()
    changed = {one.name: change(one.default) for one in parameters if isinstance(one.default, kind)}

    def verify(_: dict[str, Any]) -> None:
        if not changed:
            raise ConfigError(refusal)

    return _replaced(command, changed, verify)


def _replaced(command: Command, defaults: dict[str, Any], verify: Callable[[dict[str, Any]], None]) -> Command:
    """Return a command with other defaults, which calls `verify` with its arguments before it does anything."""
    signature = inspect.signature(command)
    parameters = [one.replace(default=defaults.get(one.name, one.default)) for one in signature.parameters.values()]
    signature = signature.replace(parameters=parameters)

    @functools.wraps(command)
    def verified(*given: Any, **named: Any) -> None:
        bound = signature.bind(*given, **named)
        bound.apply_defaults()
        verify(bound.arguments)
        command(*given, **named)

    verified.__signature__ = signature  # type: ignore[attr-defined]
    return verified


def with_run(command: Command, first: Path, arguments: Sequence[str]) -> Command:
    """Return a command whose settings are those of the run that it resumes, unless options say otherwise.

    `first` is the folder of its first run, if none is given. Options that contradict the run raise a ConfigError when
    it is called, and settings that cannot be read a CheckpointError.
    """
    require_extra("torch", "train")
    from swarm_pz.training import folders

    out, _ = take("--out", ["a folder's name"], arguments)
    given = Path(out) if out is not None else None
    folder = folders.choose(given, first, resume=True, overwrite="--overwrite" in arguments)
    path = folder / folders.SETTINGS
    if not path.is_file():  # the command says what is missing
        return command
    parameters = inspect.signature(command).parameters.values()
    ((name, begun),) = [(one.name, one.default) for one in parameters if isinstance(one.default, Config)]
    try:
        kept = type(begun).from_dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise CheckpointError(
            f"the run's settings in {path} cannot be read: {error}; put the file back, or begin the run "
            "again with --overwrite"
        ) from error
    # A recipe or a preset is not applied again, but must not contradict the run, either.
    usual = inspect.signature(inspect.unwrap(command)).parameters[name].default
    said = [path for path, _, _ in _differences(usual, begun)]
    contradicted = [one for one in _differences(kept, begun) if one[0] in said]

    def verify(arguments: dict[str, Any]) -> None:
        for path, was, now in (*_differences(kept, arguments[name]), *contradicted):
            if path.split(".")[-1] not in MAY_CHANGE:
                raise ConfigError(
                    f"{folder} was begun with {path} {was!r}, and this line says --{path.replace('_', '-')} {now!r}: "
                    "leave that out, or begin another run without --resume"
                )

    return _replaced(command, {name: kept}, verify)


def _differences(one: Config, other: Config) -> Iterator[tuple[str, Any, Any]]:
    """Yield where two configurations differ: the path, and both values."""
    was, now = dict(_leaves(one.to_dict())), dict(_leaves(other.to_dict()))
    for path in dict.fromkeys([*was, *now]):
        if was.get(path) != now.get(path):
            yield path, was.get(path), now.get(path)


def _leaves(plain: dict[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in plain.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{before}{name}.")
        else:
            yield before + name, value
