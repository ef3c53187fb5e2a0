"""Distillation: one network learns from several teachers, each against the opponents that it beats.

A league forgets what it does not meet, and a tactic that one opponent asks for loses to another. Teachers that were
trained apart keep both; the network learns which of them a game asks for.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import ConfigError
from swarm_pz.evaluation.workers import never, silent
from swarm_pz.policies.learned import LearnedPolicy, lineage
from swarm_pz.policies.pattern import KINDS
from swarm_pz.policy import load
from swarm_pz.training.checkpoint import random_streams_kept
from swarm_pz.training.config import DistilConfig, TrainConfig
from swarm_pz.training.imitation import learn, lessons_of
from swarm_pz.training.networks import as_policy
from swarm_pz.training.oracle import Population
from swarm_pz.training.ppo import Training


def distil(
    config: DistilConfig,
    folder: Path,
    *,
    say: Callable[[str], None] = silent,
    command: str = "",
    should_stop: Callable[[], bool] = never,
) -> LearnedPolicy:
    """Train a network by a distillation, write it into a folder and return it; a stop ends it with what it has learned.

    Raises a ConfigError if the folder holds a policy.
    """
    if (folder / "policy.json").exists():
        raise ConfigError(f"{folder} holds a policy: choose another folder (--out), or remove it")
    game, began = config.game, time.monotonic()
    own = TrainConfig(
        game=game,
        action_cells=config.action_cells,
        width=config.width,
        start_from=config.start_from,
        num_envs=2,
        seed=config.seed,
        threads=config.threads,
    )
    with random_streams_kept(), tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
        run = Training(own, Path(place, "run"), say=silent)
        network: Any = run.model.policy
        patterns = laps_and_spots(config.drawn, config.seed)
        if config.population is not None:
            patterns = np.concatenate([Population.read(Path(config.population)).numbers, patterns])
        lessons = lessons_of(config.teachers, config.opponents, patterns, game, config.seed, say=say)
        steps = learn(
            network.actor,
            lambda: as_policy(network, own, folder.name),
            lessons,
            game,
            config.seed,
            rounds=config.rounds,
            say=say,
            should_stop=should_stop,
        )
        told: dict[str, Any] = {"steps": steps, "seconds": time.monotonic() - began, "command": command}
        policy = as_policy(network, own, folder.name, **told, ancestors=_ancestors(config))
        run.env.close()
    training = {name: value for name, value in policy.card["training"].items() if name != "opponents"}
    card = policy.card | {"training": training, "distillation": config.to_dict()}
    policy = LearnedPolicy(card, policy.weights(), game, folder.name)
    policy.write(folder)
    return policy


def laps_and_spots(count: int, seed: int) -> NDArray[np.float64]:
    """Return patterns (n, 13): in turn a spot anywhere, and one that runs around the middle; of any width."""
    generator = np.random.default_rng(seed)
    found = []
    for number in range(count):
        kind = KINDS["spot"] | {"width": 0.02 * 15.0 ** generator.uniform()}
        if number % 2:
            radius = generator.uniform(0.05, 0.35)
            kind |= {"x": 0.5, "y": 0.5, "along": radius, "across": radius * generator.choice([-1.0, 1.0])}
            kind |= {"period": generator.uniform(3.0, 12.0), "start": generator.uniform()}
            kind |= {"look": float(generator.integers(2))}
        else:
            kind |= {"x": generator.uniform(0.05, 0.95), "y": generator.uniform(0.05, 0.95)}
        found.append(list(kind.values()))
    return np.array(found).reshape(count, len(KINDS["spot"]))


def _ancestors(config: DistilConfig) -> list[dict[str, Any]]:
    """Return the trainings that the teachers and the first weights come from, each once."""
    found: list[dict[str, Any]] = []
    for name in (*config.teachers, *([] if config.start_from is None else [config.start_from])):
        teacher = load(name, config.game)
        if isinstance(teacher, LearnedPolicy):
            parent, *older = lineage(teacher.card)
            found += [one for one in (parent | {"name": teacher.name}, *older) if one not in found]
    return found
