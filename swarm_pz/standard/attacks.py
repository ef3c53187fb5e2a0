"""Attacks on a policy in any format: exploiters and a search, each with a fixed budget, and newcomers to the board."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.bundles import PolicyBundle, unpacked_policy
from swarm_pz.evaluation.workers import BackgroundTasks, never
from swarm_pz.files import draft_of
from swarm_pz.policy import folder_of, load
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard.figures import result_of, worst_of
from swarm_pz.standard.games import ROBUST, PlayerFactory, TrackGames, choice_of
from swarm_pz.standard.protocol import Protocol
from swarm_pz.training.search import Target

Array = NDArray[np.float64]
Show = Callable[..., None]


def learn(
    target: Target, seed: int, protocol: Protocol, folder: Path | None, should_stop: Callable[[], bool]
) -> PolicyBundle:
    """Train an exploiter of a policy, or resume its training, and return its folder: a task for a pool.

    The card holds neither paths nor times, so it is the same on every machine. Without a folder, training cannot be
    resumed.
    """
    for module in ("torch", "stable_baselines3"):
        require_extra(module, "train")
    from swarm_pz.policies.learned import ANCESTORS, CARD, LearnedPolicy
    from swarm_pz.training.exploit import IMITATION, NOTHING, exploit, fixed_learner, imitate

    robust = protocol.robust
    with (
        tempfile.TemporaryDirectory(prefix="swarm-pz-") as place,
        unpacked_policy(target.policy, protocol.game, target.digest, target.bundle) as name,
    ):
        runs = folder or Path(place, "runs")
        learner = fixed_learner(robust.best, protocol.game, robust.steps)
        copied = runs / "copied"
        if not (copied / CARD).is_file():
            imitate(name, learner, copied, games=robust.recorded_games, seed=seed)
        starts = {IMITATION: str(copied), NOTHING: None, robust.best: robust.best}
        learned = exploit(name, runs, learner, starts, steps=robust.steps, seed=seed, should_stop=should_stop)
        training = {name: learned.card["training"][name] for name in ("game", "total_steps", "seed")}
        start = next(start for start, policy in starts.items() if policy == learned.card["training"]["start_from"])
        card = learned.card | {"seconds": 0.0, "command": "", "training": training, "about": f"began from {start}"}
        for name in ("digest", ANCESTORS):
            card.pop(name, None)
        out = Path(place, "exploiter")
        LearnedPolicy(card, learned.weights(), GameConfig.from_dict(training["game"]), out.name).write(out)
        return PolicyBundle.of(out)


def begin_learning(
    background: BackgroundTasks,
    protocol: Protocol,
    work: Path,
    out: Path,
    policy: str,
    seed: int,
    should_stop: Callable[[], bool],
) -> Callable[[], str]:
    """Begin to train an exploiter of a policy in the background, unless the folder `out` has it.

    Return a function that waits for it, writes it into `out`, and returns its digest.
    """
    from swarm_pz.policies.learned import CARD

    name, is_there = f"exploiter {out.name}", (out / CARD).is_file()
    if not is_there:
        target = _target(policy, protocol, is_elsewhere=background.is_elsewhere)
        folder = None if background.is_elsewhere else work / f"exploiter-{out.name}"
        callback = should_stop if background.is_here else never
        background.send(name, learn, target, seed, protocol, folder, callback)

    def end() -> str:
        if not is_there:
            replace(background.fetch(name, should_stop), name=out.name).unpack(out.parent)
        return identity_of(str(out), load(str(out), protocol.game))

    return end


def _target(policy: str, protocol: Protocol, *, is_elsewhere: bool) -> Target:
    """Return a policy with its digest, if it has one, and its files, if other machines may need them."""
    folder = folder_of(policy) if is_elsewhere else None
    digest = getattr(load(policy, protocol.game), "digest", None)
    return Target(policy, protocol.game, digest, None if folder is None else PolicyBundle.of(folder))


def find(
    policy: str,
    number: int,
    protocol: Protocol,
    work: Path,
    *,
    pool: Executor,
    show: Show,
    should_stop: Callable[[], bool],
) -> list[str]:
    """Search for patterns that beat a policy, and return the names of the best, the best first.

    A finished search is kept in a file in the folder `work`; a stopped one begins again.
    """
    from swarm_pz.training.search import search_against

    path, robust = work / f"search-{number}.json", protocol.robust
    if path.exists():
        patterns: list[str] = json.loads(path.read_text())
        return patterns
    patterns = search_against(
        _target(policy, protocol, is_elsewhere=bool(getattr(pool, "elsewhere", False))),
        games=robust.search_games,
        generations=robust.generations,
        candidates=robust.candidates,
        seed=robust.seed + 2 + number,
        pool=pool,
        show=show,
        should_stop=should_stop,
    )
    with draft_of(path) as draft:
        draft.write_text(json.dumps(patterns) + "\n")
    return patterns


def meet(
    report: dict[str, Any],
    policies: Sequence[str],
    newcomers: Mapping[str, str],
    out: Path,
    *,
    protocol: Protocol,
    pool: Executor,
) -> bool:
    """Let newcomers attack policies that have a report; return False if the report must be made again.

    Newcomers play the games that choose the worst attacker. If one is worse for a policy than its worst attacker, or
    has the same name, the report must be made again. Otherwise their results are put into it.
    """
    choice, names = choice_of(protocol), tuple(newcomers)
    meetings = [(policy, name) for policy in range(len(policies)) for name in names]
    factory = PlayerFactory(tuple(policies), others=tuple(newcomers.items()))
    games = TrackGames(choice, protocol, factory, out, meetings=meetings)
    games.play(pool=pool)
    lines = games.lines()
    by = {pair: [line for line in lines if (line.policy, line.opponent) == pair] for pair in meetings}
    results = [result_of(name, [by[policy, name] for policy in range(len(policies))]) for name in names]
    robust = report["figures"]["tracks"][ROBUST]
    before = {one["opponent"]: one["scores"] for one in robust["opponents"]}
    for policy, attacked in enumerate(report["figures"]["attacks"]):
        worst = attacked["worst"]["opponent"]
        if worst in names or min(one["scores"][policy] for one in results) < before[worst][policy]:
            return False
    robust["opponents"] = [one for one in robust["opponents"] if one["opponent"] not in names] + results
    robust["worst"] = worst_of(robust["opponents"])
    report["games"] += choice.games * len(policies) * len(set(names) - set(before))
    return True
