"""The command line: ``swarm-pz train | league | evaluate | tournament | play | replay | study | ...``.

The one place that knows every part of the project; each command imports what it needs, so that
``--help`` is quick and a missing extra is named only where it is wanted.
"""

from __future__ import annotations

import functools
import io
import itertools
import json as json_module
import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from swarm_pz import tables
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import SwarmError, require_extra
from swarm_pz.settings import check
from training.config import LeagueConfig, TrainConfig

try:
    import tyro
except ImportError:  # the entry point is installed even without the extra
    sys.exit(str(SwarmError("swarm-pz's commands need an extra: pip install 'swarm-pz[cli]'")))


_QUIET = 60.0
"""Seconds without a word that a log may have."""
_arguments: ContextVar[list[str]] = ContextVar("arguments")


def main(arguments: list[str] | None = None) -> None:
    """Run a command; errors of this project end it with one line and status 2."""
    commands: dict[str, Callable[..., None]] = {
        "train": train,
        "league": league,
        "evaluate": evaluate,
        "tournament": tournament,
        "play": play,
        "replay": replay,
        "study": study,
        "policies": list_policies,
        "render": render,
        "bench": bench,
        "warmup": warmup,
    }
    _arguments.set(sys.argv[1:] if arguments is None else arguments)
    try:
        tyro.extras.subcommand_cli_from_dict(
            commands,
            prog="swarm-pz",
            description="Swarm against swarm: train, measure, watch and play tactics.",
            args=arguments,
            config=(tyro.conf.AvoidSubcommands,),
        )
    except (SwarmError, OSError) as error:
        print(f"swarm-pz: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)


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
    from training.ppo import Training
    from training.report import compare, plot_learning_curve

    check(games >= 2 and games % 2 == 0, "games", games, "an even number of at least 2")
    run = Training(config, out, resume=resume, say=functools.partial(print, flush=True), command=_command())
    untrained = run.untrained()
    print(f"training for {config.total_steps:,} steps in {out} (stop and go on with --resume)", flush=True)
    trained = run.run()
    plot_learning_curve(run.history, config.opponents[0], out / "learning_curve.png")
    print(f"evaluating over {games} games against uniform coverage, beside the baselines", flush=True)
    match, comparisons = compare(trained, untrained, config.game, games=games, seed=0, threads=config.threads)
    match.write(out / "evaluation.json")
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
    import policies
    from policies.scripted import SCRIPTS
    from swarm_pz.match import play_match
    from training.selfplay import League

    check(games >= 2 and games % 2 == 0, "games", games, "an even number of at least 2")
    run = League(config, out, resume=resume, say=functools.partial(print, flush=True), command=_command())
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


def evaluate(
    policy: Annotated[str, tyro.conf.Positional],
    /,
    opponent: str = "uniform",
    games: int = 200,
    seed: int = 0,
    json: Path | None = None,
    threads: int = 2,
    held_out: bool = False,
    exploit: bool = False,
    exploit_steps: int = 1_000_000,
    out: Path = Path("runs/exploiter"),
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play a policy against an opponent and say how it did.

    Half of the games are played from each side, with the same seeds for both sides.

    Args:
        policy: Name of a policy, or a folder that training wrote.
        opponent: Name of a policy, or a folder that training wrote.
        games: Number of games, even.
        seed: Seed of the match.
        json: Write the figures to this file, too.
        threads: Threads that share the games.
        held_out: Play every script instead, and a suite of opponents and sizes that nobody trains against.
        exploit: Train a best response to the policy instead, and say what that wins.
        exploit_steps: Steps of that training.
        out: Folder of that training; a run that was stopped goes on.
        game: The rules.
    """
    import policies
    from swarm_pz.match import play_match

    check(not (held_out and exploit), "held_out and exploit", (held_out, exploit), "asked for one at a time")
    if held_out or exploit:
        check(opponent == "uniform", "opponent", opponent, "left out, since held_out and exploit choose their own")
    if held_out:
        _evaluate_held_out(policy, games, seed, json, threads, game)
        return
    if exploit:
        _evaluate_exploit(policy, games, seed, json, threads, game, exploit_steps, out)
        return
    with _progress() as progress:
        match = play_match(
            policies.load(policy, game),
            policies.load(opponent, game),
            games=games,
            seed=seed,
            config=game,
            threads=threads,
            progress=progress,
        )
    tables.print_matches([match])
    if json is not None:
        match.write(json)
        print(f"figures: {json}")


def _evaluate_held_out(policy: str, games: int, seed: int, json: Path | None, threads: int, game: GameConfig) -> None:
    from policies.held_out import play_suites

    with _progress() as progress:
        suites = play_suites(policy, game, games=games, seed=seed, threads=threads, progress=progress)
    figures = suites.to_dict()
    tables.print_opponents(suites.known, f"{policy} against the scripts: score {figures['in_suite_score']:.3f}")
    tables.print_opponents(
        suites.held_out, f"{policy} against the held-out suite: score {figures['held_out_score']:.3f}"
    )
    print(f"generalisation (held-out score less in-suite score): {figures['generalisation']:+.3f}")
    if json is not None:
        _write_json(figures, json)


def _evaluate_exploit(
    policy: str, games: int, seed: int, json: Path | None, threads: int, game: GameConfig, steps: int, out: Path
) -> None:
    for module in ("torch", "stable_baselines3"):
        require_extra(module, "training")
    from training.exploit import exploit

    say = functools.partial(print, flush=True)
    matches = exploit(policy, out, steps=steps, games=games, rules=game, seed=seed, threads=threads, say=say)
    tables.print_opponents(matches, f"an exploiter of {policy}, trained for {steps:,} steps")
    if json is not None:
        _write_json({"target": policy, "steps": steps, "matches": [match.summary() for match in matches]}, json)


def tournament(
    players: Annotated[tuple[str, ...], tyro.conf.Positional] = (),
    /,
    games: int = 40,
    seed: int = 0,
    budget_ms: float = 2000.0,
    processes: int = 2,
    out: Path = Path("runs/ladder"),
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play every player against every other and write the ladder.

    A tournament that was stopped goes on where it was; more players or games may be added later.

    Args:
        players: Names of policies, or folders that training wrote; all installed policies if none.
        games: Games of every two players, even, half from each side.
        seed: Seed of the tournament; all pairings play the same starts.
        budget_ms: Milliseconds that a command may take; who takes longer forfeits the game.
        processes: Processes that share the games.
        out: Folder of the tournament: games.jsonl, ladder.md, ladder.json and ladder.png.
        game: The rules.
    """
    for module in ("choix", "matplotlib.figure"):
        require_extra(module, "ladder")
    import policies
    from swarm_pz import ladder
    from swarm_pz.tournament import Tournament, TournamentConfig

    config = TournamentConfig(games=games, seed=seed, budget_ms=budget_ms, game=game)
    field = Tournament(players or policies.names(), config, out, policies.load)
    with _progress() as progress:
        field.play(processes, progress)
    figures = ladder.make_ladder(field)
    (out / "ladder.json").write_text(json_module.dumps(figures, indent=2) + "\n")
    (out / "ladder.md").write_text(ladder.to_markdown(figures, _command(), "ladder.png"))
    ladder.plot(figures, out / "ladder.png")
    tables.print_ladder(figures)
    print(f"ladder: {out / 'ladder.md'}, {out / 'ladder.json'}, {out / 'ladder.png'}")


def play(
    opponent: str | None = None,
    host: str = "127.0.0.1",
    port: int = 8000,
    min_command_interval: float = 0.5,
    out: Path = Path("runs/games"),
) -> None:
    """Serve the table: play in a browser, against a person or a policy; every game is recorded.

    Args:
        opponent: Go straight into a game against this policy; "none" is a practice arena without opponents.
        host: Where to listen; 0.0.0.0 lets the local network in.
        port: Port to listen at; 0 takes any that is free.
        min_command_interval: Seconds of game between two commands of a team, whoever gives them.
        out: Folder of the recordings.
    """
    _need_play()
    import policies
    from swarm_pz.play.serve import serve

    if opponent is not None and opponent != "none":
        policies.load(opponent, GameConfig())
    page = f"play={opponent}" if opponent is not None else ""
    say = functools.partial(print, flush=True)
    serve(
        policies.load,
        host=host,
        port=port,
        folder=out,
        page=page,
        min_command_interval=min_command_interval,
        say=say,
        draw_code=_draw_code,
    )


def replay(
    recording: Annotated[Path, tyro.conf.Positional],
    /,
    verify: bool = False,
    film: Path | None = None,
    speed: float = 2.0,
    host: str = "127.0.0.1",
    port: int = 8000,
) -> None:
    """Watch a recorded game in a browser, and take it over from any moment; or verify or film it.

    Args:
        recording: File that the table wrote.
        verify: Only say whether the game comes out as recorded when it is simulated here.
        film: Only write it as a film, .gif or .mp4.
        speed: Seconds of game a second of film.
        host: Where to listen; 0.0.0.0 lets the local network in.
        port: Port to listen at; 0 takes any that is free.
    """
    _need_play()
    import policies
    from swarm_pz.play.playback import Playback
    from swarm_pz.play.recording import Recording, checked_name
    from swarm_pz.play.serve import serve

    check(speed > 0, "speed", speed, "above 0")
    playback = Playback(Recording.read(recording))
    if film is not None:
        playback.film(film, speed)
        print(f"film: {film}")
    if verify:
        result = playback.verify()
        if not result.verified:
            raise SwarmError(
                f"{recording} plays differently here from tick {result.first_difference} on: it was changed, or "
                "recorded by another version or on another kind of processor"
            )
        print(f"verified: {result.frames} frames of {recording} come out as recorded")
    if film is None and not verify:
        page = f"replay={checked_name(recording.name)}"
        say = functools.partial(print, flush=True)
        serve(policies.load, host=host, port=port, folder=recording.parent, page=page, say=say, draw_code=_draw_code)


def study(
    folder: Annotated[Path, tyro.conf.Positional],
    /,
    out: Path = Path("runs/study"),
    parquet: bool = False,
) -> None:
    """Turn a folder of recorded games into tables.

    Args:
        folder: Folder of recordings.
        out: Folder to write seats, summary and their schema to.
        parquet: Write Parquet instead of CSV.
    """
    _need_play()
    from swarm_pz.play import study as tables_of

    rows, faults = tables_of.read_folder(folder)
    for fault in faults:
        print(f"left out: {fault}", file=sys.stderr)
    for path in tables_of.write_tables(rows, out, parquet=parquet):
        print(path)
    tables.print_study(tables_of.summarise(rows))


def _need_play() -> None:
    for module in ("msgspec", "starlette", "uvicorn", "websockets"):
        require_extra(module, "play")


def _draw_code(address: str) -> str:
    picture = io.StringIO()
    require_extra("segno", "play").make(address).terminal(picture, compact=True)
    return picture.getvalue()


def list_policies() -> None:
    """List the installed policies."""
    from swarm_pz.policy import about, registered

    for name in sorted(registered()):
        print(f"{name:<12} {about(name)}".rstrip())


def render(
    red: Annotated[str, tyro.conf.Positional] = "ring",
    blue: Annotated[str, tyro.conf.Positional] = "uniform",
    /,
    out: Path = Path("game.mp4"),
    seed: int = 0,
    seconds: float | None = None,
    speed: float = 2.0,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play one game between two policies and write it as a film.

    Args:
        red: Name of a policy, or a folder that training wrote.
        blue: Name of a policy, or a folder that training wrote.
        out: File to write, .gif or .mp4.
        seed: Seed of the game.
        seconds: Show this much of the game at most.
        speed: Seconds of game a second of film.
        game: The rules.
    """
    import policies
    from swarm_pz.film import film_game

    standing = film_game(
        policies.load(red, game),
        policies.load(blue, game),
        out,
        config=game,
        seed=seed,
        seconds=seconds,
        speed=speed,
    )
    print(f"{standing}: {out}")


def bench(
    games: tuple[int, ...] = (1, 16, 64, 256, 1024),
    drones: tuple[int, ...] = (10, 20, 100, 1000),
    threads: tuple[int, ...] = (1, 2),
    grid: int = 50,
    repeats: int = 3,
    json: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Measure how fast the simulator and the environments are here.

    Args:
        games: Numbers of games side by side.
        drones: Numbers of drones in a game, both teams together, even.
        threads: Numbers of threads.
        grid: Cells a side of the observations of both seats; scripted opponents have their own.
        repeats: Measurements of each, of which the median is shown.
        json: Write the figures to this file, too.
        plot: Draw the figures into this file, too.
    """
    from swarm_pz import bench as speed

    if plot is not None:
        require_extra("matplotlib.figure", "training")
    for name, values in (("games", games), ("drones", drones), ("threads", threads), ("repeats", (repeats,))):
        check(bool(values) and min(values) >= 1, name, values, "at least 1")
    check(all(size % 2 == 0 for size in drones), "drones", drones, "even, for two teams alike")
    faces: dict[str, speed.Face] = {"simulator": speed.simulator_face, "batch_env": speed.batch_env_face}
    try:
        from training.vec_env import SwarmVecEnv
    except ImportError:
        print("stable-baselines3 is not installed: SwarmVecEnv is left out")
    else:

        def against(opponent: str) -> speed.Face:
            def make(config: GameConfig, count: int, workers: int) -> speed.Step:
                env = SwarmVecEnv(config, count, opponent=opponent, threads=workers, seed=0)
                env.action_space.seed(0)
                env.reset()
                actions = itertools.cycle(
                    [np.stack([env.action_space.sample() for _ in range(count)]) for _ in range(4)]
                )

                def step() -> None:
                    env.step(next(actions))

                return step

            return make

        faces |= {f"SwarmVecEnv, {opponent}": against(opponent) for opponent in ("uniform", "ring")}
    faces["parallel_env"] = speed.parallel_env_face
    say = functools.partial(print, flush=True)
    speeds = speed.measure(faces, games=games, drones=drones, threads=threads, grid=grid, repeats=repeats, say=say)
    config = GameConfig(observation=ObservationConfig(grid=grid))
    say("phases")
    figures = speed.to_dict(speeds, speed.phases(config), config)
    tables.print_speeds(figures)
    if json is not None:
        _write_json(figures, json)
    if plot is not None:
        speed.plot(speeds, plot)
        print(f"plot: {plot}")


def warmup() -> None:
    """Compile everything that a game with default numbers of modes and points ahead needs."""
    from swarm_pz.bench import batch_env_face

    began = time.monotonic()
    batch_env_face(GameConfig(), 2, 1)()
    print(f"compiled kernels are ready after {time.monotonic() - began:.1f} s")


def _command() -> str:
    """Return the command that is being run."""
    return shlex.join(["swarm-pz", *_arguments.get()])


@contextmanager
def _progress() -> Iterator[Callable[[int, int], None]]:
    """Show a bar while games are played, or a line now and then in a log; give the function that moves it."""
    progress = require_extra("rich.progress", "cli")
    with progress.Progress(transient=True) as bar:
        task = bar.add_task("playing", total=None)
        said = time.monotonic()

        def move(done: int, total: int) -> None:
            nonlocal said
            bar.update(task, completed=done, total=total)
            if not bar.console.is_terminal and time.monotonic() - said > _QUIET:
                said = time.monotonic()
                print(f"{done:,} of {total:,} games", flush=True)

        yield move


def _write_json(figures: dict[str, Any], path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json_module.dumps(figures, indent=2) + "\n")
    print(f"figures: {path}")


if __name__ == "__main__":
    main()
