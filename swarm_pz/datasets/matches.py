"""Games of a player against others as a dataset: games of the Gymnasium environment, one a seed."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Literal, Unpack

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES, GameConfig
from swarm_pz.config.base import check, check_count
from swarm_pz.datasets.folder import Episode, Target, name_for, new_dataset
from swarm_pz.envs.opponents import DuelBatch, DuelResult
from swarm_pz.evaluation.rollout import policy_errors
from swarm_pz.policy import Player, PrivilegedPolicy, load, name_of
from swarm_pz.spaces.formats import FormatOptions
from swarm_pz.spaces.observation import Observations

OUTCOMES = {1: "win", 0: "draw", -1: "loss"}
_BATCH = 16
"""Games played side by side, about; their observations are in memory until all of them have ended."""
_PLAYERS_STREAM = 1_000_003
"""Sets the seeds of a player apart from those of the game, of its side and of its opponent."""


def record_match(
    player: str | Player,
    opponents: Sequence[str],
    *,
    name: str | None = None,
    root: Path | None = None,
    games: int = 40,
    seed: int = 0,
    side: Literal["random", "red", "blue"] = "random",
    config: GameConfig | None = None,
    threads: int = 1,
    command: str = "",
    progress: Callable[[float, float], None] | None = None,
    **options: Unpack[FormatOptions],
) -> Path:
    """Play games and write them as a Minari dataset of what the player saw and did; return its folder.

    The player's commands are played as the dataset writes them, as actions of `options`: so ``env.reset(seed)`` of an
    episode's seed and its actions give its observations, rewards, ends and infos again, bit for bit on one kind of
    processor.

    Parameters
    ----------
    player : str or Policy
    opponents : sequence of str
        Names of policies, or folders that training wrote; games are dealt to them in turn.
    name : str, optional
        The dataset's id; ``swarm-PLAYER-v0`` if not given.
    root : Path, optional
        Folder of datasets; Minari's own if not given.
    games : int
    seed : int
        Of the first game; the next one has the next.
    side : {"random", "red", "blue"}
        Where the player sits; drawn anew for every game if random.
    config : GameConfig, optional
        The rules, and what the player's observations show.
    threads : int
    command : str
        What was called; it stands in the metadata.
    progress : callable, optional
        Called with (games finished, games in all).
    **options
        How observations and actions are written: those of `swarm_pz.spaces.formats.Format`.

    Raises
    ------
    ConfigError, OutputError, PolicyError
        If the name, an option, the folder or a policy is not one that can be had; nothing is written.
    """
    config = config if config is not None else GameConfig()
    games = check_count(games, "games", 1, 10**7)
    seed = check_count(seed, "seed", 0, 2**63 - games)
    check(len(opponents) > 0, "opponents", tuple(opponents), "at least one policy's name")
    called = name_of(player)
    target = Target(name=name if name is not None else name_for(called), root=root)
    learner = load(player, config, config.team_systems[0])
    size = max(1, _BATCH // len(opponents)) * len(opponents)
    duel = _seats(config, opponents, min(size, games), side, threads, options)
    told = {
        "algorithm_name": called,
        "description": f"{called} against {', '.join(opponents)}, as it saw the games: observations, actions, rewards",
        "source": "match",
        "player": called,
        "player_digest": str(getattr(learner, "digest", "")),
        "privileged": isinstance(learner, PrivilegedPolicy),
        "opponents": list(opponents),
        "seeds": [seed, seed + games - 1],
        "side": side,
    }
    keywords = {"opponent": opponents[0], "side": side}
    done = 0
    with new_dataset(target, duel.format, config, keywords, options, told, command) as writer:
        while done < games:
            count = min(size, games - done)
            if count != duel.batch.num_games:
                duel.batch.close()
                duel = _seats(config, opponents, count, side, threads, options)
            with closing(_play(duel, learner, called, range(seed + done, seed + done + count))) as ends:
                for ended in ends:
                    if isinstance(ended, list):
                        writer.add(ended)
                    elif progress is not None:
                        progress(done + ended, games)
            done += count
    duel.batch.close()
    return target.folder


def _seats(
    config: GameConfig, opponents: Sequence[str], count: int, side: Any, threads: int, options: FormatOptions
) -> DuelBatch:
    return DuelBatch(config, count, opponent=list(opponents), side=side, threads=threads, **options)


def _play(duel: DuelBatch, player: Player, called: str, seeds: range) -> Generator[int | list[Episode]]:
    """Play games to their ends; give after each step how many have ended, and last the episodes."""
    batch, rows, control = duel.batch, np.arange(len(seeds)), duel.batch.simulator.control
    duel.reset([np.random.SeedSequence(seed) for seed in seeds], rows)
    with policy_errors(0, called):
        player.reset([np.random.SeedSequence(seed, spawn_key=(_PLAYERS_STREAM,)) for seed in seeds], rows)
    idle = _idle(duel.format.action_space, len(seeds))
    observations, infos = [duel.observe()], [duel.infos()]
    actions: list[NDArray[Any]] = []
    results: list[DuelResult] = []
    lengths = np.zeros(len(seeds), np.int64)
    while batch.running.any():
        running = np.flatnonzero(batch.running)
        with policy_errors(0, called):
            packed = batch.ask(player, duel.sides[running], running)
        chosen = idle.copy()
        chosen[running] = duel.format.write(control.unpack(packed, control.numbers[0]))
        results.append(duel.step(chosen))
        actions.append(chosen)
        observations.append(duel.observe())
        infos.append(duel.infos(results[-1]))
        lengths[running] += 1
        yield int((~batch.running).sum())
    yield [
        Episode(
            observations=_column(observations[: steps + 1], row),
            actions=np.stack([one[row] for one in actions[:steps]]),
            rewards=np.array([one.rewards[row] for one in results[:steps]]),
            terminations=np.array([one.terminated[row] for one in results[:steps]]),
            truncations=np.array([one.truncated[row] for one in results[:steps]]),
            infos={key: np.array([one[key][row] for one in infos[: steps + 1]]) for key in infos[0]},
            seed=seeds[row],
            about={
                "side": TEAM_NAMES[duel.sides[row]],
                "opponent": duel.opponent_names[infos[0]["opponent"][row]],
                "outcome": OUTCOMES[int(infos[steps]["outcome"][row])],
            },
        )
        for row, steps in enumerate(lengths.tolist())
    ]


def _idle(space: spaces.Space[Any], count: int) -> NDArray[Any]:
    """Return an action of the space for each game, for those that have ended."""
    if isinstance(space, spaces.Box):
        return np.repeat(np.clip(np.zeros(space.shape, space.dtype), space.low, space.high)[None], count, axis=0)
    return np.zeros(count, np.int64)


def _column(observations: Sequence[Observations], row: int) -> Observations:
    """Return one game's observations, along a first axis."""
    if isinstance(observations[0], dict):
        return {key: np.stack([one[key][row] for one in observations]) for key in observations[0]}
    return np.stack([one[row] for one in observations])
