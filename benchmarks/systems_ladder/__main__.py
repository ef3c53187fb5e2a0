"""Says which control system wins more often, and sooner, against the same adversary, and what each can.

python -m benchmarks.systems_ladder           # what was stopped goes on where it was
python -m benchmarks.systems_ladder --quick   # whether all of it works
"""

from __future__ import annotations

import shlex
import sys
from pathlib import Path

import tyro

from benchmarks.systems_ladder.contest import TRACKS
from benchmarks.systems_ladder.making import SystemsConfig, make
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.player_options import REGISTRY
from swarm_pz.cli.report import progress
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check
from swarm_pz.errors import SwarmError
from swarm_pz.evaluation.workers import open_pool
from swarm_pz.files import check_folder

COMMAND = ("python", "-m", "benchmarks.systems_ladder")


def systems(
    only: tuple[str, ...] = (),
    tracks: tuple[str, ...] = tuple(TRACKS),
    games: int = 40,
    pilot_games: int = 20,
    starts: int = 20,
    seconds: int = 30,
    seed: int = 0,
    processes: int = 2,
    ray: str | None = None,
    quick: bool = False,
    folder: Path = Path("runs/systems"),
    out: Path | None = None,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Compare control systems, each commanded by the best of its scripts and the policy that was trained for it.

    Args:
        only: Control systems; all that are installed if none.
        tracks: The rules that they play by.
        games: Games of every two, even, half from each side.
        pilot_games: Games of every player against the adversary, to choose the best of each system.
        starts: Games behind each trait.
        seconds: How long a team flies before it is judged.
        seed: Seed of all games.
        processes: Processes that share the games.
        ray: Share them among the machines of a Ray cluster instead: auto, or HOST:PORT.
        quick: Play few and short games, which say whether all of it works, and nothing about the systems.
        folder: Keeps games and traits.
        out: Where systems.md and its pictures go; the folder, if not given.
        game: The rules. Who flies, and how slowly, is not for them to say: the tracks do.
    """
    config = SystemsConfig(
        systems=only,
        tracks=tracks,
        games=games,
        pilot_games=pilot_games,
        starts=starts,
        seconds=seconds,
        seed=seed,
        game=game,
    )
    usual = GameConfig()
    expected = f"left at {usual.controllers!r}: each system flies in turn, and --only says which"
    check(game.controllers == usual.controllers, "game.controllers", game.controllers, expected)
    slowest = game.dynamics.min_speed
    check(slowest == 0.0, "game.dynamics.min_speed", slowest, f"left at 0: the tracks are {', '.join(TRACKS)}")
    out = folder if out is None else out
    for one in (folder, out):
        check_folder(one)
    command = shlex.join([*COMMAND, *sys.argv[1:]])
    with (
        goes_on_with(command),
        open_pool(processes, ray) as pool,
        progress() as show,
        stops_at_safe_points() as should_stop,
    ):
        config = config.quick if quick else config
        results = make(config, folder, out, pool=pool, progress=show, should_stop=should_stop, command=command)
    for track, told in results["tracks"].items():
        print(f"{track}: a mixture wins {100 * told['game']['guaranteed']:.0f} % against anybody")
        for row in told["standings"]:
            print(f"  {row['entrant']:<32} wins {100 * row['against_all']:3.0f} % against all others")
    print(f"systems: {out / 'systems.md'}")


def main() -> None:
    """Run the command; errors of this project end it with one line."""
    try:
        config = (tyro.conf.AvoidSubcommands,)
        tyro.cli(systems, prog=" ".join(COMMAND), config=config, registry=REGISTRY)
    except SwarmError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
