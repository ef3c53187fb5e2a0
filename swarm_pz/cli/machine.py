"""Commands about one game and the simulator: ``render``, ``diagnose``, ``bench`` and ``warmup``."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import itertools
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np

from swarm_pz.cli import printing as tables
from swarm_pz.cli.player_options import Player
from swarm_pz.cli.report import in_seconds, print_rules, say, write_json
from swarm_pz.config import BLUE, RED, TEAM_NAMES, GameConfig, ObservationConfig
from swarm_pz.config.base import check
from swarm_pz.errors import require_extra
from swarm_pz.files import check_file, draft_of

Side = Literal["red", "blue"]


def render(
    policy: Player = "ring",
    opponent: Player = "uniform",
    /,
    out: Path = Path("game.mp4"),
    seed: int = 0,
    pair: int = 0,
    side: Side = "red",
    seconds: float | None = None,
    speed: float = 2.0,
    overlay: tuple[Literal["target", "coverage", "captures", "potential"], ...] = (),
    overlay_team: Literal["red", "blue", "both"] = "red",
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play one game of a match between two policies and write it as a film, or one moment of it as a picture.

    With the same players, seed and rules it is that game of swarm-pz evaluate.

    Args:
        policy: Name of a policy, a folder that training wrote, FILE.py:NAME, a tactic in a file, or exec:PROGRAM.
        opponent: Named in the same ways.
        out: File to write: .gif or .mp4, or .png for a picture.
        seed: Seed of the match.
        pair: Number of the pair of games from one start.
        side: Which game of the pair: the side that the policy plays.
        seconds: Show this much of the game at most; the moment of a picture, its end if not given.
        speed: Seconds of game a second of film.
        overlay: What to show on the ground: the density that a team was asked for, the one that its controller
            sees it cover, where it captures, the potential that pushes its drones.
        overlay_team: The team that overlays are of.
        game: The rules.
    """
    from swarm_pz import policies
    from swarm_pz.analysis.video import film_game
    from swarm_pz.rendering.overlays import make_overlays

    teams = (RED, BLUE) if overlay_team == "both" else (TEAM_NAMES.index(overlay_team),)
    with in_seconds() as show:
        standing = film_game(
            policies.load(policy, game),
            policies.load(opponent, game),
            out,
            config=game,
            seed=seed,
            pair=pair,
            side=side,
            seconds=seconds,
            speed=speed,
            overlays=make_overlays(overlay, teams),
            progress=show,
        )
    print(f"{standing}: {out}")
    print_rules(game)


def diagnose(
    policy: Player = "ring",
    opponent: Player = "uniform",
    /,
    out: Path = Path("game.png"),
    json: Path | None = None,
    seed: int = 0,
    pair: int = 0,
    side: Side = "red",
    seconds: float | None = None,
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Play one game of a match between two policies and plot sizes, captures, coverage and commands over time.

    With the same players, seed and rules it is that game of swarm-pz evaluate.

    Args:
        policy: Name of a policy, a folder that training wrote, FILE.py:NAME, a tactic in a file, or exec:PROGRAM.
        opponent: Named in the same ways.
        out: File to write, .png, .pdf or .svg.
        json: Write the curves to this file, too.
        seed: Seed of the match.
        pair: Number of the pair of games from one start.
        side: Which game of the pair: the side that the policy plays.
        seconds: Play this much of the game at most.
        game: The rules.
    """
    from swarm_pz import policies
    from swarm_pz.analysis import diagnosis

    require_extra("matplotlib.figure", "cli")
    check(out.suffix in (".png", ".pdf", ".svg"), "out", str(out), "a file .png, .pdf or .svg")
    for path in filter(None, (out, json)):
        check_file(path)
    players = policies.load(policy, game), policies.load(opponent, game)
    found = diagnosis.diagnose(*players, config=game, seed=seed, pair=pair, side=side, seconds=seconds)
    with draft_of(out) as draft:
        diagnosis.plot(found, draft)
    print(f"{found.title}: {out}")
    print_rules(game)
    if json is not None:
        write_json(found.to_dict(), json, game)


def bench(
    games: tuple[int, ...] = (1, 16, 64, 256, 1024),
    drones: tuple[int, ...] = (10, 20, 100, 1000),
    threads: tuple[int, ...] = (1, 2),
    grid: int = 50,
    repeats: int = 3,
    json: Path | None = None,
    plot: Path | None = None,
    jax: bool = False,
) -> None:
    """Measure how fast the simulator and the environments are here.

    Args:
        games: Numbers of games side by side.
        drones: Numbers of drones in a game, both teams together, even.
        threads: Numbers of threads.
        grid: Cells a side of the observations of both sides; scripted opponents have their own.
        repeats: Measurements of each, of which the median is shown.
        json: Write the figures to this file, too.
        plot: Draw the figures into this file, too.
        jax: Measure games in JAX, too, on the device that it finds; on an accelerator with --games up to 65536.
    """
    from swarm_pz import bench as speed

    if plot is not None:
        require_extra("matplotlib.figure", "cli")
    for name, values in (("games", games), ("drones", drones), ("threads", threads), ("repeats", (repeats,))):
        check(bool(values) and min(values) >= 1, name, values, "at least 1")
    check(all(size % 2 == 0 for size in drones), "drones", drones, "even, for two teams alike")
    for path in filter(None, (json, plot)):
        check_file(path)
    apis: dict[str, speed.MakeStep] = {"simulator": speed.make_simulator_step, "batch_env": speed.make_batch_env_step}
    if importlib.util.find_spec("stable_baselines3") is None:
        print("stable-baselines3 is not installed: SwarmVecEnv is left out")
    else:
        apis |= {f"SwarmVecEnv, {name}": functools.partial(_make_vec_env_step, name) for name in ("uniform", "ring")}
    apis["parallel_env"] = speed.make_parallel_env_step
    in_jax = importlib.import_module("swarm_pz.jax.speed") if jax else None
    if in_jax is not None:
        apis[speed.JAX] = in_jax.make_jax_step
        print(f"games in JAX are on {in_jax.device()}")
    speeds = speed.measure(apis, games=games, drones=drones, threads=threads, grid=grid, repeats=repeats, log=say)
    config = GameConfig(observation=ObservationConfig(grid=grid))
    say("phases")
    figures = speed.to_dict(speeds, speed.phases(config), config)
    if in_jax is not None:
        figures["jax"] = in_jax.describe(config)
    tables.print_speeds(figures)
    if json is not None:
        write_json(figures, json, config)
    if plot is not None:
        with draft_of(plot) as draft:
            speed.plot(speeds, draft)
        print(f"plot: {plot}")


def _make_vec_env_step(opponent: str, config: GameConfig, games: int, threads: int) -> Callable[[], object]:
    """Return a step of Stable-Baselines3's environment against an opponent, as `swarm_pz.bench.MakeStep` does."""
    from swarm_pz.training.vec_env import SwarmVecEnv

    env = SwarmVecEnv(config, games, opponent=opponent, threads=threads, seed=0)
    env.action_space.seed(0)
    env.reset()
    actions = itertools.cycle([np.stack([env.action_space.sample() for _ in range(games)]) for _ in range(4)])
    return lambda: env.step(next(actions))


def warmup(
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Compile everything that a game needs.

    Args:
        game: The rules; what they use is compiled.
    """
    from swarm_pz.bench import make_batch_env_step

    began = time.monotonic()
    make_batch_env_step(game, 2, 1)()
    print(f"compiled kernels are ready after {time.monotonic() - began:.1f} s")
