"""Attacks on a policy in any format: exploiters and a search, each with a fixed budget."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.bundles import PolicyBundle, unpacked_policy
from swarm_pz.evaluation.workers import BackgroundTasks, never
from swarm_pz.files import draft_of
from swarm_pz.policy import folder_of, load
from swarm_pz.policy.identity import identity_of
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


class Learning:
    """One exploiter, which is trained once, in the background, and written into a folder."""

    def __init__(
        self, background: BackgroundTasks, protocol: Protocol, work: Path, out: Path, policy: str, seed: int
    ) -> None:
        from swarm_pz.policies.learned import CARD

        self._background, self._protocol, self._policy, self._seed = background, protocol, policy, seed
        self._folder = None if background.is_elsewhere else work / f"exploiter-{out.name}"
        self._out = out
        self._name = f"exploiter {out.name}"
        self._is_there = (self._out / CARD).is_file()

    def begin(self, should_stop: Callable[[], bool]) -> None:
        """Begin the training, unless it is finished."""
        if not self._is_there:
            target = _target(self._policy, self._protocol, is_elsewhere=self._background.is_elsewhere)
            callback = should_stop if self._background.is_here else never
            self._background.send(self._name, learn, target, self._seed, self._protocol, self._folder, callback)

    def end(self, should_stop: Callable[[], bool]) -> str:
        """Wait for the exploiter, and return its digest."""
        if not self._is_there:
            learned = self._background.fetch(self._name, should_stop)
            replace(learned, name=self._out.name).unpack(self._out.parent)
        return identity_of(str(self._out), load(str(self._out), self._protocol.game))


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
