"""Searches for the best constant, sequence of images and lap for each track, and plays them by the protocol.

python -m benchmarks.board.open_loop [--tracks uniform field generated systems] [--processes 2]

These players see only the clock. CMA-ES searches log-densities at 5 by 5 places, with the square's symmetry (6 numbers
per image) and without (25). Images are interpolated between these places. A sequence has three images, each with its
duration. A lap is a spot that circles the middle or a place beside it, with an image for each second; it is the best of
a grid. Candidates play every opponent of the track from both sides, on seeds of the search. Each search's result and
its best candidate play again on other seeds, together with the players in policies/open_loop.json. The best play the
games of the protocol, and are written into that file, track by track. With --again, nothing is searched: the players in
the file play these games.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import closing
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import ObservationConfig
from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.evaluation.workers import open_pool
from swarm_pz.files import draft_of
from swarm_pz.policies.open_loop import FILE, Images, images_of, shown
from swarm_pz.policies.scripted import CLOCK, View
from swarm_pz.spaces.densities import cell_centres, corner_discs, disc, ring
from swarm_pz.standard.games import config_of, with_trial
from swarm_pz.standard.protocol import Protocol, Track

Array = NDArray[np.float64]
SIDE, CELLS, IMAGES = 5, 10, 3
LOWEST, LONGEST = -7.0, 60
"""The least log-density, and the most commands for which an image is shown."""
BUDGET = {"uniform": (10, 5, 12, 40), "field": (1, 4, 8, 4), "generated": (2, 4, 10, 8), "systems": (1, 1, 6, 1)}
"""Pairs of games against each opponent, generations and candidates of each search, and pairs that choose the best.
A track takes about ten minutes of one core. Games of `systems` are slow, so it has the fewest."""
SEED = 7_220_000


def _symmetric() -> NDArray[np.int64]:
    """Return the symmetry class, 0 to 5, of each of the square's 25 places."""
    near = np.minimum(np.arange(SIDE), np.arange(SIDE)[::-1])
    pairs = np.sort(np.stack(np.broadcast_arrays(near[:, None], near), axis=-1), axis=-1).reshape(-1, 2)
    return np.unique(pairs, axis=0, return_inverse=True)[1].ravel()


_CENTRES = (np.arange(CELLS) + 0.5) / CELLS
BETWEEN = np.maximum(1.0 - np.abs(_CENTRES[:, None] - np.linspace(0.0, 1.0, SIDE)) * (SIDE - 1), 0.0)
"""Weights (cells, places) by which an image is interpolated along one axis."""
PLACES = {True: _symmetric(), False: np.arange(SIDE * SIDE)}
"""Index of the number at each place, with the symmetry and without."""


def decoded(numbers: Array, count: int, symmetric: bool) -> Images:
    """Return the images that numbers encode: for each image its log-densities, then the log of its length."""
    images = []
    for part in numbers.reshape(count, -1):
        logs = BETWEEN @ part[:-1][PLACES[symmetric]].reshape(SIDE, SIDE) @ BETWEEN.T
        densities = np.exp(np.maximum(logs - logs.max(), LOWEST)).round(3)
        length = int(np.clip(np.exp(min(part[-1], 9.0)), 1, LONGEST).round()) if count > 1 else 1
        images.append((length, densities.tolist()))
    return images_of(images)


def encoded(images: Images, symmetric: bool) -> Array:
    """Return the numbers that encode images most closely."""
    back, parts = np.linalg.pinv(BETWEEN), []
    for length, image in images:
        logs = np.log(np.maximum(np.array(image), np.exp(LOWEST)))
        numbers = np.bincount(PLACES[symmetric], (back @ logs @ back.T).ravel()) / np.bincount(PLACES[symmetric])
        parts.append([*numbers, np.log(length)])
    return np.array(parts).ravel()


class Several:
    """Several players, each with its own images, in equal shares of the rows."""

    name, answers, observation = "several", "density", ObservationConfig(channels=CLOCK)

    def __init__(self, players: Sequence[Images], each: int) -> None:
        self._players, self._each = players, each
        self._steps = np.zeros(len(players) * each, np.int64)

    def reset(self, seeds: Sequence[Any], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._steps[rows] = 0

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer with the images of each row's player."""
        answers = np.empty((len(rows), CELLS, CELLS))
        for player in np.unique(rows // self._each):
            own = rows // self._each == player
            view = View(observations[own], CLOCK, CELLS, self._steps[rows[own]], [], np.zeros((int(own.sum()), 1)))
            answers[own] = shown(self._players[player], view)
        self._steps[rows] += 1
        return answers


def play(players: Sequence[Images], track: Track, place: int, numbers: Sequence[int], seed: int) -> Array:
    """Return the share of drones that each player has at the end of each game of a match: (players, games)."""
    trial = track.trials[place]
    config = with_trial(config_of(track, Protocol.read()), trial).game
    several = Several(players, len(numbers))
    with closing(Rollout(several, trial.load(config), [*numbers] * len(players), seed=seed, config=config)) as games:
        games.play()
        shares = [game.share for game in games.games()]
    return np.array(shares).reshape(len(players), len(numbers))


def against_all(players: Sequence[Images], track: Track, games: int, seed: int, pool: Executor) -> Array:
    """Return the shares of `play` against all opponents of a track: (opponents, players, games)."""
    places = range(len(track.trials))
    tasks = [pool.submit(play, players, track, place, range(games), seed) for place in places]
    return np.stack([task.result() for task in tasks])


def laps() -> list[Images]:
    """Return laps of several lengths, radii and widths, round the middle and beside it."""
    x, y = cell_centres(CELLS)
    around = [(0.5, *numbers) for numbers in product((6, 7, 8), (0.2, 0.25, 0.3), (0.035, 0.06))]
    beside = [(0.3, *numbers) for numbers in product((5, 6, 7), (0.08, 0.1, 0.14), (0.05, 0.07))]
    players = []
    for centre, length, radius, width in [*around, *beside]:
        turns = 2.0 * np.pi * np.arange(length) / length
        places = zip(centre + radius * np.cos(turns), centre + radius * np.sin(turns), strict=True)
        players.append(images_of([(1, np.maximum(disc(np.hypot(x - a, y - b), width), 1e-4)) for a, b in places]))
    return players


def search(track: Track, pool: Executor) -> dict[str, Images]:
    """Return the best constant, the best sequence and the best lap for a track."""
    import cma  # with pyplot, it takes seconds

    pairs, generations, candidates, more = BUDGET[track.name]
    x, y = cell_centres(CELLS)
    drawn = (np.ones_like(x), ring(np.hypot(x - 0.5, y - 0.5), width=0.15), corner_discs(x, y))
    uniform, halo, corners = (images_of([(8, np.maximum(image, 1e-3))])[0] for image in drawn)
    corner = images_of([(1, np.maximum(disc(np.hypot(x - 0.05, y - 0.05), 0.1), 1e-3))])
    seed, best = SEED + 1000 * track.seed, {}

    def climb(begin: Images, symmetric: bool, step: float) -> list[Images]:
        """Return the first images, the result of a search from them, and its best candidate."""
        nonlocal seed
        first = encoded(begin, symmetric)
        strategy = cma.CMAEvolutionStrategy(first, step, {"popsize": candidates, "seed": 1, "verbose": -9})
        met: list[tuple[float, Images]] = []
        for _ in range(generations):
            seed += 1
            proposals = strategy.ask()
            players = [decoded(np.asarray(point), len(begin), symmetric) for point in proposals]
            values = against_all(players, track, 2 * pairs, seed, pool).mean(axis=(0, 2))
            strategy.tell(proposals, [-float(value) for value in values])
            met += zip(values.tolist(), players, strict=True)
        end = decoded(np.asarray(strategy.result.xfavorite), len(begin), symmetric)
        print(
            f"{track.name}: {len(begin)} images, {'' if symmetric else 'not '}symmetric, {max(met)[0]:.3f}", flush=True
        )
        return [begin, end, max(met)[1]]

    def chosen(players: list[Images]) -> Images:
        """Return the best player on games that no search used; the best four play four times as many."""
        nonlocal seed
        for games in (2 * more, 8 * more):
            seed += 1
            values = against_all(players, track, games, seed, pool).mean(axis=(0, 2))
            print(f"{track.name}: again {values.round(3).tolist()}", flush=True)
            players = [players[place] for place in np.argsort(-values, kind="stable")[:4]]
        return players[0]

    def known(kind: str) -> list[Images]:
        """Return the file's results of a kind, for all tracks."""
        return [images_of(kinds[kind]["images"]) for kinds in json.loads(FILE.read_text()).values()]

    constants = [one for begin in (uniform, halo, corners) for one in climb((begin,), True, 1.5)]
    best["constant"] = chosen([*constants, *known("constant")])
    best["constant"] = chosen([best["constant"], *climb(best["constant"], False, 0.7), *climb(corner, False, 1.5)])
    best["sequence"] = chosen(
        [
            *climb(((8, best["constant"][0][1]),) * IMAGES, True, 1.0),
            *climb((halo, uniform, corners), True, 1.0),
            *known("sequence"),
        ]
    )
    best["sequence"] = chosen([best["sequence"], *climb(best["sequence"], False, 0.5)])
    best["lap"] = chosen(laps())
    return best


def measure(best: dict[str, Images], track: Track, pool: Executor) -> dict[str, Any]:
    """Return the scores of the players in the games of the protocol, as the file has them."""
    shares = against_all(list(best.values()), track, track.games, track.seed, pool)
    results = {}
    for place, (kind, images) in enumerate(best.items()):
        pairs = shares[:, place].reshape(len(track.trials), -1, 2).mean(axis=2)
        _, low, high = bootstrap(pairs.mean(axis=0))
        results[kind] = {
            "score": round(float(pairs.mean()), 4),
            "score_ci95": [round(float(low), 4), round(float(high), 4)],
            "images": images,
        }
    return results


def write(results: dict[str, Any]) -> None:
    """Write the file, with one line for each player."""
    tracks = []
    for track, kinds in results.items():
        lines = [f'  "{kind}": {json.dumps(one)}' for kind, one in kinds.items()]
        tracks.append(f' "{track}": {{\n' + ",\n".join(lines) + "\n }")
    with draft_of(FILE) as draft:
        draft.write_text("{\n" + ",\n".join(tracks) + "\n}\n")


def main() -> None:
    """Search and play, track by track."""
    tracks = {track.name: track for track in Protocol.read().tracks}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", nargs="+", choices=tracks, default=list(tracks))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--again", action="store_true", help="play what was found, and search nothing")
    options = parser.parse_args()
    with open_pool(options.processes) as pool:
        for name in options.tracks:
            before = json.loads(FILE.read_text())
            if options.again:
                best = {kind: images_of(one["images"]) for kind, one in before[name].items()}
            else:
                best = search(tracks[name], pool)
            results = measure(best, tracks[name], pool)
            now = json.loads(FILE.read_text()) | {name: results}
            write({track: now[track] for track in tracks if track in now})
            print(name, {kind: (one["score"], one["score_ci95"]) for kind, one in results.items()}, flush=True)


if __name__ == "__main__":
    main()
