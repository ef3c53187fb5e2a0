"""Commands that learn: ``train`` and ``league``."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Annotated

import tyro

from swarm_pz import tables
from swarm_pz.cli.report import command, print_rules
from swarm_pz.errors import require_extra
from swarm_pz.settings import check
from swarm_pz.training.config import LeagueConfig, TrainConfig


def train(
    config: Annotated[TrainConfig, tyro.conf.arg(name="")] = TrainConfig(),  # noqa: B008  (frozen)
    out: Path = Path("runs/first"),
    resume: bool = False,
    games: int = 100,
) -> None:
    """Train a tactic with PPO, measure it against uniform coverage and show the result.

    Args:
        config: The training run.
        out: Folder of the run.
        resume: Go on from the folder's last checkpoint.
        games: Games of the evaluation at the end, even.
    """
    for module in ("torch", "stable_baselines3", "matplotlib"):
        require_extra(module, "training")
    from swarm_pz.film import film_game
    from swarm_pz.training.ppo import Training
    from swarm_pz.training.report import compare, plot_learning_curve

    check(games >= 2 and games % 2 == 0, "games", games, "an even number of at least 2")
    run = Training(config, out, resume=resume, say=functools.partial(print, flush=True), command=command())
    print_rules(config.game)
    untrained = run.untrained()
    print(f"training for {config.total_steps:,} steps in {out} (stop and go on with --resume)", flush=True)
    trained = run.run()
    plot_learning_curve(run.history, config.opponents[0], out / "learning_curve.png")
    print(f"evaluating over {games} games against uniform coverage, beside the baselines", flush=True)
    match, comparisons = compare(trained, untrained, config.game, games=games, seed=0, threads=config.threads)
    match.write(out / "evaluation.json", command())
    trained.with_results(match.summary()).write(out)
    tables.print_matches([match, *(comparison.match for comparison in comparisons)])
    for comparison in comparisons:
        print(
            f"share above {comparison.match.policy:<10} {comparison.difference:+.3f} "
            f"(95 % interval {comparison.low:+.3f} to {comparison.high:+.3f})"
        )
    standing = film_game(trained, "uniform", out / "game.mp4", config=config.game, seed=1, speed=4.0)
    print(f"learning curve: {out / 'learning_curve.png'}\none game, {standing}: {out / 'game.mp4'}")
    print(f"policy: {out}  (try: swarm-pz evaluate {out} --opponent ring)")


def league(
    config: Annotated[LeagueConfig, tyro.conf.arg(name="")] = LeagueConfig(),  # noqa: B008  (frozen)
    out: Path = Path("runs/league"),
    resume: bool = False,
    games: int = 40,
) -> None:
    """Train a tactic in a league: against scripts, its own snapshots, and exploiters of itself.

    Args:
        config: The league.
        out: Folder of the league.
        resume: Go on from where the folder's league is.
        games: Games against each script at the end, even.
    """
    for module in ("torch", "stable_baselines3", "choix"):
        require_extra(module, "training")
    from swarm_pz import policies
    from swarm_pz.match import play_match
    from swarm_pz.policies.scripted import SCRIPTS
    from swarm_pz.training.selfplay import League

    check(games >= 2 and games % 2 == 0, "games", games, "an even number of at least 2")
    run = League(config, out, resume=resume, say=functools.partial(print, flush=True), command=command())
    print_rules(config.learner.game)
    policy = run.run()
    learner = config.learner
    matches = [
        play_match(
            policy,
            policies.load(script.__name__, learner.game),
            games=games,
            config=learner.game,
            threads=learner.threads,
        )
        for script in SCRIPTS
    ]
    policy.with_results({match.opponent: match.summary() for match in matches}).write(out)
    tables.print_opponents(matches, f"{out.name} against the scripts")
    print(f"policy: {out}")
