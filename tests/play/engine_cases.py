"""Games of the simulator, tick by tick; `static/engine.test.js` compares the page's engine with them."""

import json
import os
import subprocess
from collections import defaultdict
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from swarm_pz.config import (
    CHANNELS,
    GRID_CELLS,
    MOTION_CHANNELS,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
    GameConfig,
    ObservationConfig,
)
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.kernels.capture import capture_fields
from swarm_pz.kernels.observation import CAPTURES_FROM
from swarm_pz.play.opponents import LEARNED, SCRIPTED
from swarm_pz.play.server.views import target_picture
from swarm_pz.play.strokes import BRUSHES, Stroke, density_of
from swarm_pz.policies import load
from swarm_pz.simulator.commands import make_target

STATIC = Path(__file__).parent / "static"
LIMIT = 120.0
LARGEST = 40
SEEN = (ObservationConfig(), ObservationConfig(grid=10, channels=CHANNELS + MOTION_CHANNELS))
PLAYERS = (*sorted((*SCRIPTED, "ring")), *LEARNED)
ASKED_EVERY = 5
"""Seconds between two answers of the players."""
ROW = np.zeros(1, np.int64)


def exact_fields(fields, grid):
    """Return capture fields (2, G, G) painted on a grid with integers, and where 255 value / maximum is a half.

    At a half, kernels round up or down, depending on how the processor multiplies.
    """
    blocks = fields.astype(np.int64).reshape(2, grid, GRID_CELLS // grid, grid, GRID_CELLS // grid)
    values, most = blocks.max(axis=(2, 4)), np.maximum(fields.max(axis=(1, 2)).astype(np.int64), 1)[:, None, None]
    painted = (510 * values + most) // (2 * most)
    captures = values > 3 * most // 4
    painted = np.where(captures, np.maximum(painted, CAPTURES_FROM), np.minimum(painted, CAPTURES_FROM - 1))
    return painted.astype(np.uint8), (510 * values + most) % (2 * most) == 0


def seen_of(env, observation, team):
    """Return a team's observation, with halves in fields rounded up, and how many cells kernels rounded down."""
    images, fields = env.observe(observation, team)[0], capture_fields(env.simulator.games.occupancy[0])
    exact, is_half = exact_fields(fields, observation.grid)
    down = 0
    for side, channel in enumerate(("own_capture_field", "opposing_capture_field")):
        if channel in observation.channels:
            image, of = images[observation.channels.index(channel)], team if side == 0 else 1 - team
            differs = image != exact[of]
            assert (is_half[of] | ~differs).all()
            image[:], down = exact[of], down + int(differs.sum())
    return images, down


def random_density(generator):
    """Return a command: noise, few cells, a disc, a ring or nothing."""
    x, y = np.meshgrid(*[(np.arange(10) + 0.5) / 10] * 2)
    away = np.hypot(x - generator.random(), y - generator.random())
    made = {
        "noise": generator.random((10, 10)),
        "few": generator.random((10, 10)) ** 20,
        "disc": np.exp(-((away / generator.uniform(0.02, 0.3)) ** 2)),
        "ring": np.exp(-(((away - generator.uniform(0.1, 0.4)) / 0.08) ** 2)),
        "nothing": np.zeros((10, 10)),
    }
    return made[generator.choice(list(made), p=[0.2, 0.2, 0.25, 0.3, 0.05])].astype(np.float32)


def game_case(seed, *, seconds, every):
    """Return a game as safetensors bytes: its state at every tick, and observations at every `every`-th tick."""
    generator = np.random.default_rng(seed)
    sizes = tuple(int(size) for size in generator.integers(1, LARGEST + 1, size=2))
    config = GameConfig(drones_per_team=sizes, time_limit=LIMIT)
    env = BatchEnv(config)
    simulator, games = env.simulator, env.simulator.games
    env.reset([seed])
    players = [load(name, config) for name in PLAYERS]
    for player in players:
        player.reset([seed], ROW)
    log = defaultdict(list)
    for tick in range(seconds * TICKS_PER_SECOND + 1):
        for name in ("positions", "velocities", "teams"):
            log[name].append(getattr(games, name)[0].copy())
        log["fields"].append(capture_fields(games.occupancy[0]).astype(np.int32))
        if tick % every == 0:
            images, halves = zip(*[seen_of(env, view, team) for team in (0, 1) for view in SEEN], strict=True)
            log["seen"].append(np.concatenate([image.ravel() for image in images]))
            log["halves"].append(np.float64(sum(halves)))
        if tick % (ASKED_EVERY * TICKS_PER_SECOND) == 0:
            pairs = [(player, team) for player in players for team in (0, 1)]
            shown = [seen_of(env, player.observation, team)[0][None] for player, team in pairs]
            log["answers"].append([player.act(image, ROW)[0] for (player, _), image in zip(pairs, shown, strict=True)])
        if simulator.decided[0] or tick == seconds * TICKS_PER_SECOND:
            break
        if tick % TICKS_PER_SECOND == 0:
            log["commands"].append(np.stack([random_density(generator) for _ in range(2)]))
            for team in (0, 1):
                simulator.command(team, log["commands"][-1][None, team])
        if tick % TICKS_PER_CONTROL_PERIOD == 0:
            log["memory"].append(games.memory[0, ..., : games.teams.shape[1]].transpose(2, 0, 1).copy())
            log["weights"].append(games.memory_weight[0].copy())
        simulator.advance(1)
        log["accelerations"].append(games.accelerations[0].copy())
    arrays = {name: np.array(values) for name, values in log.items()}
    arrays["teams"] = arrays["teams"].astype(np.uint8)
    arrays |= {"start": np.array([[*sizes, seed, games.ticks[0], every]], np.float64)}
    return save({name: np.ascontiguousarray(values) for name, values in arrays.items()})


def drawing_cases(count=12):
    """Yield drawings with their densities and the pictures of their targets."""
    generator = np.random.default_rng(0)
    drawings = [[]]
    for number in range(1, count):
        strokes = []
        for _ in range(generator.integers(1, 4)):
            steps = generator.normal(0, 0.1, (generator.integers(0, 20), 2))
            points = np.cumsum(np.vstack([generator.random(2), steps]), axis=0)
            width = float(generator.uniform(0.05, 0.3))
            strokes.append(
                {
                    "brush": str(generator.choice(BRUSHES[:2] if number % 2 else BRUSHES)),
                    "width": width,
                    "points": np.clip(points, -0.5, 1.5).tolist(),
                }
            )
        drawings.append(strokes)
    for strokes in drawings:
        drawn = [Stroke(**(stroke | {"points": tuple(map(tuple, stroke["points"]))})) for stroke in strokes]
        density = density_of(drawn, 10)
        picture = target_picture(make_target(density.astype(np.float32).astype(np.float64), 10)[1])
        yield {"strokes": strokes, "density": density.ravel().tolist(), "picture": picture.ravel().tolist()}


def write_cases(folder, seeds, **options):
    """Write the games of some seeds and all drawings, as the tests in JavaScript read them."""
    for seed in seeds:
        (folder / f"{seed}.game").write_bytes(game_case(seed, **options))
    views = [[observation.grid, observation.channels] for observation in SEEN]
    cases = {"seen": views, "players": PLAYERS, "drawings": list(drawing_cases())}
    (folder / "cases.json").write_text(json.dumps(cases))


def compare_in_node(node, folder):
    """Run `engine.test.js` on the written cases, and return the completed process."""
    return subprocess.run(  # noqa: S603
        [node, "--test-reporter=tap", str(STATIC / "engine.test.js")],
        env=os.environ | {"SWARM_PZ_FIXTURES": str(folder)},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
