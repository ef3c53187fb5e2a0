"""The settings of a training run; light, so that the command line can list them without PyTorch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, check, check_count, check_number
from swarm_pz.policies import scripted

SCRIPTS = tuple(script.__name__ for script in scripted.SCRIPTS)
FIELD = (*["uniform"] * 2, *SCRIPTS, "centre", "evade", "evade", "halo", "lasso", "wavefront")
"""Whom a run meets: all scripts, and more often those that are measured against or hard to beat."""

MAY_CHANGE: dict[str, Any] = {"total_steps": 1, "threads": 1, "evaluate_every": 1, "checkpoint_every": 1}
"""What a run may change when it is taken up, and what counts instead where settings must be the same."""


def _check_names(names: object, field: str) -> None:
    holds = isinstance(names, tuple) and all(isinstance(name, str) for name in names)
    check(holds, field, names, "a tuple of policies' names")


@dataclass(frozen=True, kw_only=True)
class TrainConfig(Config):
    """A training run.

    Attributes
    ----------
    game : GameConfig
        The rules, and what the learner sees; who learns to command a system that takes no densities sees the drones.
    sizes : tuple of int
        Drones a team, each in an equal part of the games; that of `game` if none is given. Evaluations
        are at the size of `game`.
    opponents : tuple of str
        Names of policies, or folders of learned ones, dealt to the games in turn; the first is the one
        that evaluations during the run are against.
    start_from : str, optional
        A learned policy, by name or folder, whose weights the tactic starts from; its network must be
        the one that this run trains.
    critic_steps : int
        Steps at the start in which only the critic learns, for it knows nothing of a tactic that is
        taken over.
    action_cells : int
        Cells a side of the learner's action, if it is a density; divides the observation's grid.
    width : int
        Channels of the network's hidden layers, a multiple of eight.
    total_steps : int
        Environment steps in all, each one command of one game; after 200,000 a tactic cannot be told from an
        untrained one yet.
    num_envs : int
        Games played at once.
    rollout : int
        Steps of each game between two updates.
    batch_size : int
        Steps of a minibatch.
    epochs : int
        Times that each update goes through its steps.
    learning_rate : float
        Of Adam, at the start; it falls linearly with the steps, to a twentieth.
    gamma : float
        Discount of a reward one step later.
    gae_lambda : float
        Bias against variance in the advantage estimates.
    clip_range : float
        How far an update may change the probability of an action.
    entropy : float
        Weight of the bonus for exploring.
    log_std : float
        Natural logarithm of the exploration's standard deviation at the start.
    final_log_std : float
        The same at the end; in between it changes linearly with the steps. What plays later is the
        mean action, which is learned best when exploration fades.
    evaluate_every : int
        Steps between evaluations without exploration.
    evaluation_games : int
        Games of such an evaluation, even.
    checkpoint_every : int
        Steps between checkpoints.
    seed : int
        Of the network, the exploration and the games.
    threads : int
        Threads of the games and of the network.
    """

    game: GameConfig = field(default_factory=lambda: GameConfig(observation=ObservationConfig(grid=10)))
    sizes: tuple[int, ...] = ()
    opponents: tuple[str, ...] = FIELD
    start_from: str | None = None
    critic_steps: int = 0
    action_cells: int = 5
    width: int = 32
    total_steps: int = 2_400_000
    num_envs: int = 320
    rollout: int = 32
    batch_size: int = 1024
    epochs: int = 3
    learning_rate: float = 6e-4
    gamma: float = 0.98
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    entropy: float = 0.0
    log_std: float = -0.7
    final_log_std: float = -2.0
    evaluate_every: int = 150_000
    evaluation_games: int = 40
    checkpoint_every: int = 100_000
    seed: int = 0
    threads: int = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        check(isinstance(self.game, GameConfig), "game", self.game, "a GameConfig")
        self.game.to_dict()  # refuses what no checkpoint can name
        _check_names(self.opponents, "opponents")
        check(len(self.opponents) > 0, "opponents", self.opponents, "at least one policy's name")
        check(isinstance(self.sizes, tuple), "sizes", self.sizes, "a tuple of numbers of drones")
        for size in self.sizes:
            check_count(size, "sizes", 1, 10_000)
        for name, low, high in (
            ("critic_steps", 0, 10**12),
            ("width", 8, 512),
            ("total_steps", 1, 10**12),
            ("num_envs", 1, 65536),
            ("rollout", 2, 65536),
            ("batch_size", 2, 10**7),
            ("epochs", 1, 1000),
            ("evaluate_every", 1, 10**12),
            ("evaluation_games", 2, 10**6),
            ("checkpoint_every", 1, 10**12),
            ("seed", 0, 2**32 - 1),
            ("threads", 1, 1024),
        ):
            check_count(getattr(self, name), name, low, high)
        for name, lowest, highest in (
            ("learning_rate", 0.0, 1.0),
            ("gamma", 0.0, 1.0),
            ("gae_lambda", 0.0, 1.0),
            ("clip_range", 0.0, 1.0),
            ("entropy", -1.0, 1.0),
            ("log_std", -10.0, 2.0),
            ("final_log_std", -10.0, 2.0),
        ):
            check_number(getattr(self, name), name, lowest, highest)
        shared = self.num_envs % max(len(self.sizes), 1) == 0
        check(shared, "num_envs", self.num_envs, f"a multiple of {len(self.sizes)}, the number of sizes")
        check(self.evaluation_games % 2 == 0, "evaluation_games", self.evaluation_games, "even")
        if self.game.team_systems[0].takes == "density":
            self._check_images()
        else:  # the network for other commands looks at drones
            rules = self.game.replace(observation=ObservationConfig(kind="drones"))
            object.__setattr__(self, "game", rules)

    def _check_images(self) -> None:
        """Check what the network that learns densities is made for."""
        observation = self.game.observations[0]
        check(
            observation.kind == "grids",
            "game.observation.kind",
            observation.kind,
            "'grids', which the network is made for",
        )
        check(self.width % 8 == 0, "width", self.width, "a multiple of 8, the symmetries of the square")
        check(
            isinstance(self.action_cells, int) and self.action_cells >= 2 and observation.grid % self.action_cells == 0,
            "action_cells",
            self.action_cells,
            f"a divisor of the observation's grid of {observation.grid}, at least 2",
        )


RECIPES = {
    "quick": TrainConfig(),
    "long": TrainConfig(total_steps=3_000_000, num_envs=160, rollout=64, epochs=4, learning_rate=5e-4),
}
"""Settings by name: `quick`, the default, takes under six minutes on two idle cores; `long` takes half an hour."""


@dataclass(frozen=True, kw_only=True)
class LeagueConfig(Config):
    """A league.

    Attributes
    ----------
    learner : TrainConfig
        The learner's run. It plays the pool instead of `opponents`, and is rated instead of evaluated.
    scripts : tuple of str
        Policies that are in the pool from the start; none for pure self-play.
    rivals : tuple of str
        Learned tactics, by name or folder, that are there from the start, too, but among the snapshots:
        those that beat an earlier champion, say.
    seats : int
        Opponents dealt at a time.
    cycle : int
        Steps between two deals.
    hardness : float
        Exponent k of the weight (1 - p)^k of an opponent beaten in a share p of the games.
    floor : float
        What is added to every weight.
    script_share : float
        Share of the seats that scripts have among themselves; all of them as long as nobody else is there.
    snapshot_score : float
        Score against the newest snapshot from which on the next is taken.
    snapshot_every : int
        Steps after which one is taken at the latest.
    exploiter_every : int
        Steps between two exploiters.
    exploiter_steps : int
        Steps that each trains; 0 for a league without.
    join_after : int
        Steps of the learner from where an exploiter, or the rating of a snapshot, begins to where it is waited for.
        Other processes or machines are at it meanwhile; the result is the same without them.
    """

    learner: TrainConfig = field(default=RECIPES["long"])
    scripts: tuple[str, ...] = SCRIPTS
    rivals: tuple[str, ...] = ()
    seats: int = 16
    cycle: int = 65_536
    hardness: float = 2.0
    floor: float = 0.02
    script_share: float = 0.5
    snapshot_score: float = 0.65
    snapshot_every: int = 500_000
    exploiter_every: int = 1_500_000
    exploiter_steps: int = 500_000
    join_after: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        check(isinstance(self.learner, TrainConfig), "learner", self.learner, "a TrainConfig")
        for name in ("scripts", "rivals"):
            _check_names(getattr(self, name), name)
        for name, low, high in (
            ("seats", 1, 65536),
            ("cycle", 1, 10**12),
            ("snapshot_every", 1, 10**12),
            ("exploiter_every", 1, 10**12),
            ("exploiter_steps", 0, 10**12),
            ("join_after", 0, 10**12),
        ):
            check_count(getattr(self, name), name, low, high)
        for name, lowest, highest in (
            ("hardness", 0.0, 100.0),
            ("floor", 1e-6, 1.0),
            ("script_share", 0.0, 1.0),
            ("snapshot_score", 0.0, 1.0),
        ):
            check_number(getattr(self, name), name, lowest, highest)
