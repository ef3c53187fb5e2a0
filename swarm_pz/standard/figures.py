"""What the games of a report say: scores with intervals, of each track and in one number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import mean_with_interval, middle, rounded, wilson
from swarm_pz.evaluation.ledger import distinct
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.survival import kaplan_meier, survival_curve
from swarm_pz.standard.aggregate import (
    drawn_pairs,
    drawn_runs,
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
    resampled,
)
from swarm_pz.standard.games import LEARNED, SEARCHED, Line, all_tracks
from swarm_pz.standard.protocol import Protocol

Array = NDArray[np.float64]
ROBUST = "robust"
THRESHOLDS = tuple(round(step / 20, 2) for step in range(20))
DIGITS = 6


class Results:
    """The games of an entry, by training seeds and tasks; a task is one opponent of one track, or a kind of attack.

    Of each policy and task, `pairs` has points and games that count of each pair (pairs, 2): a game that a pair played
    twice counts once, half of it from each side. `scores` (policies, tasks) are shares of the points. Games that are
    missing, or are of no task, raise a ResultsError.
    """

    def __init__(self, lines: Sequence[Line], protocol: Protocol) -> None:
        self.protocol = protocol
        self.tasks = [(track.name, trial.name) for track in protocol.tracks for trial in track.trials]
        self.tasks += [(ROBUST, LEARNED), (ROBUST, SEARCHED)]
        self.policies = 1 + max((line.policy for line in lines), default=-1)
        self._games: dict[tuple[int, str, str], list[Line]] = {}
        for line in lines:
            self._games.setdefault((line.policy, *task_of(line)), []).append(line)
        self._check()
        self.pairs = [[_pairs(self.of(policy, task)) for task in self.tasks] for policy in range(self.policies)]
        totals = np.array([[task.sum(axis=0) for task in row] for row in self.pairs])
        self.scores = totals[..., 0] / totals[..., 1]

    def _check(self) -> None:
        count = {track.name: track.games for track in all_tracks(self.protocol)}
        expected = {
            (policy, *task): list(range(count[task[0]])) for policy in range(self.policies) for task in self.tasks
        }
        found = {key: sorted(line.number for line in games) for key, games in self._games.items()}
        wrong = [key for key in expected | found if expected.get(key) != found.get(key)]
        if wrong or not self.policies:
            some = ", ".join(map(str, wrong[:3])) or "all"
            raise ResultsError(f"games of protocol {self.protocol.version} are missing, or too many: {some}")

    def of(self, policy: int, task: tuple[str, str]) -> list[Line]:
        """Return the games of a policy in a task, in order."""
        return sorted(self._games[policy, *task], key=lambda line: line.number)

    def draw(self, generator: np.random.Generator, count: int) -> Array:
        """Return scores (count, policies, tasks) drawn anew: training seeds if there are several, else pairs."""
        if self.policies > 1:
            return drawn_runs(self.scores, generator, count)
        return drawn_pairs(self.pairs[0], generator, count)

    def of_tracks(self, scores: Array) -> Array:
        """Return one number of each track, and their mean last: the interquartile mean, of attacks the worse.

        Axes before those of policies and tasks stay.
        """
        names = [track for track, _ in self.tasks]
        found = []
        for track in dict.fromkeys(names):
            part = scores[..., [name == track for name in names]]
            found.append(part.mean(axis=-2).min(axis=-1) if track == ROBUST else interquartile_mean(part))
        tracks = np.stack(found, axis=-1)
        return np.concatenate([tracks, tracks.mean(axis=-1, keepdims=True)], axis=-1)


def task_of(line: Line) -> tuple[str, str]:
    """Return the task of a game."""
    return line.track, line.opponent.split()[0] if line.track == ROBUST else line.opponent


def _pairs(games: Sequence[Line]) -> Array:
    rows: dict[int, list[float]] = {}
    for alike in distinct(games):
        row = rows.setdefault(alike[0].number // 2, [0.0, 0.0])
        row[0] += float(np.mean([POINTS[game.outcome] for game in alike]))
        row[1] += 1.0
    return np.array(list(rows.values()))


def figures(results: Results) -> dict[str, Any]:
    """Return what a report says about its games, as plain values."""
    values, drawn = results.of_tracks(results.scores), resampled(results.draw)
    low, high = middle(results.of_tracks(drawn))
    tracks = list(dict.fromkeys(track for track, _ in results.tasks))
    return {
        "score": _short(values[-1]),
        "score_ci95": _short([low[-1], high[-1]]),
        "interval_over": "training seeds" if results.policies > 1 else "games",
        "tracks": {
            track: {
                "score": _short(values[place]),
                "score_ci95": _short([low[place], high[place]]),
                "opponents": [_task(results, task) for task in results.tasks if task[0] == track],
            }
            for place, track in enumerate(tracks)
        },
        "uniform": _how_soon(results),
        "profile": _profile(results, drawn),
    }


def _short(values: Any) -> Any:
    return rounded(values, DIGITS)


def _task(results: Results, task: tuple[str, str]) -> dict[str, Any]:
    place = results.tasks.index(task)
    games = [game for policy in range(results.policies) for game in results.of(policy, task)]
    reasons = [game.forfeit for game in games if game.forfeit]
    counts = {outcome: sum(game.outcome == outcome for game in games) for outcome in POINTS}
    return {
        "opponent": task[1],
        "games": len(games),
        **{f"{outcome}s" if outcome != "loss" else "losses": count for outcome, count in counts.items()},
        "points": [_short(score) for score in results.scores[:, place]],
        "mean_share": _short(np.mean([game.share for game in games])),
        "forfeits": len(reasons),
        **({"first_forfeit": reasons[0]} if reasons else {}),
    }


def forfeits_of(figures: dict[str, Any]) -> tuple[int, int, str]:
    """Return how many games of a report were forfeited, of how many, and why the first one was."""
    tasks = [task for track in figures["tracks"].values() for task in track["opponents"]]
    reasons = [str(task["first_forfeit"]) for task in tasks if "first_forfeit" in task]
    return sum(task["forfeits"] for task in tasks), sum(task["games"] for task in tasks), next(iter(reasons), "")


def _how_soon(results: Results) -> dict[str, Any]:
    """Return the share of games won against uniform coverage, and how soon; a draw censors its length."""
    task = results.tasks[0]
    limit = results.protocol.game.time_limit
    games = [alike[0] for policy in range(results.policies) for alike in distinct(results.of(policy, task))]
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


def _profile(results: Results, drawn: Array) -> dict[str, Any]:
    low, high = middle(performance_profile(drawn, THRESHOLDS))
    return {
        "score_above": list(THRESHOLDS),
        "share": _short(performance_profile(results.scores, THRESHOLDS)),
        "low": _short(low),
        "high": _short(high),
    }


def improvement(results: Results, baseline: Results) -> dict[str, Any]:
    """Return how likely a run of the entry is better than one of the baseline, over all tasks."""

    def draw(generator: np.random.Generator, count: int) -> Array:
        both = ((results.draw(generator, 1)[0], baseline.draw(generator, 1)[0]) for _ in range(count))
        return np.array([probability_of_improvement(*drawn) for drawn in both])

    low, high = middle(resampled(draw))
    value = probability_of_improvement(results.scores, baseline.scores)
    return {"probability": _short(value), "ci95": _short([low, high])}
