"""The option ``--resume`` of ``train`` and ``league``: the run goes on by its own settings, which its folder keeps."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from swarm_pz.cli.named_options import take_name
from swarm_pz.config.base import Config
from swarm_pz.errors import CheckpointError, ConfigError, require_extra
from swarm_pz.training.config import MAY_CHANGE


def begin_with(function: Callable[..., None], first: Path, arguments: Sequence[str]) -> Callable[..., None]:
    """Return a command whose settings are, unless options say otherwise, those of the run that it goes on with.

    Parameters
    ----------
    function : callable
        With one parameter whose default is a configuration.
    first : Path
        The first of the folders that it takes by itself.
    arguments : sequence of str
        Of the command.

    Raises
    ------
    ConfigError
        When it is called, if options contradict the run in what may not change.
    CheckpointError
        If the settings cannot be read.
    """
    require_extra("torch", "train")
    from swarm_pz.training import folders

    out, _ = take_name("--out", ["a folder's name"], arguments)
    given = Path(out) if out is not None else None
    folder = folders.choose(given, first, resume=True, overwrite="--overwrite" in arguments)
    path = folder / folders.SETTINGS
    if not path.is_file():  # the command says what is missing
        return function
    signature = inspect.signature(function)
    ((name, usual),) = [
        (key, one.default) for key, one in signature.parameters.items() if isinstance(one.default, Config)
    ]
    try:
        kept = type(usual).from_dict(json.loads(path.read_text()))
    except (OSError, ValueError, TypeError, RecursionError) as error:
        raise CheckpointError(
            f"the run's settings in {path} cannot be read: {error}; put the file back, or begin the run "
            "again with --overwrite"
        ) from error
    parameters = [one.replace(default=kept) if key == name else one for key, one in signature.parameters.items()]
    signature = signature.replace(parameters=parameters)
    # What a recipe or a preset says is not taken, but must not contradict, either.
    begun = inspect.signature(inspect.unwrap(function)).parameters[name].default
    said = [path for path, _, _ in _differences(begun, usual)]
    contradicted = [(path, was, now) for path, was, now in _differences(kept, usual) if path in said]

    @functools.wraps(function)
    def command(*given: Any, **named: Any) -> None:
        bound = signature.bind(*given, **named)
        bound.apply_defaults()
        for path, was, now in (*_differences(kept, bound.arguments[name]), *contradicted):
            if path.split(".")[-1] not in MAY_CHANGE:
                raise ConfigError(
                    f"{folder} was begun with {path} {was!r}, and this line says --{path.replace('_', '-')} {now!r}: "
                    "leave that out, or begin another run without --resume"
                )
        function(*given, **named)

    command.__signature__ = signature  # type: ignore[attr-defined]
    return command


def _differences(one: Config, other: Config) -> Iterator[tuple[str, Any, Any]]:
    """Yield what two configurations do not have in common: its path, and both values."""
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
