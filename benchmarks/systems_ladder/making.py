"""Plays the ladder of systems, measures the traits, and writes the page: all of it taken up where it was left."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from benchmarks.csv_table import write_csv
from benchmarks.systems_ladder.contest import (
    ADVERSARY,
    TRACKS,
    Contest,
    best_players,
    choose_systems,
    pilot,
    rules_of_track,
)
from benchmarks.systems_ladder.findings import solve, standings, wins
from benchmarks.systems_ladder.page import tables, to_markdown
from benchmarks.systems_ladder.pictures import draw_field, draw_times
from benchmarks.systems_ladder.traits import measure_traits
from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, Range, check
from swarm_pz.errors import ResultsError, Stopped
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.files import draft_of

PILOT, CONTEST, TRAITS = "pilot", "contest", "traits"
RESULTS = "systems.json"
PICTURES = "images/systems"


@dataclass(frozen=True, kw_only=True)
class SystemsConfig(Config):
    """What the ladder of systems is made of.

    Attributes
    ----------
    systems : tuple of str
        Control systems; all that are installed, if none are given.
    tracks : tuple of str
        The rules that they play by.
    pilot_games : int
        Games of every player against the adversary, to choose the best of each system; even.
    games : int
        Games of every two entrants, even.
    starts : int
        Games behind each trait.
    seconds : int
        How long a team flies before it is judged.
    seed : int
    game : GameConfig
        The rules; who flies, and how slowly, is not for it to say.
    """

    systems: tuple[str, ...] = ()
    tracks: tuple[str, ...] = tuple(TRACKS)
    pilot_games: Annotated[int, Range(2, 10**6)] = 20
    games: Annotated[int, Range(2, 10**6)] = 40
    starts: Annotated[int, Range(2, 10**4)] = 20
    seconds: Annotated[int, Range(1, 10**4)] = 30
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    game: GameConfig = field(default_factory=GameConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("pilot_games", "games"):
            check(getattr(self, name) % 2 == 0, name, getattr(self, name), "even, half for each side")
        check(set(self.tracks) <= set(TRACKS) and self.tracks != (), "tracks", self.tracks, f"of {', '.join(TRACKS)}")

    @property
    def quick(self) -> SystemsConfig:
        """The same with few and short games: whether all of it works, and nothing about the systems."""
        short = self.game.replace(time_limit=min(self.game.time_limit, 10.0))
        return self.replace(pilot_games=2, games=2, starts=2, seconds=2, game=short)


Say = Callable[[float, float], None]


def make(
    config: SystemsConfig,
    folder: Path,
    out: Path,
    *,
    processes: int = 2,
    progress: Say | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    command: str = "",
    pool: Executor | None = None,
) -> dict[str, Any]:
    """Play and measure what is missing, write the page into `out`, and return what it tells, as `systems.json` does.

    `folder` keeps games and traits; who gives the same again goes on there. `progress` is told what is done and what
    there is to do, in each part; `should_stop` whether to stop. A `pool` plays and measures instead of processes.

    Raises
    ------
    Stopped
        If it was asked to; what was begun is finished and kept.
    ResultsError
        If the folder holds another ladder, or another process makes one there.
    """
    systems = choose_systems(config.systems)
    with nullcontext(pool) if pool is not None else open_pool(processes) as workers, folder_lock(folder):
        tracks = {}
        for track in config.tracks:
            rules = TournamentConfig(
                games=config.pilot_games, seed=config.seed, game=rules_of_track(track, config.game)
            )
            trial = pilot(systems, rules, folder / track / PILOT, command)
            trial.play(progress=progress, should_stop=should_stop, pool=workers)
            entrants = [ADVERSARY, *best_players(trial)]
            field_ = Contest(entrants, rules.replace(games=config.games), folder / track / CONTEST, command)
            field_.play(progress=progress, should_stop=should_stop, pool=workers)
            tracks[track] = _tell(trial, field_)
        traits = _measure_all(systems, config, folder / TRAITS, workers, progress, should_stop)
        results = {
            "config": config.to_dict(),
            "adversary": ADVERSARY,
            "tracks": tracks,
            "traits": traits,
            **provenance(config.game, command),
        }
        write(results, folder, out)
        return results


def _tell(trial: Contest, field_: Contest) -> dict[str, Any]:
    """Return the numbers of a track: the entrants by their share of wins against all others, and what the game is."""
    shares = wins(field_, field_.players)
    against_all = (shares.sum(axis=1) - shares.diagonal()) / (len(shares) - 1)
    places = sorted(range(len(shares)), key=lambda place: -against_all[place])
    shares = shares[places][:, places]
    game = solve(shares)
    order = [field_.players[place] for place in places]
    shown = {
        one: {"against_all": float(against_all[place]), "mixture": share}
        for one, place, share in zip(order, places, game["mixture"], strict=True)
    }
    return {
        "pilot": [{name: row[name] for name in ("entrant", "wins", "draws", "losses")} for row in standings(trial)],
        "standings": sorted(
            (row | shown[row["entrant"]] for row in standings(field_)), key=lambda row: order.index(row["entrant"])
        ),
        "order": order,
        "wins": shares.round(4).tolist(),
        "game": game,
    }


def write(results: dict[str, Any], folder: Path, out: Path) -> None:
    """Write the results, the page, its tables and its pictures."""
    with draft_of(folder / RESULTS) as draft:
        draft.write_text(json.dumps(results, indent=2) + "\n")
    (out / PICTURES).mkdir(parents=True, exist_ok=True)
    draw_times(results, out / PICTURES / "time_to_win.png")
    for track, told in results["tracks"].items():
        draw_field(told, out / PICTURES / f"{track}.png")
    (out / "systems.md").write_text(to_markdown(results, PICTURES))
    for name, rows in tables(results).items():
        write_csv(out / "tables" / f"{name}.csv", rows)


def _measure_all(
    systems: Sequence[str],
    config: SystemsConfig,
    folder: Path,
    pool: Executor,
    progress: Say | None,
    should_stop: Callable[[], bool],
) -> list[dict[str, Any]]:
    """Return the traits of systems in their order; a file holds those of each, and is read where there is one."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = {
        "starts": config.starts,
        "seconds": config.seconds,
        "seed": config.seed,
        "rules": config.game.rules_hash,
    }
    found = {system: _read(folder / f"{system}.json", settings) for system in systems}
    missing = [system for system in systems if found[system] is None]

    def keep(system: str, traits: dict[str, Any]) -> None:
        found[system] = traits
        with draft_of(folder / f"{system}.json") as draft:
            draft.write_text(json.dumps({"settings": settings, "traits": traits}, indent=2) + "\n")
        if progress is not None:
            progress(sum(one is not None for one in found.values()), len(systems))

    measure = functools.partial(
        measure_traits, game=config.game, seed=config.seed, starts=config.starts, seconds=config.seconds
    )
    tasks = [(system,) for system in missing]
    share(
        pool,
        measure,
        tasks,
        lambda task, traits: keep(task[0], traits),
        should_stop=should_stop,
        name=lambda task: task[0],
        verb="measured",
    )
    if left := [system for system in systems if found[system] is None]:
        raise Stopped(f"all games are in {folder.parent}, the traits of {', '.join(left)} are missing")
    return [traits for system in systems if (traits := found[system]) is not None]


def _read(path: Path, settings: dict[str, Any]) -> dict[str, Any] | None:
    if not path.exists():
        return None
    try:
        kept = json.loads(path.read_text())
        before, traits = kept["settings"], dict(kept["traits"])
        if missing := {"system", "own", "bimodal"} - traits.keys():
            raise ValueError(f"there is no {', '.join(sorted(missing))}")
    except (LookupError, TypeError, ValueError, RecursionError, OSError) as error:
        raise ResultsError(f"{path} is corrupt or foreign ({error!r}); delete it, or use another folder") from error
    if before != settings:
        raise ResultsError(f"{path} was measured with {before}, and not {settings}; delete it, or use another folder")
    return traits
