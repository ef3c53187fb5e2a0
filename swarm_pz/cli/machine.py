"""Commands about one game and the simulator: ``render``, ``bench`` and ``warmup``."""

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
from swarm_pz.cli.report import in_seconds, print_rules, say
from swarm_pz.config import BLUE, RED, TEAM_NAMES, GameConfig
from swarm_pz.config.base import check

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

    With the same players, seed and rules, swarm-pz evaluate plays the same game.

    Args:
        policy: Name of a policy, a folder that training wrote, FILE.py:NAME (a tactic in a file), or exec:PROGRAM.
        opponent: The opponent, named in the same ways.
        out: File to write: .gif, .mp4 or .webp, or .png for a picture.
        seed: Seed of the match.
        pair: Number of the pair of games, which have the same start.
        side: Side that the policy plays in this game of the pair.
        seconds: Seconds of game to film at most; for a picture, its moment (by default, the end).
        speed: Seconds of game per second of film.
        overlay: What to show on the ground: a team's target, its coverage as its controller sees it,
            where it captures, or the potential that pushes its drones.
        overlay_team: Team whose overlays are shown.
        game: The rules.
    """
    from swarm_pz import policies
    from swarm_pz.film import film_game
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


def bench(
    games: tuple[int, ...] = (1, 64, 1024),
    drones: tuple[int, ...] = (20,),
    threads: tuple[int, ...] = (1, 2),
    jax: bool = False,
) -> None:
    """Measure the speed of the simulator and the environments on this machine.

    Args:
        games: Numbers of games that run at once.
        drones: Numbers of drones in a game, both teams together; must be even.
        threads: Numbers of threads.
        jax: Also measure games in JAX, on the device that JAX finds; on an accelerator, try --games up to 65536.
    """
    from swarm_pz import bench as speed

    for name, values in (("games", games), ("drones", drones), ("threads", threads)):
        check(bool(values) and min(values) >= 1, name, values, "at least 1")
    check(all(size % 2 == 0 for size in drones), "drones", drones, "even, for two teams alike")
    apis: dict[str, speed.MakeStep] = {"simulator": speed.make_simulator_step, "batch_env": speed.make_batch_env_step}
    if importlib.util.find_spec("stable_baselines3") is None:
        print("stable-baselines3 is not installed: SwarmVecEnv is left out")
    else:
        apis |= {f"SwarmVecEnv, {name}": functools.partial(_make_vec_env_step, name) for name in ("uniform", "ring")}
    apis["parallel_env"] = speed.make_parallel_env_step
    if jax:
        in_jax = importlib.import_module("swarm_pz.jax.speed")
        apis |= in_jax.make_steps()
        print(f"games in JAX are on {in_jax.device()}")
    tables.print_speeds(speed.measure(apis, games, drones, threads, say), speed.machine())


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
        game: The rules; the code that they use is compiled.
    """
    from swarm_pz.bench import make_batch_env_step

    began = time.monotonic()
    make_batch_env_step(game, 2, 1)()
    print(f"compiled kernels are ready after {time.monotonic() - began:.1f} s")
