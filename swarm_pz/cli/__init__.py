"""The command line: ``swarm-pz train | league | evaluate | tournament | export | play | replay | ...``.

The one place that knows every part of the project; each command imports what it needs, so that
``--help`` is quick and a missing extra is named only where it is wanted.
"""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable
from pathlib import Path

import swarm_pz
from swarm_pz.config import PRESETS, GameConfig
from swarm_pz.errors import CommandError, MissingExtraError, Stopped, SwarmError, nearest, require_extra
from swarm_pz.files import FULL, explain
from swarm_pz.policy import allow_files
from swarm_pz.training.config import RECIPES

try:
    require_extra("tyro", "cli")
except MissingExtraError as missing:  # the entry point is installed even without the extra
    sys.exit(f"swarm-pz: {missing}")

import tyro

from swarm_pz.cli import (
    compare,
    data,
    export,
    learn,
    machine,
    named_options,
    report,
    resume_option,
    standard,
    studies,
    table,
)
from swarm_pz.cli.printing import printable
from swarm_pz.cli.system_option import REGISTRY


def main(arguments: list[str] | None = None) -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    commands: dict[str, Callable[..., None]] = {
        "train": learn.train,
        "sweep": learn.sweep,
        "league": learn.league,
        "evaluate": compare.evaluate,
        "tournament": compare.tournament,
        "benchmark": standard.benchmark,
        "export": export.export,
        "play": table.play,
        "replay": table.replay,
        "dataset": data.dataset,
        "policies": compare.list_policies,
        "render": machine.render,
        "diagnose": machine.diagnose,
        "bench": machine.bench,
        "warmup": machine.warmup,
    }
    commands["study"] = studies.run  # for the list of commands; it has its own
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments == ["--version"]:
        print(f"swarm-pz {swarm_pz.__version__}")
        return
    report.arguments.set(arguments)
    allow_files(arguments)
    config = (tyro.conf.AvoidSubcommands,)
    try:
        recipe, rest = named_options.take_recipe(arguments)
        if recipe is not None:
            commands = {name: named_options.begin_with_recipe(recipe, function) for name, function in commands.items()}
        preset, rest = named_options.take_preset(rest)
        if preset is not None:
            commands = {name: named_options.begin_with_preset(preset, function) for name, function in commands.items()}
        if rest[:1] == ["study"]:
            _study(rest[1:], preset)
            return
        if rest and not rest[0].startswith("-"):  # so that what is wrong is said of this command alone
            name, *rest = rest
            if name not in commands:
                raise CommandError(f"there is no command {name!r}; {nearest(name, commands)}")
            _check_positional(name, commands[name], rest)
            if name in learn.RUNS and "--resume" in rest:
                commands[name] = resume_option.begin_with(commands[name], learn.RUNS[name], rest)
            tyro.cli(commands[name], prog=f"swarm-pz {name}", args=rest, config=config, registry=REGISTRY)
            return
        tyro.extras.subcommand_cli_from_dict(
            commands,
            prog="swarm-pz",
            description="Swarm against swarm: train, measure, watch and play tactics. With --preset NAME, the "
            f"rules of a command that has any begin with those of a preset: {', '.join(PRESETS)}. With --recipe NAME, "
            f"train and sweep begin with the settings of a recipe: {', '.join(RECIPES)}.",
            args=rest,
            config=config,
            registry=REGISTRY,
        )
    except SwarmError as error:
        print("swarm-pz: " + "\n".join(map(printable, str(error).split("\n"))), file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:  # whoever read what this prints has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        hint = "; what was finished before is kept: make room, and run it again" if error.errno in FULL else ""
        print(f"swarm-pz: {explain(error)}{hint}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt as interrupt:
        where = f": {interrupt}" if isinstance(interrupt, Stopped) else ""
        print(f"\nswarm-pz: stopped{where}", file=sys.stderr)
        sys.exit(130)


def _check_positional(name: str, function: Callable[..., None], words: list[str]) -> None:
    """Say how what stands by its place is written, if it is written as an option."""
    for parameter in inspect.signature(function).parameters.values():
        option = "--" + parameter.name.replace("_", "-")
        is_given = any(word == option or word.startswith(option + "=") for word in words)
        if parameter.kind is inspect.Parameter.POSITIONAL_ONLY and is_given:
            raise CommandError(
                f"{parameter.name} is written without {option}, as in: swarm-pz {name} {option[2:].upper()}"
            )


def _study(arguments: list[str], preset: GameConfig | None) -> None:
    """Run a command of studies; a preset is refused, since a study's file has its rules."""
    commands: dict[str, Callable[..., None]] = {
        "run": studies.run,
        "status": studies.status,
        "withdraw": studies.withdraw,
        "tables": studies.tables,
        "export": studies.export,
    }
    if preset is not None:
        commands = {name: named_options.begin_with_preset(preset, function) for name, function in commands.items()}
    if arguments and not arguments[0].startswith("-") and arguments[0] not in commands:
        hint = (
            "; tables of a folder of recordings are made by study tables FOLDER" if Path(arguments[0]).is_dir() else ""
        )
        raise CommandError(f"there is no command study {arguments[0]!r}; {nearest(arguments[0], commands)}{hint}")
    if arguments and arguments[0] in commands:
        name, *rest = arguments
        config = (tyro.conf.AvoidSubcommands,)
        tyro.cli(commands[name], prog=f"swarm-pz study {name}", args=rest, config=config, registry=REGISTRY)
        return
    about = "A study with people: one file says what happens; see docs/studies.md."
    tyro.extras.subcommand_cli_from_dict(commands, prog="swarm-pz study", description=about, args=arguments)
