"""The settings of a training run; importing them needs no PyTorch, so that the command line can list them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, Range, Share, check
from swarm_pz.policies import scripted

SCRIPTS = tuple(script.__name__ for script in scripted.SCRIPTS)
FIELD = (*["uniform"] * 2, *SCRIPTS, "centre", "evade", "evade", "halo", "lasso", "wavefront")
"""The default opponents: all scripts, with more copies of those used in evaluations or hard to beat."""

MAY_CHANGE: dict[str, Any] = {"total_steps": 1, "threads": 1, "evaluate_every": 1, "checkpoint_every": 1}
"""Settings that a resumed run may change, and the values that replace them in comparisons."""


Steps = Annotated[int, Range(1, 10**12)]
StepsOrNone = Annotated[int, Range(0, 10**12)]
GamesAtOnce = Annotated[int, Range(1, 65536)]
LogStd = Annotated[float, Range(-10.0, 2.0)]


@dataclass(frozen=True, kw_only=True)
class TrainConfig(Config):
    """A training run.

    Attributes
    ----------
    game : GameConfig
        The rules, and the learner's observation: drones, if its control system takes no densities.
    sizes : tuple of int
        Team sizes, each in an equal part of the games; if empty, the size of `game`. Evaluations
        use the size of `game`.
    opponents : tuple of str
        Names of policies, or folders of learned ones, assigned to the games in turn; evaluations during
        the run are against the first.
    start_from : str, optional
        A policy, by name or folder, from which training starts: from the weights of a learned policy, which must have
        the same network, or from an imitation of any other.
    critic_steps : int
        Value warm-up: steps at the start in which only the critic learns, since it does not know the tactic that
        the actor starts from.
    action_cells : int
        Cells per side of the learner's action, if it is a density; must divide the observation's grid.
    width : int
        Channels of the network's hidden layers, a multiple of eight.
    total_steps : int
        Environment steps in all, each one command of one game; 200,000 are too few to tell a tactic from an
        untrained one.
    num_envs : int
        Games played at once.
    rollout : int
        Steps of each game between two updates (Stable-Baselines3's `n_steps`).
    batch_size : int
        Steps of a minibatch.
    epochs : int
        Passes of each update through its steps (`n_epochs`).
    learning_rate : float
        Adam's learning rate at the start; it falls linearly with the steps, to a twentieth.
    gamma : float
        Discount of a reward one step later.
    gae_lambda : float
        Trade-off between bias and variance in the advantage estimates.
    clip_range : float
        How far an update may change the probability of an action.
    entropy : float
        Weight of the entropy bonus, which rewards exploration (`ent_coef`).
    log_std : float
        Natural logarithm of the exploration's standard deviation at the start.
    final_log_std : float
        The same at the end; in between it changes linearly with the steps. The policy plays its mean action, which is
        learned best when exploration fades.
    evaluate_every : int
        Steps between evaluations without exploration.
    evaluation_games : int
        Games of each evaluation, an even number.
    checkpoint_every : int
        Steps between checkpoints.
    seed : int
        Seed of the network, the exploration and the games.
    threads : int
        Threads of the games and of the network.
    """

    game: GameConfig = field(default_factory=lambda: GameConfig(observation=ObservationConfig(grid=10)))
    sizes: tuple[Annotated[int, Range(1, 10_000)], ...] = ()
    opponents: tuple[str, ...] = FIELD
    start_from: str | None = None
    critic_steps: StepsOrNone = 0
    action_cells: Annotated[int, Range(2, 50)] = 5
    width: Annotated[int, Range(8, 512)] = 32
    total_steps: Steps = 1_900_000
    num_envs: GamesAtOnce = 320
    rollout: Annotated[int, Range(2, 65536)] = 32
    batch_size: Annotated[int, Range(2, 10**7)] = 512
    epochs: Annotated[int, Range(1, 1000)] = 2
    learning_rate: Share = 6e-4
    gamma: Share = 0.98
    gae_lambda: Share = 0.95
    clip_range: Share = 0.2
    entropy: Annotated[float, Range(-1.0, 1.0)] = 0.0
    log_std: LogStd = -0.7
    final_log_std: LogStd = -2.0
    evaluate_every: Steps = 150_000
    evaluation_games: Annotated[int, Range(2, 10**6)] = 40
    checkpoint_every: Steps = 100_000
    seed: Annotated[int, Range(0, 2**32 - 1)] = 0
    threads: Annotated[int, Range(1, 1024)] = 2

    def __post_init__(self) -> None:
        super().__post_init__()
        self.game.to_dict()  # raises an error if checkpoints cannot name a control system
        check(len(self.opponents) > 0, "opponents", self.opponents, "at least one policy's name")
        shared = self.num_envs % max(len(self.sizes), 1) == 0
        check(shared, "num_envs", self.num_envs, f"a multiple of {len(self.sizes)}, the number of sizes")
        check(self.evaluation_games % 2 == 0, "evaluation_games", self.evaluation_games, "even")
        if self.game.team_systems[0].takes == "density":
            self._check_images()
        else:  # the network for other commands observes drones
            rules = self.game.replace(observation=ObservationConfig(kind="drones"))
            object.__setattr__(self, "game", rules)

    def _check_images(self) -> None:
        """Check that the network for densities fits the settings."""
        kind, grid, cells = self.game.observations[0].kind, self.game.observations[0].grid, self.action_cells
        check(kind == "grids", "game.observation.kind", kind, "'grids', which the network is made for")
        check(self.width % 8 == 0, "width", self.width, "a multiple of 8, the symmetries of the square")
        check(grid % cells == 0, "action_cells", cells, f"a divisor of the observation's grid of {grid}")


RECIPES = {
    "quick": TrainConfig(),
    "long": TrainConfig(total_steps=3_000_000, num_envs=160, rollout=64, batch_size=1024, epochs=4, learning_rate=5e-4),
}
"""Settings by name: `quick`, the default, takes under six minutes on two idle cores; `long` takes half an hour."""


@dataclass(frozen=True, kw_only=True)
class LeagueConfig(Config):
    """A league.

    Attributes
    ----------
    learner : TrainConfig
        The learner's run. It plays against the pool instead of `opponents`, and has no evaluations.
    scripts : tuple of str
        Policies that are in the pool from the start; none for pure self-play.
    initial_opponents : tuple of str
        Learned tactics, by name or folder, that are also in the pool from the start. They are drawn like snapshots,
        but do not explore.
    seats : int
        Opponents drawn at a time.
    cycle : int
        Steps between two draws.
    pfsp_exponent : float
        k in (1 - p)^k, the weight of an opponent from which the learner takes a mean share p of the drones.
    floor : float
        Number added to every weight.
    script_share : float
        Share of the seats for all scripts together; every seat as long as the pool holds only scripts.
    snapshot_score : float
        The next snapshot is taken when the learner's mean share of the drones against the newest reaches this.
    snapshot_every : int
        Steps after which a snapshot is taken at the latest.
    exploiter_every : int
        Steps between two exploiters.
    exploiter_steps : int
        Training steps of each exploiter; 0 for a league without exploiters.
    pattern_share : float
        Share of the seats for all patterns together; see `swarm_pz.policies.pattern`. New patterns replace those that
        the learner beats.
    async_delay : int
        Steps of the learner between the start of an exploiter's training and the wait for its end. Meanwhile other
        processes or machines train the exploiter; the result is the same without them.
    """

    learner: TrainConfig = field(default=RECIPES["long"])
    scripts: tuple[str, ...] = SCRIPTS
    initial_opponents: tuple[str, ...] = ()
    seats: GamesAtOnce = 16
    cycle: Steps = 65_536
    pfsp_exponent: Annotated[float, Range(0.0, 100.0)] = 2.0
    floor: Annotated[float, Range(1e-6, 1.0)] = 0.02
    script_share: Share = 0.4
    snapshot_score: Share = 0.65
    snapshot_every: Steps = 500_000
    exploiter_every: Steps = 1_500_000
    exploiter_steps: StepsOrNone = 500_000
    pattern_share: Share = 0.3
    async_delay: StepsOrNone = 0
