"""What a training run ends with: the learning curve, the table beside the baselines, and a game."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import MatchResult, paired_difference, play_match
from swarm_pz.files import draft_of
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.run_state import History

matplotlib.use("Agg")

CONSTANT = ("centre", "corners", "halo", "uniform")
"""Scripts that never change their command."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A baseline's match on the same seeds, and how much larger the tactic's share is than its."""

    match: MatchResult
    difference: float
    low: float
    high: float


def compare(
    trained: LearnedPolicy, untrained: LearnedPolicy, config: GameConfig, *, games: int, seed: int, threads: int
) -> tuple[MatchResult, list[Comparison]]:
    """Play the trained tactic and its baselines against uniform coverage, on the same seeds.

    Returns
    -------
    match : MatchResult
        The trained tactic's.
    comparisons : list of Comparison
        With its untrained network, `noise` and the best constant script; in place of these two with `hold`, where
        its control system takes no densities.
    """

    def play(policy: Any) -> MatchResult:
        return play_match(policy, "uniform", games=games, seed=seed, config=config, threads=threads)

    match = play(trained)
    if config.team_systems[0].takes == "density":
        constant = max((play(name) for name in CONSTANT), key=lambda played: float(played.summary()["mean_share"]))
        scripts = [play("noise"), constant]
    else:
        scripts = [play("hold")]
    comparisons = []
    for baseline in (play(untrained), *scripts):
        difference, low, high = paired_difference(match, baseline)
        comparisons.append(Comparison(match=baseline, difference=difference, low=low, high=high))
    return match, comparisons


def plot_learning_curve(history: History, opponent: str, path: Path) -> None:
    """Draw share and win rate of the evaluations against an opponent over environment steps."""
    steps = [record["step"] / 1000 for record in history.records]
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    low = [record["win_rate_low"] for record in history.records]
    high = [record["win_rate_high"] for record in history.records]
    axes.fill_between(steps, low, high, color="tab:orange", alpha=0.2, linewidth=0)
    axes.plot(steps, [record["win_rate"] for record in history.records], "o-", color="tab:orange", label="games won")
    axes.plot(steps, [record["loss_rate"] for record in history.records], "x--", color="tab:red", label="games lost")
    axes.plot(steps, [record["share"] for record in history.records], "o-", color="tab:blue", label="share of drones")
    explored = [(step, record["training_share"]) for step, record in zip(steps, history.records, strict=True)][1:]
    if explored:
        axes.plot(*zip(*explored, strict=True), ":", color="tab:blue", label="share while learning, all opponents")
    axes.axhline(0.5, color="grey", linewidth=0.8)
    axes.annotate(
        f"as good as {opponent} ",
        (1.0, 0.5),
        xycoords=axes.get_yaxis_transform(),
        ha="right",
        va="bottom",
        color="grey",
        fontsize=8,
    )
    axes.set(
        xlabel="thousand environment steps (1 s of game each)",
        ylabel=f"against {opponent}",
        ylim=(-0.02, 1.02),
        title="Learning curve: evaluations without exploration; band: 95 % interval of games won",
    )
    axes.title.set_fontsize(10)
    figure.legend(loc="outside lower center", ncols=4, fontsize=9)
    with draft_of(path) as draft:
        figure.savefig(draft, dpi=120)


def plot_sizes(match: MatchResult, path: Path) -> None:
    """Draw team sizes over time of every game of a match, red's share of all drones."""
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for game in match.unique:
        axes.plot([size / match.config.num_drones for size in game.sizes], linewidth=0.8, alpha=0.7)
    axes.axhline(0.5, color="grey", linewidth=0.8)
    axes.set(xlabel="time in s", ylabel="red's share of all drones", ylim=(-0.02, 1.02))
    axes.set_title(f"{match.policy} against {match.opponent}, {len(match.unique)} games", fontsize=10)
    figure.savefig(path, dpi=120)
