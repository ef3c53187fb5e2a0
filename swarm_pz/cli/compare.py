"""Commands that compare: ``evaluate``, ``tournament``, ``season`` and ``policies``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from swarm_pz.cli import printing as tables
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.options import WORKERS, WorkerOptions, Workers
from swarm_pz.cli.player_options import Opponent, Player, Players, able, able_to_fly, known
from swarm_pz.cli.report import command, need, print_rules, progress
from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.files import check_file, check_folder, draft_of, write_json
from swarm_pz.policy import kind_of

if TYPE_CHECKING:
    from swarm_pz.evaluation.season import Entries

Games = Annotated[TournamentConfig, tyro.conf.arg(name="")]
_NAMED = 6
"""Maximum number of lost games that are listed; a file of results has all of them."""


def evaluate(
    policy: Player,
    /,
    opponent: Opponent = "uniform",
    games: int = 200,
    seed: int = 0,
    json: Path | None = None,
    threads: int = 2,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play a policy against an opponent and print the results.

    The policy plays each side in half of the games, with the same seeds.

    Args:
        policy: Name of a policy, a folder that training wrote, FILE.py:NAME (a tactic in a file), or exec:PROGRAM.
        opponent: The opponent, named in the same ways.
        games: Number of games; must be even.
        seed: Seed of the match.
        json: Also write the figures to this file.
        threads: Threads that share the games.
        game: The rules.
    """
    from swarm_pz.evaluation.match import play_match
    from swarm_pz.policy import load_players

    if json is not None:
        check_file(json)
    with progress() as show:
        players = load_players(policy, opponent, game)
        match = play_match(*players, games=games, seed=seed, config=game, threads=threads, progress=show)
    print_rules(game)
    tables.print_matches([match])
    if match.lost:
        lost = [f"--pair {game.pair} --side {game.side}" for game in match.lost]
        more = f", and {len(lost) - _NAMED} more (--json FILE has all)" if len(lost) > _NAMED else ""
        print(f"lost: {', '.join(lost[:_NAMED])}{more}\nwith these, and the same seed and rules, render shows a game")
    if json is not None:
        match.write(json, command())
        print(f"figures: {json}")


def tournament(
    players: Players = (),
    /,
    config: Games = TournamentConfig(),  # noqa: B008  (frozen)
    workers: WorkerOptions = WORKERS,
    out: Path = Path("runs/ladder"),
) -> None:
    """Play every player against every other and write the ladder.

    The same command continues a stopped tournament; you may add players or games later.

    Args:
        players: Names of policies, folders that training wrote, FILE.py:NAME, or exec:PROGRAM.
            Without any, all installed policies that can play.
        config: The games.
        out: Folder of the tournament: games.jsonl, index.html, ladder.json and ladder.png.
    """
    need("cli", "choix", "jinja2", "matplotlib")
    from swarm_pz import policies
    from swarm_pz.evaluation.season import Entries

    check_folder(out)
    with progress("players", "loading players"):
        field = Tournament(players or able(config.game), config, out, policies.load, command())
    _play_on(field, workers, "Tournament", Entries())


def _play_on(field: Tournament, workers: Workers, title: str, entries: Entries) -> None:
    """Play the missing games of a tournament, unless a signal stops it; then print and write the ladder and a page."""
    from swarm_pz.evaluation import ladder, season

    with (
        goes_on_with(command()),
        workers.open() as pool,
        progress() as show,
        stops_at_safe_points() as should_stop,
    ):
        field.play(progress=show, should_stop=should_stop, pool=pool)
    print_rules(field.config.game)
    with progress("players", "rating players"):
        figures = ladder.make_ladder(field)
    write_json(field.folder / "ladder.json", figures)
    ladder.plot(figures, field.folder / "ladder.png")
    with draft_of(field.folder / season.PAGE) as draft:
        draft.write_text(season.render(title, figures, entries, field.games.values()), encoding="utf-8")
    tables.print_ladder(figures)
    print("ladder: " + ", ".join(str(field.folder / f"ladder.{kind}") for kind in ("json", "png")))
    print(f"page: {field.folder / season.PAGE}")


def season(
    folder: Path,
    /,
    config: Games = TournamentConfig(),  # noqa: B008  (frozen)
    field: bool = True,
    allow_programs: bool = False,
    workers: WorkerOptions = WORKERS,
) -> None:
    """Play the entries in a folder against each other and the benchmark's field, and write the season's page.

    The same command, run again, plays only new games: see docs/season.md.

    Args:
        folder: Folder that holds `entries`, and gets games.jsonl, index.html, ladder.json and ladder.png.
        config: The games.
        field: Also play against the opponents of the benchmark's track `field`.
        allow_programs: Also run entries that are programs, which can do anything that you can.
    """
    need("cli", "choix", "jinja2", "matplotlib")
    from swarm_pz.evaluation import season as seasons
    from swarm_pz.standard import Protocol

    with progress("players", "loading players"):
        entries = seasons.Entries.read(folder, config.game, allow_programs=allow_programs)
        check_folder(folder)
        others = [one.name for track in Protocol.read().tracks if track.name == "field" for one in track.trials]
        players = (*entries.folders, *(others if field else ()))
        left_out = [f"left out: {name}: {reason}" for name, reason in entries.left_out.items()]
        if len(players) < 2:
            names = ", ".join(players) or "none"
            raise ResultsError("; ".join([f"a season needs two or more players, got {names}", *left_out]))
        tournament = Tournament(players, config, folder, entries, command())
    for line in left_out:
        print(tables.printable(line))
    _play_on(tournament, workers, "Season", entries)


def policies() -> None:
    """List the installed policies and control systems.

    A policy sends densities, unless its line names another kind of command.
    """
    lines = known()
    for name, kind in ((name, kind_of(name)) for name in lines):
        lines[name] = lines[name] if kind == "density" else f"sends {kind}: {lines[name]}"
    tables.print_named(lines)
    print("\ncontrol systems, for --game.controllers:")
    tables.print_named(able_to_fly())
