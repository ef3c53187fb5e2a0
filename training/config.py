"""The settings of a training run; light, so that the command line can list them without PyTorch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, Range, Share, check
from swarm_pz.policies import scripted

SCRIPTS = tuple(script.__name__ for script in scripted.SCRIPTS)
FIELD = (*["uniform"] * 2, *SCRIPTS, "centre", "evade", "evade", "halo", "lasso", "wavefront")
"""The opponents of a run: all scripts, more often those that are measured against or hard to beat."""

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
        The rules, and what the learner sees: drones, if its system takes no densities.
    sizes : tuple of int
        Drones a team, each in an equal part of the games; that of `game` if none is given. Evaluations
        are at the size of `game`.
    opponents : tuple of str
        Names of policies, or folders of learned ones, dealt to the games in turn; the first is the one
        that evaluations during the run are against.
    start_from : str, optional
        A policy, by name or folder, that the tactic starts from: with the weights of a learned one, which must have the
        same network, or with an imitation of another.
    critic_steps : int
        Value warm-up: steps at the start in which only the critic learns, since it does not know the tactic that
        the actor starts from.
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
        Steps of each game between two updates (Stable-Baselines3's `n_steps`).
    batch_size : int
        Steps of a minibatch.
    epochs : int
        Times that each update goes through its steps (`n_epochs`).
    learning_rate : float
        Of Adam, at the start; it falls linearly with the steps, to a twentieth.
    gamma : float
        Discount of a reward one step later.
    gae_lambda : float
        Bias against variance in the advantage estimates.
    clip_range : float
        How far an update may change the probability of an action.
    entropy : float
        Weight of the bonus for exploring (`ent_coef`).
    log_std : float
        Natural logarithm of the exploration's standard deviation at the start.
    final_log_std : float
        The same at the end; in between it changes linearly with the steps. The policy plays its mean action, which is
        learned best when exploration fades.
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
        self.game.to_dict()  # refuses what no checkpoint can name
        check(len(self.opponents) > 0, "opponents", self.opponents, "at least one policy's name")
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
        The learner's run. It plays the pool instead of `opponents`, and is not evaluated meanwhile.
    scripts : tuple of str
        Policies that are in the pool from the start; none for pure self-play.
    initial_opponents : tuple of str
        Learned tactics, by name or folder, that are in the pool from the start, too. They are dealt as snapshots are,
        but do not explore.
    seats : int
        Opponents dealt at a time.
    cycle : int
        Steps between two deals.
    pfsp_exponent : float
        k of the weight (1 - p)^k of an opponent from which the learner takes a mean share p of the drones.
    floor : float
        What is added to every weight.
    script_share : float
        Share of the seats that scripts have among themselves; all of them as long as nobody else is there.
    snapshot_score : float
        Mean share of the drones against the newest snapshot from which on the next is taken.
    snapshot_every : int
        Steps after which one is taken at the latest.
    exploiter_every : int
        Steps between two exploiters.
    exploiter_steps : int
        Steps that each trains; 0 for a league without.
    pattern_share : float
        Share of the seats that patterns have among themselves; see `swarm_pz.policies.pattern`. Those that the learner
        beats make room for new ones.
    async_delay : int
        Steps of the learner from where an exploiter's training begins to where the learner waits for it. Other
        processes or machines train it meanwhile; the result is the same without them.
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
