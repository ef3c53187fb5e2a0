"""The command line: ``swarm-pz train | league | evaluate | tournament | play | replay | study | ...``.

The one place that knows every part of the project; each command imports what it needs, so that
``--help`` is quick and a missing extra is named only where it is wanted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

from swarm_pz.config import PRESETS
from swarm_pz.errors import SwarmError

try:
    import tyro
except ImportError:  # the entry point is installed even without the extra
    sys.exit(str(SwarmError("swarm-pz's commands need an extra: pip install 'swarm-pz[cli]'")))

from swarm_pz.cli import compare, evidence, learn, machine, presets, report, table


def main(arguments: list[str] | None = None) -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    commands: dict[str, Callable[..., None]] = {
        "train": learn.train,
        "league": learn.league,
        "evaluate": compare.evaluate,
        "tournament": compare.tournament,
        "play": table.play,
        "replay": table.replay,
        "study": table.study,
        "figures": evidence.figures,
        "policies": compare.list_policies,
        "render": machine.render,
        "diagnose": machine.diagnose,
        "bench": machine.bench,
        "warmup": machine.warmup,
    }
    arguments = sys.argv[1:] if arguments is None else arguments
    report.arguments.set(arguments)
    try:
        preset, rest = presets.take(arguments)
        tyro.extras.subcommand_cli_from_dict(
            commands if preset is None else {name: presets.begin_with(preset, commands[name]) for name in commands},
            prog="swarm-pz",
            description="Swarm against swarm: train, measure, watch and play tactics. With --preset NAME, the "
            f"rules of a command that has any begin with those of a preset: {', '.join(PRESETS)}.",
            args=rest,
            config=(tyro.conf.AvoidSubcommands,),
        )
    except (SwarmError, OSError) as error:
        print(f"swarm-pz: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
