"""A step of games in one call: commands come into force, ticks pass, and a report is written."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_pz.kernels import entry_point, exact_part
from swarm_pz.kernels.arrays import Bools, Float64s, Int64s
from swarm_pz.kernels.controllers.ergodic import ErgodicParameters, ergodic, make_scratch
from swarm_pz.kernels.fourier import Aims, set_target
from swarm_pz.kernels.game import Games, RuleParameters, RuleVariants, advance_games, has_loser, swarm_of


class Report(NamedTuple):
    """The result of a step of each game, written in place; arrays have length 0 if no report is wanted."""

    limit: int
    """Ticks of the time limit."""
    size_change: float
    mean_size: float
    outcome: float
    """Weights of the reward, see `red_reward`."""
    running: Bools
    """(E,) games that have begun and not ended; updated."""
    rewards: Float64s
    """(E, 2) zeros: overwritten."""
    terminated: Bools
    """(E,) overwritten: one team owns every drone."""
    truncated: Bools
    """(E,) overwritten: time is up."""
    captured: Int64s
    """(E, 2) captures before the step: overwritten with those within it."""
    recaptured: Int64s
    """(E, 2) the same."""


_NOBODY, _NO_PAIRS = np.zeros(0, np.bool_), np.zeros((0, 2), np.int64)
NO_REPORT = Report(
    0, 0.0, 0.0, 0.0, _NOBODY, np.zeros((0, 2)), terminated=_NOBODY, truncated=_NOBODY, captured=_NO_PAIRS,
    recaptured=_NO_PAIRS,
)  # fmt: skip


def red_reward(gained, decided, won, size_change: float, mean_size: float, outcome: float):  # type: ignore[no-untyped-def]
    """Return red's reward of a step, for one game or many; blue's is its negative.

    `size_change` times the drones that red gained over the mean starting size of a team, plus `outcome` times 1 for a
    win or -1 for a loss.
    """
    return size_change * (gained / mean_size) + outcome * (decided * (2.0 * won - 1.0) + 0.0)


_red_reward = exact_part(red_reward)


@exact_part
def report_on(games: Games, e: int, can_win: bool, report: Report) -> None:
    """Report how a step of game `e` went."""
    for team in range(2):
        report.captured[e, team] = games.captures[e, team] - report.captured[e, team]
        report.recaptured[e, team] = games.recaptures[e, team] - report.recaptured[e, team]
    decided = report.running[e] and can_win and has_loser(games.teams[e])
    truncated = report.running[e] and not decided and games.ticks[e] >= report.limit
    if decided or truncated:
        report.running[e] = False
    report.terminated[e], report.truncated[e] = decided, truncated
    gained, won = report.captured[e, 0] - report.captured[e, 1], games.teams[e, 0] == 0
    reward = _red_reward(gained, decided, won, report.size_change, report.mean_size, report.outcome)
    report.rewards[e, 0], report.rewards[e, 1] = reward, 0.0 - reward


@entry_point
def step_games(
    games: Games,
    rows: Int64s,
    ticks: Int64s,
    rules: RuleParameters,
    controller: ErgodicParameters,
    variants: RuleVariants | None,
    densities: Float64s,
    aims: Aims,
    report: Report,
) -> None:
    """Step the games `rows`, each by its own number of ticks (indexed by game), unless a team owns every drone.

    `densities` (E, 2, A, A) come into force in games that are stepped; (0, 2, A, A): none do. With a report, games
    keep to the time limit, and only running games are stepped.
    """
    is_reported = len(report.running) > 0
    left, advancing, count = ticks.copy(), np.empty(len(rows), np.int64), 0
    for e in rows:
        if is_reported:
            left[e] = min(left[e], report.limit - games.ticks[e]) if report.running[e] else 0
        if left[e] > 0 and not (rules.capture_enabled and has_loser(games.teams[e])):
            advancing[count] = e
            count += 1
    if len(densities):
        for e in advancing[:count]:
            for team in range(2):
                set_target(densities[e, team], e, team, aims, aims.sent)
    advance_games(games, advancing[:count], left, rules, controller, variants)
    if is_reported:
        for e in rows:
            report_on(games, e, rules.capture_enabled, report)


@entry_point
def solve(games: Games, controller: ErgodicParameters) -> None:
    """Run `ergodic` once in every game, for benchmarks; no real game has the resulting state, so restore a snapshot."""
    scratch = make_scratch(games.teams.shape[1], controller)
    for e in range(games.ticks.shape[0]):
        ergodic(swarm_of(games, e, controller.warm_start), games.coefficients[e], controller, scratch)
