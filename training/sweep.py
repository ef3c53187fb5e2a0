"""A sweep: the same training run with several seeds, shared among workers, as the benchmark asks of a method."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path

from swarm_pz.config.base import check
from swarm_pz.errors import CheckpointError, ConfigError
from swarm_pz.evaluation.bundles import PolicyBundle
from swarm_pz.evaluation.workers import BackgroundTasks, never, silent
from swarm_pz.policies.learned import CARD, LearnedPolicy
from swarm_pz.policy import folder_of
from swarm_pz.training.checkpoint import CHECKPOINT, read
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.ppo import Training

Say = Callable[[str], None]


def sweep(
    config: TrainConfig,
    seeds: Sequence[int],
    folder: Path,
    pool: Executor,
    *,
    should_stop: Callable[[], bool] = never,
    say: Say = print,
    show: Callable[[float, float], None] = lambda *_: None,
    command: str = "",
) -> list[LearnedPolicy]:
    """Train a policy with each seed, and return them in that order; resume stopped runs and skip finished ones.

    The run of seed 3 is in ``seed-3``. The policies do not depend on the `pool`, which `open_pool` opens. `show` gets
    the steps of all runs so far (from their checkpoints) and the total.

    Raises a CheckpointError if a folder holds a run of another configuration; a ConfigError if seeds repeat or are
    missing, or if other machines train and a player is a folder, which they lack; a WorkerError if a worker died; and
    Stopped if `should_stop` returns True: checkpoints are kept.
    """
    check(0 < len(seeds) == len(set(seeds)), "seeds", tuple(seeds), "different ones, at least one")
    runs = {folder / f"seed-{seed}": config.replace(seed=seed) for seed in seeds}
    with BackgroundTasks(pool) as tasks:
        if tasks.is_elsewhere:
            _check_players(config)
        left = [place for place, one in runs.items() if not _is_trained(place, one)]
        total = config.total_steps * len(runs)

        def look() -> bool:
            show(min(sum(map(_steps_of, runs)), total), total)
            return should_stop()

        for place in left:
            more = (should_stop, say) if tasks.is_here else (never, silent)
            tasks.send(str(place), train_one, runs[place], None if tasks.is_elsewhere else place, command, *more)
        for place in left:
            bundle = tasks.fetch(str(place), look)
            look()
            if bundle is not None:
                bundle.unpack(folder)
            say(f"{place}: trained")
    return [LearnedPolicy.read(place, one.game) for place, one in runs.items()]


def train_one(
    config: TrainConfig, folder: Path | None, command: str, should_stop: Callable[[], bool] = never, say: Say = print
) -> PolicyBundle | None:
    """Train or resume one policy: a task for a pool. Without a folder, return the policy's files."""
    with tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
        where = Path(place, f"seed-{config.seed}") if folder is None else folder
        run = Training(config, where, say=say, command=command)
        policy = run.policy() if run.is_finished else run.run(should_stop)
        policy.write(where)  # a finished run may have been killed before this
        if folder is not None:
            return None
        out = Path(place, "policy", where.name)
        policy.write(out)
        return PolicyBundle.of(out)


def _check_players(config: TrainConfig) -> None:
    for name in (*config.opponents, *([config.start_from] if config.start_from is not None else [])):
        if folder_of(name) is not None:
            raise ConfigError(
                f"opponents and start_from of a sweep on other machines must be installed there, got the folder "
                f"{name!r}: name policies, or train with --processes"
            )


def _steps_of(place: Path) -> int:
    """Return the steps of a run at its latest checkpoint; 0 where there is none yet."""
    try:
        return int(read(place / CHECKPOINT, with_arrays=False)[0]["learner"]["steps"])
    except (CheckpointError, LookupError):
        return 0


def _is_trained(place: Path, config: TrainConfig) -> bool:
    """Return True if a run has finished; raise a CheckpointError if its policy had other settings."""
    if not (place / CARD).is_file():
        return False
    trained = LearnedPolicy.read(place, config.game).card["training"]
    if TrainConfig.from_dict(trained) != config:
        raise CheckpointError(f"{place} holds a policy that was trained otherwise; use another folder")
    return True
