"""The course of a game: who leads, until when, and how often drones change sides."""

from __future__ import annotations

import numpy as np

from swarm_pz.evaluation.rollout import Rollout


class Captures:
    """Keeps how many drones have changed sides so far, after every step."""

    def __init__(self, games: int) -> None:
        self.totals: list[list[int]] = [[0] for _ in range(games)]

    def __call__(self, rollout: Rollout) -> None:
        """Look at the games that were running."""
        captures = rollout.simulator.games.captures.sum(axis=1)
        for row in rollout.rows.tolist():
            self.totals[row].append(int(captures[row]))


def rates_of_middle_and_end(totals: list[int]) -> tuple[float, float]:
    """Return captures a step in the three fifths in the middle of a game, and in its last fifth."""
    steps = len(totals) - 1
    first, last = round(steps / 5), round(4 * steps / 5)
    middle, end = ((totals[b] - totals[a]) / max(b - a, 1) for a, b in ((first, last), (last, steps)))
    return middle, end


def lead_taken(sizes: list[int], total: int) -> float:
    """Return the share of a won game after which the winner led for good."""
    lead = np.sign(2 * np.asarray(sizes) - total)
    others = np.flatnonzero(lead != lead[-1])
    return float((others[-1] + 1) / (len(lead) - 1)) if len(others) else 0.0


def turns_of_lead(sizes: list[int], total: int) -> int:
    """Count how often the larger team becomes the smaller one; equal sizes in between do not count."""
    lead = np.sign(2 * np.asarray(sizes) - total)
    lead = lead[lead != 0]
    return int((lead[1:] != lead[:-1]).sum())
