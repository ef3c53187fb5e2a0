"""Compares control systems: the best player of each commands it, and all play all.

python -m benchmarks.systems_ladder                             # all of it; the same command continues a stopped run
python -m benchmarks.systems_ladder --only ergodic              # chooses the players of a system, and prints them
python -m benchmarks.systems_ladder --versus ergodic/finisher   # plays one entrant against the others of docs/tables

The field has one player of each control system: the policy that was trained for it, or else `hold` or `uniform`.
Every candidate plays the field, on other seeds than the final games. The candidate that wins most commands its system.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.csv_table import write_csv
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.report import progress
from swarm_pz.config import GameConfig
from swarm_pz.config.presets import PRESETS
from swarm_pz.config.registry import registered, system_of
from swarm_pz.errors import CommandError, SwarmError
from swarm_pz.evaluation.intervals import wilson
from swarm_pz.evaluation.ratings import nash_average
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.policy import Player, PrivilegedPolicy, answers_of, load
from swarm_pz.policy import registered as installed
from swarm_pz.rendering.plots import drawing, matrix

TRACKS = {"hovering": 0.0, "fixed_wing": PRESETS["fixed_wing"]["dynamics"].min_speed}
"""Least airspeed of each track."""
TRAINED = "trained"
CHOICE_GAMES = 40
"""Games of every candidate, at least."""
CHOICE_SEED = 1_000_003
"""Added to the seed for the games that choose players."""
TABLE = Path("docs/tables/systems.csv")

Pair = tuple[str, str]


def system_name(entrant: str) -> str:
    """Return the control system of an entrant: "ergodic" of "ergodic/ring"."""
    return entrant.split("/", 1)[0]


def load_entrant(entrant: str, game: GameConfig) -> Player:
    """Return the policy of an entrant, SYSTEM/PLAYER, made for its system."""
    system, _, player = entrant.partition("/")
    if not player:
        raise CommandError(f"an entrant must be SYSTEM/PLAYER, as ergodic/ring, got {entrant!r}")
    return load(player, game.replace(controllers=system), system_of(system))


class Contest(Tournament):
    """A tournament of entrants in which certain pairs meet, and each entrant flies by its own system."""

    def __init__(self, pairs: Sequence[Pair], config: TournamentConfig, folder: Path, command: str = "") -> None:
        self._pairs = sorted({(min(pair), max(pair)) for pair in pairs})
        entrants = list(dict.fromkeys(itertools.chain(*self._pairs)))
        super().__init__(entrants, config, folder, load_entrant, command)

    def pairings(self) -> list[Pair]:
        """Return the pairs that meet, each in alphabetical order."""
        return self._pairs

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return the rules of two entrants: each flies by its own system."""
        return self.config.replace(game=self.config.game.replace(controllers=(system_name(one), system_name(other))))

    def counts(self, entrant: str) -> NDArray[np.float64]:
        """Return the games won, drawn and lost (3,) of an entrant against all others that it met."""
        others = [pair[pair[0] == entrant] for pair in self._pairs if entrant in pair]
        return np.asarray(sum(self.tally(entrant, other).sum(axis=0) for other in others))


def rules_of_track(track: str) -> GameConfig:
    """Return the rules of a track: the default game with its least airspeed."""
    game = GameConfig()
    return game.replace(dynamics=game.dynamics.replace(min_speed=TRACKS[track]))


def candidates(system: str, game: GameConfig) -> list[str]:
    """Return the entrants of a system: every installed policy for its commands that does not read the simulator."""
    entrants = []
    for name in sorted(installed()):
        if name == "hold" and system_of(system).takes == "density":  # the same as `uniform`
            continue
        try:
            player = load_entrant(f"{system}/{name}", game)
        except SwarmError:  # for other commands, or for the other track
            continue
        is_for_it = name == TRAINED or answers_of(player) == system_of(system).takes
        if is_for_it and not isinstance(player, PrivilegedPolicy):
            entrants.append(f"{system}/{name}")
    return entrants


def field_of(entrants: Sequence[str]) -> list[str]:
    """Return one entrant of each system: the policy that was trained for it, else `hold`, else `uniform`."""
    systems = dict.fromkeys(map(system_name, entrants))
    names = [[f"{system}/{name}" for name in (TRAINED, "hold", "uniform")] for system in systems]
    return [next(one for one in three if one in entrants) for three in names]


def choice_pairs(entrants: Sequence[str], field: Sequence[str]) -> list[Pair]:
    """Return the pairs of the choice: each entrant meets the field's players of the other systems."""
    return [(one, other) for one in entrants for other in field if system_name(one) != system_name(other)]


def choose(contest: Contest, entrants: Sequence[str]) -> list[tuple[str, NDArray[np.float64]]]:
    """Return entrants with games won, drawn and lost, sorted by the share of games won."""
    counts = [(one, contest.counts(one)) for one in entrants]
    return sorted(counts, key=lambda row: -row[1][0] / row[1].sum())


def share_of_wins(contest: Contest, order: Sequence[str]) -> NDArray[np.float64]:
    """Return the share of its games (n, n) that each entrant (row) wins against each (column); 0 on the diagonal."""
    shares = np.zeros((len(order), len(order)))
    for (i, one), (j, other) in itertools.permutations(enumerate(order), 2):
        counts = contest.tally(one, other).sum(axis=0)
        shares[i, j] = counts[0] / counts.sum()
    return shares


def standings(contest: Contest, track: str) -> tuple[list[str], NDArray[np.float64], list[tuple[Any, ...]]]:
    """Return the entrants, the most successful first, their shares of wins, and the rows of the table."""
    order = [one for one, _ in choose(contest, contest.players)]
    shares = share_of_wins(contest, order)
    mixture, _ = nash_average(shares)  # the Nash equilibrium of wins minus losses
    rows = []
    for one, part in zip(order, mixture, strict=True):
        won, drawn, lost = contest.counts(one)
        low, high = wilson(round(won), round(won + drawn + lost))
        system, _, player = one.partition("/")
        percent = (f"{100 * won / (won + drawn + lost):.1f}", f"{100 * low:.0f} to {100 * high:.0f} %")
        figures = (*percent, f"{100 * part:.1f}", f"{won:g}", f"{drawn:g}", f"{lost:g}")
        rows.append((track, system, system_of(system).takes, player, *figures))
    return order, shares, rows


HEAD = ("track", "system", "commands", "by", "won against all others, %", "95 %", "share of the mixture, %", "won",
        "drawn", "lost")  # fmt: skip


def draw(order: Sequence[str], shares: NDArray[np.float64], path: Path) -> None:
    """Draw the share of its games that each entrant wins against each."""
    with drawing(path, (0.45 * len(order) + 3.0, 0.35 * len(order) + 2.2)) as figure:
        others = np.where(np.eye(len(order)), np.nan, shares)  # nobody meets itself
        matrix(figure.subplots(), order, others, "% of its games that the row wins against the column")


def main() -> None:
    """Choose the players, play, and write the tables and pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="systems whose players are chosen; nothing is written")
    parser.add_argument("--versus", help="SYSTEM/PLAYER that plays the others of the table; nothing is written")
    parser.add_argument("--tracks", nargs="*", choices=tuple(TRACKS), default=list(TRACKS))
    parser.add_argument("--games", type=int, default=40, help="games of every two chosen entrants, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=Path("runs/systems/ladder"))
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="where tables/ and images/ are")
    args = parser.parse_args()
    command = shlex.join(["python", "-m", "benchmarks.systems_ladder", *sys.argv[1:]])
    systems, rows, tried = sorted(registered()), [HEAD], [("track", "system", "player", "won", "drawn", "lost")]
    with goes_on_with(command), progress("games") as show, stops_at_safe_points() as should_stop:

        def play(pairs: Sequence[Pair], games: int, seed: int, track: str, name: str) -> Contest:
            config = TournamentConfig(games=games, seed=seed, game=rules_of_track(track))
            contest = Contest(pairs, config, args.folder / track / name, command)
            contest.play(args.processes, show, should_stop)
            return contest

        for track in args.tracks:
            if args.versus:
                with TABLE.open(newline="") as file:
                    known = [f"{row['system']}/{row['by']}" for row in csv.DictReader(file) if row["track"] == track]
                pairs = [(args.versus, one) for one in known if system_name(one) != system_name(args.versus)]
                print(track, args.versus, play(pairs, args.games, args.seed, track, "versus").counts(args.versus))
                continue
            entrants = {system: candidates(system, rules_of_track(track)) for system in systems}
            every = list(itertools.chain(*entrants.values()))
            chosen = [one for one in every if not args.only or system_name(one) in args.only]
            games = 2 * -(-CHOICE_GAMES // (2 * (len(systems) - 1)))
            contest = play(choice_pairs(chosen, field_of(every)), games, args.seed + CHOICE_SEED, track, "choice")
            best: dict[str, str] = {}
            for one, counts in choose(contest, chosen):
                best.setdefault(system_name(one), one)
                tried.append((track, *one.split("/"), *(f"{count:g}" for count in counts)))
            if args.only:
                continue
            played = play(list(itertools.combinations(best.values(), 2)), args.games, args.seed, track, "contest")
            order, shares, table = standings(played, track)
            rows += table
            draw(order, shares, args.docs / f"images/systems/{track}.png")
    if args.only:
        print("\n".join(" ".join(row) for row in tried))
    elif not args.versus:
        write_csv(args.docs / "tables/systems.csv", rows)
        write_csv(args.docs / "tables/systems_scripts.csv", tried)


if __name__ == "__main__":
    main()
