"""The command ``dataset``: games to learn from."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro

from swarm_pz.cli.player_options import Players
from swarm_pz.cli.printing import printable
from swarm_pz.cli.report import command, print_rules, progress
from swarm_pz.cli.table import need_play
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check
from swarm_pz.errors import CommandError, require_extra
from swarm_pz.spaces.formats import FormatOptions


def dataset(
    players: Players = (),
    /,
    recordings: tuple[Path, ...] = (),
    view: Annotated[str, tyro.conf.arg(metavar="PLAYER")] = "person",
    each: bool = False,
    out: Path | None = None,
    name: str | None = None,
    games: int = 40,
    seed: int = 0,
    side: Literal["random", "red", "blue"] = "random",
    action: Literal["normalised", "command", "discrete"] = "normalised",
    action_cells: int | None = None,
    flatten_actions: bool = False,
    observation_dtype: Literal["uint8", "float32"] = "uint8",
    channels_last: bool = False,
    threads: int = 2,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Write games as a Minari dataset: what a player saw and did, and what came of it; see docs/tutorials/cloning.md.

    Args:
        players: The player whose views are written, and those whom it plays in turn: names of policies, or folders
            that training wrote.
        recordings: Files that the table wrote, or folders of these, to write instead of playing.
        view: Whose views of recordings: person, program, policy, or a name or label.
        each: Write the views of every player, against all others, each as a dataset of its own.
        out: Folder of datasets; Minari's own if not given.
        name: The dataset's id, with a version; swarm-PLAYER-v0 if not given.
        games: Games to play; the game of an episode is that of env.reset with its seed.
        seed: Seed of the first game; the next one has the next.
        side: Where the player sits; drawn anew for every game if random.
        action: How actions are written: in [-1, 1]; as the control system takes them; by number.
        action_cells: Cells a side of an action, if it is a density; as many as the command's if not given.
        flatten_actions: Write actions as vectors.
        observation_dtype: How brightness is written.
        channels_last: Write images as (rows, columns, channels).
        threads: Threads that share the games.
        game: The rules; of recordings, which have their own, what observations show.
    """
    require_extra("minari", "data")
    options: FormatOptions = {
        "action": action,
        "action_cells": action_cells,
        "flatten_actions": flatten_actions,
        "observation_dtype": observation_dtype,
        "channels_last": channels_last,
    }
    if bool(players) == bool(recordings):
        raise CommandError(
            "name a player and opponents, or else give --recordings; got " + ("both" if players else "neither")
        )
    if recordings:
        _of_recordings(recordings, view, out, name, game, options)
        return
    check(view == "person", "view", view, "left out without recordings: the first player's views are written")
    check(len(players) >= 2, "players", players, "at least two: whose views, and whom it plays")
    check(not (each and name is not None), "name", name, "left out with each: every dataset is named by its player")
    check(not each or len(set(players)) == len(players), "players", players, "different ones with each")
    from swarm_pz import policies
    from swarm_pz.datasets.folder import Target, name_for
    from swarm_pz.datasets.matches import record_match

    pairings = (
        [(one, [other for other in players if other != one]) for one in players]
        if each
        else [(players[0], players[1:])]
    )
    for place, player in enumerate(players):  # before anything is played
        policies.load(player, game, game.team_systems[1 if place and not each else 0])
    for one, _ in pairings:
        Target(name=name if name is not None else name_for(one), root=out)
    for one, others in pairings:
        with progress() as show:
            folder = record_match(
                one,
                others,
                name=name,
                root=out,
                games=games,
                seed=seed,
                side=side,
                config=game,
                threads=threads,
                command=command(),
                progress=show,
                **options,
            )
        _print_dataset(folder)
    print_rules(game)


def _of_recordings(
    recordings: tuple[Path, ...],
    view: str,
    out: Path | None,
    name: str | None,
    game: GameConfig,
    options: FormatOptions,
) -> None:
    need_play()
    from swarm_pz.datasets.tables import record_table

    observation = game.observations[0]
    check(
        game.replace(observation=GameConfig().observation) == GameConfig(),
        "game",
        "other rules",
        "left out but for its observation: recordings have rules of their own",
    )
    with progress("recordings", "reading") as show:
        folder = record_table(
            recordings,
            player=view,
            name=name,
            root=out,
            observation=observation,
            command=command(),
            progress=show,
            left_out=lambda line: print(f"left out: {printable(line)}", file=sys.stderr),
            **options,
        )
    _print_dataset(folder)


def _print_dataset(folder: Path) -> None:
    """Say what a dataset holds, and where it is."""
    told = require_extra("minari.dataset.minari_storage", "data").MinariStorage.read_raw_metadata(folder / "data")
    print(f"{told['dataset_id']}: {told['total_episodes']} episodes, {told['total_steps']} steps")
    print(f"dataset: {folder / 'data'}")
