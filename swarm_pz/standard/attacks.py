"""How hard it is tried to beat a policy: a learner and a search, each with a fixed budget."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swarm_pz.errors import require_extra
from swarm_pz.standard.games import SEARCHED, Cast, TrackGames, entry_name
from swarm_pz.standard.protocol import Protocol, Track
from swarm_pz.standard.siege import search

if TYPE_CHECKING:
    from swarm_pz.policies.learned import LearnedPolicy

THREADS = 1
"""Of every exploiter's training, on however many cores: with two, what is learned was not always the same twice."""
Show = Callable[[float, float], None]


def learn(
    policy: str,
    number: int,
    protocol: Protocol,
    folder: Path,
    out: Path,
    asked: Callable[[], bool],
    say: Callable[[str], None],
) -> LearnedPolicy:
    """Train an exploiter of a policy, or take that up, and write what it has learned to `out`.

    It starts from the policy's weights if that is a learned one of ours. What is written names neither paths nor
    times, so that it is the same twice.

    Raises
    ------
    Stopped
        If it was asked to stop; a checkpoint is in `folder`.
    """
    for module in ("torch", "stable_baselines3"):
        require_extra(module, "training")
    from swarm_pz.policies.learned import LearnedPolicy
    from swarm_pz.policy import load
    from swarm_pz.training.checkpoint import CHECKPOINT
    from swarm_pz.training.config import TrainConfig
    from swarm_pz.training.exploit import make_exploiter

    target, learner = load(policy, protocol.game), TrainConfig()
    if isinstance(target, LearnedPolicy):  # as its network wants it
        theirs = TrainConfig.from_dict(target.card["training"])
        learner = learner.replace(
            game=learner.game.replace(observation=theirs.game.observation),
            action_cells=theirs.action_cells,
            width=theirs.width,
        )
    steps = protocol.robust.steps
    run = make_exploiter(
        policy,
        folder,
        steps=steps,
        learner=learner.replace(evaluate_every=max(steps // 2, 1), num_envs=min(learner.num_envs, max(steps // 64, 2))),
        rules=protocol.game,
        seed=(protocol.robust.seed + number) % 2**32,
        threads=THREADS,
        resume=(folder / CHECKPOINT).is_file(),
        say=say,
    )
    learned = run.policy() if run.is_finished else run.run(asked)
    told = {name: learned.card["training"][name] for name in ("game", "total_steps", "seed")}
    card = learned.card | {"seconds": 0.0, "command": "", "training": told}
    card.pop("digest", None)
    kept = LearnedPolicy(card, learned.weights(), run.config.game, out.name)
    kept.write(out)
    return kept


def find(
    number: int,
    protocol: Protocol,
    cast: Cast,
    folder: Path,
    *,
    processes: int,
    show: Show,
    asked: Callable[[], bool],
) -> str:
    """Search for the tactic of the family that does best against a policy; return its name.

    Raises
    ------
    Stopped
        If it was asked to stop; the games that began are in `folder`.
    """
    robust = protocol.robust
    track = Track(name="search", seed=robust.seed + 1, games=robust.search_games, trials=())
    one = entry_name(number)
    rounds = 0

    def score(names: Sequence[str]) -> list[float]:
        nonlocal rounds
        games = TrackGames(track, protocol, cast, folder, attackers=[(number, name) for name in names])
        per_round = len(names) * track.games
        done = rounds * per_round
        games.play(processes, lambda now, _: show(done + now, robust.generations * per_round), asked)
        rounds += 1
        found = []
        for name in names:
            counts = games.tally(name, one).sum(axis=0)
            points = float(counts @ [1.0, 0.5, 0.0] / counts.sum())
            share = float(np.mean([1.0 - game.share for game in games.between(name, one)]))
            found.append((points + share) / 2)  # the share tells more where all games end alike
        return found

    return search(
        score,
        prefix=SEARCHED,
        generations=robust.generations,
        candidates=robust.candidates,
        seed=robust.seed + number,
    )
