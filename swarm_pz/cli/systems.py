"""The command that compares control systems: ``systems``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.report import command, print_rules, progress
from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.files import check_folder


def systems(
    only: Annotated[tuple[str, ...], tyro.conf.arg(metavar="SYSTEM ...")] = (),
    games: int = 40,
    pilot_games: int = 20,
    starts: int = 20,
    seconds: int = 30,
    seed: int = 0,
    processes: int = 2,
    quick: bool = False,
    folder: Path = Path("runs/systems"),
    out: Path | None = None,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Say which control system wins more often, and sooner, against the same adversary, and what each can.

    Each is commanded by its best script and by the policy that was trained for it. What was stopped goes on where
    it was; more games may be asked for later.

    Args:
        only: Control systems; all that are installed if none.
        games: Games of every two, even, half from each side.
        pilot_games: Games of every script against the adversary, to choose the best of each system.
        starts: Games behind each trait.
        seconds: How long a team flies before it is judged.
        seed: Seed of all games.
        processes: Processes that share the games.
        quick: Play few and short games, which say whether all of it works, and nothing about the systems.
        folder: Keeps games and traits.
        out: Where systems.md and its pictures go; the folder, if not given.
        game: The rules; who flies is not for them to say.
    """
    for module in ("choix", "filelock", "matplotlib.figure"):
        require_extra(module, "ladder")
    from swarm_pz.figures.systems.making import SystemsConfig, make

    config = SystemsConfig(
        systems=only, games=games, pilot_games=pilot_games, starts=starts, seconds=seconds, seed=seed, game=game
    )
    out = folder if out is None else out
    for one in (folder, out):
        check_folder(one)
    print_rules(game)
    with goes_on_with(command()), progress() as show, stops_at_safe_points() as asked:
        results = make(
            config.quick if quick else config,
            folder,
            out,
            processes=processes,
            progress=show,
            asked=asked,
            command=command(),
        )
    for row in results["standings"]:
        low, high = row["win_rate_ci95"]
        print(
            f"{row['entrant']:<32} won {row['wins']:>3} drawn {row['draws']:>3} lost {row['losses']:>3} "
            f"({100 * low:.0f} to {100 * high:.0f} %), {row['time_to_win']['mean']:.0f} s to a win"
        )
    print(f"systems: {out / 'systems.md'}")
