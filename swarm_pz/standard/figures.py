"""The figures of a report: scores with intervals, of each track and in one number.

A win is one point, a draw or a loss none. A training seed's score in a track is the mean over opponents.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import mean_with_interval, middle, rounded, wilson
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.survival import kaplan_meier, survival_curve
from swarm_pz.standard.aggregate import (
    drawn_pairs,
    drawn_runs,
    interquartile_mean,
    mean_of_known,
    probability_of_improvement,
    resampled,
)
from swarm_pz.standard.games import LEARNED, SEARCHED, Line, all_tracks
from swarm_pz.standard.protocol import Protocol

Array = NDArray[np.float64]
ROBUST = "robust"
DIGITS = 6


class Results:
    """The games of an entry, by training seeds and tasks; a task is one opponent of one track, or an attack.

    Of each policy and task, `pairs` has the share won of each pair of games. `scores` (policies, tasks) are their
    means, NaN where a policy would meet itself. Missing games, and those of no task, raise a ResultsError.
    """

    def __init__(self, lines: Sequence[Line], protocol: Protocol, digests: Sequence[str]) -> None:
        self.protocol, self.policies = protocol, len(digests)
        self.tasks = [(track.name, trial.name) for track in protocol.tracks for trial in track.trials]
        self._exploiters = protocol.robust.exploiters_each(len(digests)) if digests else 0
        self.tasks += [(ROBUST, f"{LEARNED} {number}") for number in range(self._exploiters)]
        self.tasks += [(ROBUST, SEARCHED)]
        self.tracks = list(dict.fromkeys(track for track, _ in self.tasks))
        met = [{(track.name, name) for track in protocol.tracks for name in track.opponents(one)} for one in digests]
        self.left_out = [
            (policy, task)
            for policy, tasks in enumerate(met)
            for task in self.tasks
            if task[0] != ROBUST and task not in tasks
        ]
        self._games: dict[tuple[int, tuple[str, str]], list[Line]] = {}
        for line in sorted(lines, key=lambda line: line.number):
            self._games.setdefault((line.policy, self._task_of(line)), []).append(line)
        self._check()
        self.pairs = [
            [
                np.array([game.outcome == "win" for game in self.of(policy, task)]).reshape(-1, 2).mean(axis=1)
                for task in self.tasks
            ]
            for policy in range(self.policies)
        ]
        self.scores = np.array([[task.mean() if len(task) else np.nan for task in row] for row in self.pairs])

    def _task_of(self, line: Line) -> tuple[str, str]:
        if line.track != ROBUST:
            return line.track, line.opponent
        kind, number, *_ = [*line.opponent.split(), ""]
        if kind != LEARNED or not number.isdecimal():
            return line.track, kind
        return line.track, f"{kind} {int(number) - line.policy * self._exploiters}"

    def _check(self) -> None:
        count = {track.name: list(range(track.games)) for track in all_tracks(self.protocol)}
        keys = [(policy, task) for policy in range(self.policies) for task in self.tasks]
        expected = {key: count[key[1][0]] for key in keys if key not in self.left_out}
        found = {key: [line.number for line in games] for key, games in self._games.items()}
        wrong = [key for key in expected | found if expected.get(key) != found.get(key)]
        if wrong or not self.policies:
            some = ", ".join(map(str, wrong[:3])) or "all"
            raise ResultsError(f"games of protocol {self.protocol.version} are missing, or too many: {some}")

    def of(self, policy: int, task: tuple[str, str]) -> list[Line]:
        """Return the games of a policy in a task, in order."""
        return self._games.get((policy, task), [])

    def draw(self, generator: np.random.Generator, count: int) -> Array:
        """Return scores (count, policies, tasks) drawn anew: training seeds if there are several, else pairs."""
        if self.policies > 1:
            return drawn_runs(self.scores, generator, count)
        return drawn_pairs(self.pairs[0], generator, count)

    def by_track(self, scores: Array) -> Array:
        """Return scores (..., policies, tracks): the mean over opponents, of attacks the worst."""
        parts = [scores[..., [track == name for track, _ in self.tasks]] for name in self.tracks]
        found = [
            part.min(axis=-1) if name == ROBUST else mean_of_known(part, -1)
            for name, part in zip(self.tracks, parts, strict=True)
        ]
        return np.stack(found, axis=-1)

    def draw_tracks(self, generator: np.random.Generator, count: int) -> Array:
        """Return scores (count, policies, tracks) drawn anew."""
        if self.policies > 1:
            return drawn_runs(self.by_track(self.scores), generator, count)
        return self.by_track(self.draw(generator, count))


def with_mean(scores: Array) -> Array:
    """Return the interquartile mean over policies of each track, and the mean of tracks last: (..., tracks + 1)."""
    tracks = interquartile_mean(np.swapaxes(scores, -1, -2)[..., None])
    return np.concatenate([tracks, tracks.mean(axis=-1, keepdims=True)], axis=-1)


def figures(results: Results) -> dict[str, Any]:
    """Return the figures of a report as plain values."""
    values = with_mean(results.by_track(results.scores))
    low, high = middle(with_mean(resampled(results.draw_tracks)))
    return {
        "score": _short(values[-1]),
        "score_ci95": _short([low[-1], high[-1]]),
        "interval_over": "training seeds" if results.policies > 1 else "games",
        "tracks": {
            track: {
                "score": _short(values[place]),
                "score_ci95": _short([low[place], high[place]]),
                **_worst(results, track),
                "open_loop": _open_loop(results, place, float(values[place])),
                "opponents": [_task(results, task) for task in results.tasks if task[0] == track],
            }
            for place, track in enumerate(results.tracks)
        },
        "left_out": [
            {"policy": policy, "track": track, "opponent": name} for policy, (track, name) in results.left_out
        ],
        "uniform": _how_soon(results),
    }


def _short(values: Any) -> Any:
    return rounded(values, DIGITS)


def _worst(results: Results, track: str) -> dict[str, Any]:
    """Return the worst opponent, and the mean over the worst quarter (the conditional value at risk)."""
    means = mean_of_known(results.scores, 0)
    scores = {
        task[1]: float(mean)
        for task, mean in zip(results.tasks, means, strict=True)
        if task[0] == track and mean >= 0.0
    }
    name = min(scores, key=scores.__getitem__)
    quarter = sorted(scores.values())[: -(-len(scores) // 4)]
    return {"worst": {"opponent": name, "score": _short(scores[name])}, "cvar": _short(np.mean(quarter))}


def _open_loop(results: Results, place: int, score: float) -> dict[str, Any] | None:
    """Return the scores of the clock alone, and the gain over the better one against the same opponents."""
    track = results.tracks[place]
    told = results.protocol.open_loop.get(track)
    if told is None:
        return None
    found = {kind: {name: one[name] for name in ("score", "score_ci95")} for kind, one in told.items()}
    theirs = [
        np.array([one["opponents"].get(name, np.nan) if of == track else np.nan for of, name in results.tasks])
        for one in told.values()
    ]
    same = np.where(np.isnan(results.scores), np.nan, np.array(theirs)[:, None])
    best = max(with_mean(results.by_track(same))[:, place])
    return found | {"gain": _short(score - best)}


def _task(results: Results, task: tuple[str, str]) -> dict[str, Any]:
    place = results.tasks.index(task)
    games = [game for policy in range(results.policies) for game in results.of(policy, task)]
    reasons = [game.forfeit for game in games if game.forfeit]
    counts = {outcome: sum(game.outcome == outcome for game in games) for outcome in POINTS}
    return {
        "opponent": task[1],
        "games": len(games),
        **{f"{outcome}s" if outcome != "loss" else "losses": count for outcome, count in counts.items()},
        "scores": [None if np.isnan(score) else _short(score) for score in results.scores[:, place]],
        "mean_share": _short(np.mean([game.share for game in games])) if games else None,
        "forfeits": len(reasons),
        **({"first_forfeit": reasons[0]} if reasons else {}),
    }


def forfeits_of(figures: dict[str, Any]) -> tuple[int, int, str]:
    """Return the numbers of forfeits and of all games, and the reason of the first forfeit."""
    tasks = [task for track in figures["tracks"].values() for task in track["opponents"]]
    reasons = [str(task["first_forfeit"]) for task in tasks if "first_forfeit" in task]
    return sum(task["forfeits"] for task in tasks), sum(task["games"] for task in tasks), next(iter(reasons), "")


def _how_soon(results: Results) -> dict[str, Any]:
    """Return the share of games won against uniform coverage, and the time to a win; a draw censors its length."""
    task = results.tasks[0]
    limit = results.protocol.game.time_limit
    games = [game for policy in range(results.policies) for game in results.of(policy, task)]
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


def improvement(results: Results, baseline: Results) -> dict[str, Any]:
    """Return the probability that a run of the entry is better than one of the baseline, over tasks of both."""

    def draw(generator: np.random.Generator, count: int) -> Array:
        both = zip(results.draw(generator, count), baseline.draw(generator, count), strict=True)
        return np.array([probability_of_improvement(*drawn) for drawn in both])

    low, high = middle(resampled(draw))
    value = probability_of_improvement(results.scores, baseline.scores)
    return {"probability": _short(value), "ci95": _short([low, high])}
