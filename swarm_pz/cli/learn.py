"""Commands that learn: ``train``, ``sweep`` and ``league``; ``export`` writes what was learned as ONNX."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from swarm_pz.cli import printing as tables
from swarm_pz.cli.interruption import goes_on_with, stops_at_safe_points
from swarm_pz.cli.options import ONE_WORKER, WORKERS, WorkerOptions
from swarm_pz.cli.player_options import Player
from swarm_pz.cli.report import command, in_seconds, need, print_rules, program, progress, say
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.files import check_folder
from swarm_pz.policy import load
from swarm_pz.training.config import LeagueConfig, TrainConfig


def _check_games(games: int) -> None:
    check(games >= 2 and games % 2 == 0, "games", games, "an even number of at least 2")


def train(
    config: Annotated[TrainConfig, tyro.conf.arg(name="")] = TrainConfig(),  # noqa: B008  (frozen)
    out: Path = Path("runs/first"),
    games: int = 100,
) -> None:
    """Train a tactic with PPO, measure it against uniform coverage and show the result.

    The same command continues a stopped run.

    Args:
        config: The training run.
        out: Folder of the run, with its curves for TensorBoard.
        games: Games of the evaluation at the end; must be even.
    """
    need("train", "torch", "stable_baselines3", "matplotlib")
    from swarm_pz.evaluation.match import paired_difference
    from swarm_pz.film import film_game
    from swarm_pz.training.ppo import Training
    from swarm_pz.training.report import compare, plot_learning_curve

    _check_games(games)
    run = Training(config, out, say=say, command=command())
    print_rules(config.game)
    with goes_on_with(command()):
        untrained = run.untrained()
        if not run.is_finished:
            say(f"training for {config.total_steps:,} steps in {out} (Ctrl-C stops, the same command goes on)")
        with stops_at_safe_points() as should_stop:
            trained = run.run(should_stop)
        plot_learning_curve(run.state.records, config.opponents[0], out / "learning_curve.png")
        say(f"evaluating over {games} games against uniform coverage, beside the baselines")
        match, baselines = compare(trained, untrained, config.game, games=games, seed=0, threads=config.threads)
        match.write(out / "evaluation.json", command())
        trained.with_results(match.summary()).write(out)
        tables.print_matches([match, *baselines])
        for baseline in baselines:
            above, low, high = paired_difference(match, baseline)
            print(f"share above {baseline.policy:<10} {above:+.3f} (95 % interval {low:+.3f} to {high:+.3f})")
        with in_seconds() as show:
            standing = film_game(
                trained, "uniform", out / "game.mp4", config=config.game, seed=1, speed=4.0, progress=show
            )
    print(f"learning curve: {out / 'learning_curve.png'}\none game, {standing}: {out / 'game.mp4'}")
    flown = config.game.team_systems[0].name
    rules = "" if flown == "ergodic" else f" --game.controllers {flown} ergodic"
    print(f"policy: {out}  (try: {program()} evaluate {out} --opponent ring{rules})")


def sweep(
    config: Annotated[TrainConfig, tyro.conf.arg(name="")] = TrainConfig(threads=1),  # noqa: B008  (frozen)
    seeds: tuple[int, ...] = (0, 1, 2),
    out: Path = Path("runs/sweep"),
    workers: WorkerOptions = WORKERS,
    games: int = 100,
) -> None:
    """Train a policy for each of several seeds, as the benchmark requires of a method.

    The same command continues a stopped run.

    Args:
        config: The settings of all runs, except their seed.
        seeds: Seeds, one for each policy.
        out: Folder of the runs: seed-0, seed-1, and so on.
        games: Games of the evaluation at the end; must be even.
    """
    need("train", "torch", "stable_baselines3")
    from swarm_pz.evaluation.match import play_match
    from swarm_pz.training.sweep import sweep as train_all

    _check_games(games)
    check(config.seed == TrainConfig().seed, "seed", config.seed, "left out: --seeds names them")
    check_folder(out)
    with goes_on_with(command()), workers.open() as pool:
        with progress("steps", "training") as show, stops_at_safe_points() as should_stop:
            trained = train_all(
                config, seeds, out, pool, should_stop=should_stop, say=say, show=show, command=command()
            )
        print_rules(config.game)
        tables.print_matches([play_match(policy, "uniform", games=games, config=config.game) for policy in trained])
    folders = " ".join(str(out / f"seed-{seed}") for seed in seeds)
    print(f"policies: {folders}  (try: {program()} benchmark {folders} --name {out.name})")


def league(
    config: Annotated[LeagueConfig, tyro.conf.arg(name="")] = LeagueConfig(),  # noqa: B008  (frozen)
    out: Path = Path("runs/league"),
    games: int = 40,
    workers: WorkerOptions = ONE_WORKER,
) -> None:
    """Train a tactic in a league: against scripts, patterns, its own snapshots, and its exploiters.

    The same command continues a stopped run.

    Args:
        config: The league.
        out: Folder of the league.
        games: Games against each script at the end; must be even.
    """
    need("train", "torch", "stable_baselines3")
    from swarm_pz.evaluation.match import play_match
    from swarm_pz.evaluation.workers import SerialExecutor
    from swarm_pz.policies.scripted import SCRIPTS
    from swarm_pz.training.selfplay import League

    _check_games(games)
    learner = config.learner
    with goes_on_with(command()), workers.open() as pool:
        run = League(config, out, say=say, command=command(), workers=pool)
        print_rules(learner.game)
        if not isinstance(pool, SerialExecutor) and not config.async_delay and config.exploiter_steps:
            say("the learner waits for exploiters where they begin: --async-delay 500000 lets it go on meanwhile")
        if not run.main.is_finished:
            say(f"training for {learner.total_steps:,} steps in {out} (Ctrl-C stops, the same command goes on)")
        with stops_at_safe_points() as should_stop:
            policy = run.run(should_stop)
        matches = [
            play_match(policy, script.__name__, games=games, config=learner.game, threads=learner.threads)
            for script in SCRIPTS
        ]
    policy.with_results({match.opponent: match.summary() for match in matches}).write(out)
    tables.print_matches(matches, "opponent", f"{out.name} against the scripts")
    print(f"policy: {out}")


def export(
    policy: Player,
    out: Path,
    /,
    trust: bool = False,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Write a learned policy, or a saved Stable-Baselines3 model, as an ONNX file with a card that describes it.

    Args:
        policy: Name of a learned policy, a folder that training wrote, or a file.zip of Stable-Baselines3.
        out: Folder to write; its path is then the policy's name.
        trust: Open the file.zip. It is a pickle: opening it runs any code in it, so trust only your own files.
        game: The game that the policy plays: number of drones, observation, and control system.
    """
    from swarm_pz.policies.onnx_policy import check_new

    check_new(out)  # before libraries are imported, which takes seconds
    need("train", "torch", "stable_baselines3")
    is_model, system = policy.lower().endswith(".zip"), game.team_systems[0]
    if is_model and not trust:
        raise CheckpointError(
            f"{policy} is a pickle, and opening it runs whatever code it holds: if you made it yourself, say "
            f"--trust; of others take nothing but ONNX files"
        )
    with progress("files", "exporting"):
        from swarm_pz.policies.learned import LearnedPolicy

        learned = None if is_model else load(policy, game, system)
        if learned is not None and not isinstance(learned, LearnedPolicy):
            raise PolicyError(
                f"only networks can be exported, and {policy!r} is none: expected a folder that training wrote, a "
                "learned policy's name, or a file.zip of Stable-Baselines3"
            )
        need("train", "onnx", "onnxruntime", "onnxscript")
        from swarm_pz.policies import exporting

        if learned is None:
            exporting.export_model(exporting.load_model(Path(policy)), game, system, out, Path(policy).stem)
        else:
            exporting.export_learned(learned, game, system, out)
    print(f"wrote {out}; try it: {program()} evaluate {out}")
