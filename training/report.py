"""The end of a training run: the learning curve, and the table beside the baselines."""

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

matplotlib.use("Agg")


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

    Baselines are its untrained network and `noise`, or `hold` where its control system takes no densities.
    """

    def play(policy: Any) -> MatchResult:
        return play_match(policy, "uniform", games=games, seed=seed, config=config, threads=threads)

    match, comparisons = play(trained), []
    for baseline in (play(untrained), play("noise" if config.team_systems[0].takes == "density" else "hold")):
        difference, low, high = paired_difference(match, baseline)
        comparisons.append(Comparison(match=baseline, difference=difference, low=low, high=high))
    return match, comparisons


def plot_learning_curve(records: list[dict[str, float]], opponent: str, path: Path) -> None:
    """Draw share and win rate of the evaluations against an opponent, as `RunState.records` has them, over steps."""
    columns = {name: [record[name] for record in records] for name in records[0]}
    steps = [step / 1000 for step in columns["step"]]
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    low, high = columns["win_rate_low"], columns["win_rate_high"]
    axes.fill_between(steps, low, high, color="tab:orange", alpha=0.2, linewidth=0)
    axes.plot(steps, columns["win_rate"], "o-", color="tab:orange", label="games won")
    axes.plot(steps, columns["loss_rate"], "x--", color="tab:red", label="games lost")
    axes.plot(steps, columns["share"], "o-", color="tab:blue", label="share of drones")
    if explored := columns["training_share"][1:]:  # none before the first game
        axes.plot(steps[1:], explored, ":", color="tab:blue", label="share while learning, all opponents")
    axes.axhline(0.5, color="grey", linewidth=0.8)
    in_axes, grey = axes.get_yaxis_transform(), "grey"
    axes.text(1.0, 0.5, f"as good as {opponent} ", transform=in_axes, ha="right", va="bottom", color=grey, fontsize=8)
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
