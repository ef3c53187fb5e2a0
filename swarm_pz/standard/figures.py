"""The figures of a report: scores with intervals, for each track and overall.

A game's score is the share of all drones that the entry owns at its end: 1 for a win, 0 for a loss. A policy's score in
a track is the mean over opponents; in `robust` it is the score against its worst attacker.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import RESAMPLES, mean_with_interval, middle, over_runs, rounded, wilson
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.survival import kaplan_meier, survival_curve
from swarm_pz.standard.games import CHOICE, ITSELF, ROBUST, Line, all_tracks, worst_attackers
from swarm_pz.standard.protocol import Protocol

Array = NDArray[np.float64]
DIGITS = 6


class Results:
    """The games of an entry by track, policy and opponent; missing or additional games raise a ResultsError.

    `scores` (policies, tracks) has the tracks of the protocol that are played, and `ROBUST` last.
    """

    def __init__(self, lines: Sequence[Line], protocol: Protocol, policies: int) -> None:
        self.protocol, self.policies = protocol, policies
        self._games: dict[tuple[str, int], dict[str, list[Line]]] = {}
        for line in sorted(lines, key=lambda line: line.number):
            self._games.setdefault((line.track, line.policy), {}).setdefault(line.opponent, []).append(line)
        self.tracks = [track.name for track in protocol.tracks if track.games] + [ROBUST]
        self._worst = worst_attackers([line for line in lines if line.track == CHOICE])
        self._check(len(lines))
        self.scores = np.array([[self.score(track, policy) for track in self.tracks] for policy in range(policies)])

    def _check(self, count: int) -> None:
        expected = 0
        for track in all_tracks(self.protocol):
            for policy in range(self.policies):
                met = self.of(track.name, policy)
                opponents = {trial.name for trial in track.trials} if track.name not in (CHOICE, ROBUST) else set(met)
                if track.name == ROBUST and list(met) != [self._worst.get(policy)]:
                    raise ResultsError(f"games against the worst attacker of policy {policy} are missing")
                whole = all([game.number for game in met.get(one, [])] == list(range(track.games)) for one in opponents)
                if track.games and not (whole and met):
                    raise ResultsError(f"games of track {track.name!r} are missing, or too many")
                expected += track.games * len(opponents)
        if count != expected or not self.policies:
            raise ResultsError(f"games are missing, or too many: expected {expected}, got {count}")

    def of(self, track: str, policy: int) -> dict[str, list[Line]]:
        """Return the games of a policy in a track, by opponent."""
        return self._games.get((track, policy), {})

    def score(self, track: str, policy: int) -> float:
        """Return the score of a policy in a track."""
        return float(np.mean([share_of(games) for games in self.of(track, policy).values()]))

    def drawn(self, track: str, generator: np.random.Generator, count: int) -> Array:
        """Return bootstrap scores (count,) of the only policy; pairs of games are resampled for each opponent."""
        scores = []
        for games in self.of(track, 0).values():
            pairs = np.array([game.share for game in games]).reshape(-1, 2).mean(axis=1)
            scores.append(pairs[generator.integers(len(pairs), size=(count, len(pairs)))].mean(axis=1))
        return np.asarray(np.mean(scores, axis=0))

    def intervals(self) -> tuple[Array, Array]:
        """Return the ends (tracks + 1,) of the intervals of all tracks, and of their mean last.

        They are over training runs if there are several, else over pairs of games.
        """
        if self.policies > 1:
            both = np.column_stack([self.scores, self.scores.mean(axis=1)])
            low, high = np.transpose([over_runs(runs) for runs in both.T])
            return low, high
        generator = np.random.default_rng(0)
        drawn = np.stack([self.drawn(track, generator, RESAMPLES) for track in self.tracks], axis=1)
        return middle(np.column_stack([drawn, drawn.mean(axis=1)]))


def share_of(games: Sequence[Line]) -> float:
    """Return the mean share of the drones at the end of games."""
    return float(np.mean([game.share for game in games]))


def figures(results: Results) -> dict[str, Any]:
    """Return the figures of a report as plain values."""
    values = results.scores.mean(axis=0)
    low, high = results.intervals()
    tracks = {}
    for place, name in enumerate(results.tracks):
        attacked = name == ROBUST
        opponents = _opponents(results, CHOICE if attacked else name)
        tracks[name] = {
            "score": _short(values[place]),
            "score_ci95": _short([low[place], high[place]]),
            "worst": worst_of(opponents),
            "late": None if attacked else _late(results, name),
            "open_loop": _open_loop(results, name),
            "opponents": opponents,
        }
    return {
        "score": _short(values.mean()),
        "score_ci95": _short([low[-1], high[-1]]),
        "interval_over": "training runs" if results.policies > 1 else "games",
        "tracks": tracks,
        "attacks": [_attack(results, policy) for policy in range(results.policies)],
        "uniform": _how_soon(results) if "uniform" in results.tracks else None,
    }


def _short(values: Any) -> Any:
    return rounded(values, DIGITS)


def _late(results: Results, track: str) -> float:
    """Return the score of an entry whose commands are delayed by one command."""
    name = next(one.late.name for one in results.protocol.tracks if one.name == track)
    return float(_short(np.mean([results.score(name, policy) for policy in range(results.policies)])))


def _opponents(results: Results, track: str) -> list[dict[str, Any]]:
    """Return the results against each opponent of a track."""
    names = dict.fromkeys(name for policy in range(results.policies) for name in results.of(track, policy))
    everybody = range(results.policies)
    return [result_of(name, [results.of(track, policy).get(name, []) for policy in everybody]) for name in names]


def result_of(opponent: str, by_policy: Sequence[Sequence[Line]]) -> dict[str, Any]:
    """Return the results against an opponent, from each policy's games against it."""
    scores = [_short(share_of(games)) if games else None for games in by_policy]
    return {"opponent": opponent, **_counts([game for games in by_policy for game in games]), "scores": scores}


def worst_of(opponents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the name of the opponent against which an entry scores least, and that score."""
    worst = min(opponents, key=lambda one: float(one["score"]))
    return {"opponent": worst["opponent"], "score": worst["score"]}


def _counts(games: Sequence[Line]) -> dict[str, Any]:
    reasons = [game.forfeit for game in games if game.forfeit]
    counts = {outcome: sum(game.outcome == outcome for game in games) for outcome in POINTS}
    return {
        "games": len(games),
        **{f"{outcome}s" if outcome != "loss" else "losses": count for outcome, count in counts.items()},
        "score": _short(share_of(games)),
        "forfeits": len(reasons),
        **({"first_forfeit": reasons[0]} if reasons else {}),
    }


def _attack(results: Results, policy: int) -> dict[str, Any]:
    """Return the worst attacker of a policy with the games that count, and the policy's games against itself."""
    (name, games), *_ = results.of(ROBUST, policy).items()
    itself = results.of(CHOICE, policy)[f"{ITSELF} {policy}"]
    return {"worst": {"opponent": name, **_counts(games)}, "itself": _counts(itself)}


def _open_loop(results: Results, track: str) -> dict[str, Any] | None:
    """Return the scores of open-loop players, and the entry's gain over the best of them."""
    players = results.protocol.open_loop.get(track)
    if players is None:
        return None
    scores = {kind: {name: one[name] for name in ("score", "score_ci95")} for kind, one in players.items()}
    score = results.scores[:, results.tracks.index(track)].mean()
    return scores | {"gain": _short(score - max(one["score"] for one in players.values()))}


def forfeits_of(figures: dict[str, Any]) -> tuple[int, int, str]:
    """Return the numbers of forfeits and of all games, and the reason of the first forfeit."""
    counts = [one for track in figures["tracks"].values() for one in track["opponents"]]
    counts += [one["worst"] for one in figures["attacks"]]
    reasons = [str(one["first_forfeit"]) for one in counts if "first_forfeit" in one]
    return sum(one["forfeits"] for one in counts), sum(one["games"] for one in counts), next(iter(reasons), "")


def _how_soon(results: Results) -> dict[str, Any]:
    """Return the share of games won against uniform coverage, and the time to a win; other games are censored."""
    limit = results.protocol.game.time_limit
    played = [results.of("uniform", policy) for policy in range(results.policies)]
    games = [game for by_name in played for against in by_name.values() for game in against]
    won = [game.outcome == "win" for game in games]
    seconds = [game.seconds if wins else limit for game, wins in zip(games, won, strict=True)]
    median, _ = kaplan_meier(seconds, won)
    mean, ends = mean_with_interval(seconds)
    times, undecided = survival_curve(seconds, won)
    return {
        "games": len(games),
        "won": sum(won),
        "won_share": _short(sum(won) / len(won)),
        "won_share_ci95": _short(wilson(sum(won), len(won))),
        "median_seconds": None if median is None else _short(median),
        "restricted_mean_seconds": _short(mean),
        "restricted_mean_seconds_ci95": _short(ends),
        "curve": {"seconds": _short(times), "not_won": _short(undecided)},
    }
