"""Attacks on a policy: exploiters and a search, each with a fixed budget."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.bundles import PolicyBundle, unpacked_policy
from swarm_pz.evaluation.workers import BackgroundTasks, never, silent
from swarm_pz.policy import folder_of, load
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard.games import SEARCHED, PlayerFactory, TrackGames, entry_name
from swarm_pz.standard.protocol import Protocol, Track
from swarm_pz.standard.siege import search

Show = Callable[..., None]


def learn(
    policy: str,
    seed: int,
    protocol: Protocol,
    folder: Path | None,
    should_stop: Callable[[], bool],
    say: Callable[[str], None],
    digest: str | None = None,
    bundle: PolicyBundle | None = None,
) -> PolicyBundle:
    """Train an exploiter of a policy, or resume it, and return its folder: a task of a pool.

    The card holds neither paths nor times, so it is the same wherever it was trained. Without a folder nothing is kept
    for a resume. `digest` and `bundle` are for `unpacked_policy`.
    """
    for module in ("torch", "stable_baselines3"):
        require_extra(module, "train")
    from swarm_pz.policies.learned import ANCESTORS, LearnedPolicy
    from swarm_pz.training.exploit import exploiter_config, fixed_learner
    from swarm_pz.training.ppo import Training

    steps = protocol.robust.steps
    with (
        tempfile.TemporaryDirectory(prefix="swarm-pz-") as place,
        unpacked_policy(policy, protocol.game, digest, bundle) as name,
    ):
        run_folder = folder or Path(place, "run")
        learner = fixed_learner(name, protocol.game, steps)
        run = Training(exploiter_config(name, learner, steps=steps, seed=seed), run_folder, say=say)
        learned = run.policy() if run.is_finished else run.run(should_stop)
        told = {name: learned.card["training"][name] for name in ("game", "total_steps", "seed")}
        card = learned.card | {"seconds": 0.0, "command": "", "training": told}
        for name in ("digest", ANCESTORS):
            card.pop(name, None)
        out = Path(place, "exploiter")
        LearnedPolicy(card, learned.weights(), GameConfig.from_dict(told["game"]), out.name).write(out)
        return PolicyBundle.of(out)


class Learning:
    """One exploiter, which learns in the background, once, and is written into a folder."""

    def __init__(
        self, background: BackgroundTasks, protocol: Protocol, work: Path, out: Path, policy: str, seed: int
    ) -> None:
        from swarm_pz.policies.learned import CARD

        self._background, self._protocol, self._policy, self._seed = background, protocol, policy, seed
        self._folder = None if background.is_elsewhere else work / f"exploiter-{out.name}"
        self._out = out
        self._name = f"exploiter {out.name}"
        self._is_there = (self._out / CARD).is_file()

    def begin(self, should_stop: Callable[[], bool], say: Callable[[str], None]) -> None:
        """Begin to learn, unless that is done."""
        if self._is_there:
            return
        digest = getattr(load(self._policy, self._protocol.game), "digest", None)
        folder = folder_of(self._policy) if self._background.is_elsewhere else None
        bundle = None if folder is None else PolicyBundle.of(folder)
        told = (should_stop, say) if self._background.is_here else (never, silent)
        given = (self._policy, self._seed, self._protocol, self._folder, *told, digest, bundle)
        self._background.send(self._name, learn, *given)

    def end(self, should_stop: Callable[[], bool]) -> str:
        """Wait for the exploiter, and return its digest."""
        if not self._is_there:
            learned = self._background.fetch(self._name, should_stop)
            replace(learned, name=self._out.name).unpack(self._out.parent)
        return identity_of(str(self._out), load(str(self._out), self._protocol.game))


def find(
    number: int,
    protocol: Protocol,
    factory: PlayerFactory,
    folder: Path,
    *,
    pool: Executor,
    show: Show,
    should_stop: Callable[[], bool],
) -> str:
    """Return the name of the tactic of the family against which a policy wins least."""
    robust = protocol.robust
    track = Track(name="search", seed=robust.seed + 1, games=robust.search_games, trials=())
    one = entry_name(number)
    rounds = 0

    def score(names: Sequence[str]) -> list[float]:
        nonlocal rounds
        games = TrackGames(track, protocol, factory, folder, attackers=[(number, name) for name in names])
        per_round = len(names) * track.games
        done = rounds * per_round
        games.play(
            progress=lambda now, _: show(done + now, robust.generations * per_round), should_stop=should_stop, pool=pool
        )
        rounds += 1
        found = []
        for name in names:
            played = games.between(name, one)
            # The shares differ even where all games end alike.
            found.append(float(np.mean([(game.outcome != "win") + 1.0 - game.share for game in played])) / 2)
        return found

    return search(
        score,
        prefix=SEARCHED,
        generations=robust.generations,
        candidates=robust.candidates,
        seed=robust.seed + number,
    )
