"""The rating of a league's newest snapshot among the latest of the pool, by games of their own."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import Stopped
from swarm_pz.evaluation.ratings import rate
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.evaluation.workers import SerialExecutor
from swarm_pz.policy import Player, folder_of
from swarm_pz.training.pool import Pool

_RATED, _GAMES = 4, 10
"""Latest snapshots, and latest exploiters, that a new snapshot is rated among; and the games of every two."""
_LOOK_S = 0.2
"""Seconds between two looks at whether to stop."""


@dataclass(frozen=True)
class MemberLoader:
    """Loads a league's members by their sources, in other processes, too: `places` are their names or folders."""

    places: dict[str, str]

    def __call__(self, source: str, game: GameConfig) -> Player:
        """Return a member, made for a game."""
        return policies.load(self.places[source], game)

    def folder_of(self, source: str) -> Path | None:
        """Return the folder that a member comes from, if any."""
        return folder_of(self.places[source])


class Rating:
    """The rating of a pool's newest snapshot, by games that workers play."""

    def __init__(self, pool: Pool, folder: Path, game: GameConfig, workers: Executor) -> None:
        sources = {
            kind: [one.source for one in pool.members if one.kind == kind]
            for kind in ("script", "snapshot", "exploiter")
        }
        first, *snapshots = sources["snapshot"]
        places = {source: source for source in sources["script"]}
        places |= {
            source: str(folder / source) for source in (first, *snapshots[-_RATED:], *sources["exploiter"][-_RATED:])
        }
        self._newest, self._workers = sources["snapshot"][-1], workers
        # Players are made here and now: what makes them draws from the process's random streams.
        config = TournamentConfig(games=_GAMES, game=game, budget_ms=1e6)
        self._tournament = Tournament(list(places), config, folder / "ratings", MemberLoader(places))
        self._thread: ThreadPoolExecutor | None = None
        self._played: Future[None] | None = None
        self._is_left = False

    def begin(self) -> None:
        """Begin to play the games: on workers, or here and now."""
        if isinstance(self._workers, SerialExecutor):
            self._tournament.play()
            return
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="rating")
        self._played = self._thread.submit(self._tournament.play, pool=self._workers, should_stop=lambda: self._is_left)

    def end(self, should_stop: Callable[[], bool]) -> float:
        """Wait for the games, and return the rating; raise Stopped if it should stop meanwhile."""
        if self._played is not None:
            while not wait([self._played], timeout=_LOOK_S).done:
                if should_stop():
                    raise Stopped(f"{self._newest} is being rated")
            self._played.result()
        self.leave()
        names = self._tournament.players
        ratings = rate(self._tournament.results(), "uniform" if "uniform" in names else names[0])
        return float(ratings.values[names.index(self._newest)])

    def leave(self) -> None:
        """Begin no more games; games that began are finished and kept, unless the workers were ended."""
        self._is_left = True
        if self._thread is not None:
            self._thread.shutdown()
