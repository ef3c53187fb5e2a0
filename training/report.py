"""Reports at the end of a training run: the learning curve, and matches to compare it with baselines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import MatchResult, play_match
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.rendering.plots import GREY, drawing


def compare(
    trained: LearnedPolicy, untrained: LearnedPolicy, config: GameConfig, *, games: int, seed: int, threads: int
) -> tuple[MatchResult, list[MatchResult]]:
    """Return the matches of the trained tactic and of its baselines against uniform coverage, on the same seeds.

    Baselines are its untrained network and `noise`, or `hold` where its control system takes no densities.
    """

    def play(policy: Any) -> MatchResult:
        return play_match(policy, "uniform", games=games, seed=seed, config=config, threads=threads)

    blind = "noise" if config.team_systems[0].takes == "density" else "hold"
    return play(trained), [play(untrained), play(blind)]


def plot_learning_curve(records: list[dict[str, float]], opponent: str, path: Path) -> None:
    """Plot evaluations (`RunState.records`) against an opponent over steps: win rate, loss rate and share."""
    columns = {name: [record[name] for record in records] for name in records[0]}
    steps = [step / 1000 for step in columns["step"]]
    with drawing(path) as figure:
        axes = figure.add_subplot()
        axes.plot(steps, columns["win_rate"], marker="o", markersize=4, label="games won, 95 %")
        axes.fill_between(steps, columns["win_rate_low"], columns["win_rate_high"], color="C0", alpha=0.15, linewidth=0)
        axes.plot(steps, columns["loss_rate"], marker="x", markersize=4, label="games lost")
        axes.plot(steps, columns["share"], marker="D", markersize=3, label="share of drones")
        if explored := columns["training_share"][1:]:  # none before the first game
            axes.plot(steps[1:], explored, label="share of drones while learning, all opponents")
        axes.axhline(0.5, color=GREY, linewidth=0.8)
        axes.set(
            xlabel="thousand commands, 1 s of game each",
            ylim=(-0.02, 1.02),
            title=f"Evaluations against {opponent}, without exploration",
        )
        figure.legend(loc="outside lower center", ncols=2)
