"""The command line: ``swarm-pz train | league | evaluate | tournament | export | play | replay | ...``.

Commands import what they need when they are called, so that ``--help`` is quick and a missing extra is named only by
the command that needs it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

import swarm_pz
from swarm_pz.config import PRESETS
from swarm_pz.errors import CommandError, MissingExtraError, Stopped, SwarmError, nearest, require_extra
from swarm_pz.files import FULL, explain
from swarm_pz.policy import allow_files
from swarm_pz.training.config import RECIPES

try:
    for module in ("tyro", "rich"):
        require_extra(module, "cli")
except MissingExtraError as missing:  # the entry point is installed even without the extra
    sys.exit(f"swarm-pz: {missing}")

import tyro

from swarm_pz.cli import compare, defaults, learn, machine, play, report, standard, studies
from swarm_pz.cli.player_options import REGISTRY
from swarm_pz.cli.printing import printable


def commands_of(program: str) -> dict[str, Callable[..., None]]:
    """Return the commands of ``swarm-pz`` or of ``swarm-pz study``, by name."""
    if program == "swarm-pz study":
        of_studies = (studies.plan, studies.power, studies.run, studies.status, studies.withdraw, studies.tables)
        return {command.__name__: command for command in (*of_studies, studies.export)}
    commands: tuple[Callable[..., None], ...] = (
        learn.train, learn.sweep, learn.league,
        compare.evaluate, compare.tournament, compare.season, standard.benchmark,
        learn.export, play.play, play.replay, play.site,
        compare.policies, machine.render, machine.bench, machine.warmup,
    )  # fmt: skip
    by_name = {command.__name__: command for command in commands}
    return by_name | {"study": studies.run}  # for the list of commands; it has its own


ABOUT = (
    "Swarm against swarm: train, measure, watch and play tactics. --preset NAME sets the default rules of any command "
    f"that has rules: {', '.join(PRESETS)}. --recipe NAME sets the default settings of train and sweep: "
    f"{', '.join(RECIPES)}."
)
STUDY_ABOUT = "Studies with people, each described by one file; see docs/studies.md."


def main(arguments: list[str] | None = None) -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments == ["--version"]:
        print(f"swarm-pz {swarm_pz.__version__}")
        return
    report.arguments.set(arguments)
    allow_files(arguments)
    try:
        _run(arguments)
    except SwarmError as error:
        print("swarm-pz: " + "\n".join(map(printable, str(error).split("\n"))), file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:  # the reader of the output has closed it
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


def _run(arguments: list[str]) -> None:
    recipe, words = defaults.take("--recipe", RECIPES, arguments)
    preset, words = defaults.take("--preset", PRESETS, words)
    program, about = "swarm-pz", ABOUT
    if words[:1] == ["study"]:
        program, about, words = "swarm-pz study", STUDY_ABOUT, words[1:]
    commands = commands_of(program)
    if recipe is not None:
        commands = {name: defaults.with_recipe(function, recipe) for name, function in commands.items()}
    if preset is not None:
        commands = {name: defaults.with_preset(function, preset) for name, function in commands.items()}
    config = (tyro.conf.AvoidSubcommands,)
    if not words or words[0].startswith("-"):
        tyro.extras.subcommand_cli_from_dict(
            commands, prog=program, description=about, args=words, config=config, registry=REGISTRY
        )
        return
    name, *words = words  # errors are then about this command alone
    if name not in commands:
        of = program.removeprefix("swarm-pz").lstrip()
        raise CommandError(f"there is no command {of}{of and ' '}{name!r}; {nearest(name, commands)}")
    function = commands[name]
    tyro.cli(function, prog=f"{program} {name}", args=words, config=config, registry=REGISTRY)
