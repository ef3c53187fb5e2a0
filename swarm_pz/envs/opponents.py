"""One learner against an opponent in each of E games: the base of the wrappers for one learner."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, TEAM_NAMES, GameConfig
from swarm_pz.config.base import check_choice
from swarm_pz.envs.batch_env import BatchEnv, StepResult
from swarm_pz.errors import ConfigError
from swarm_pz.policy import Player, is_constant, load, name_of
from swarm_pz.policy.model_policy import Model
from swarm_pz.simulator import CheckedCommands
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.formats import Format
from swarm_pz.spaces.observation import Observations

Opponent = str | Path | Player | Model
Opponents = Opponent | Sequence[Opponent]


class _Opponent(NamedTuple):
    number: int
    player: Player
    is_constant: bool


class DuelBatch:
    """E games, each with a learner on one side and an opponent on the other; keywords as of `DuelVectorEnv`.

    Every pair in `config` is (learner, opponent), on either side. Policies have their own observation; for a
    model, the `observation` of its side names the channels. An opponent's command holds for `answer_ticks`, by default
    a step. `format` has the learner's spaces. Infos have indices into `opponent_names`: all opponents dealt so far.
    """

    def __init__(
        self,
        config: GameConfig,
        num_games: int,
        *,
        opponent: Opponents = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: ActionKind = "normalised",
        action_cells: int | None = None,
        threads: int = 1,
        max_cycles: int | None = None,
        answer_ticks: int | None = None,
    ) -> None:
        check_choice(side, "side", ("random", *TEAM_NAMES))
        self.config = config
        self.batch = BatchEnv(config, num_games, threads=threads, max_cycles=max_cycles)
        self.format = Format(
            config, config.observations[0], config.team_systems[0], action=action, action_cells=action_cells
        )
        self._side = side
        self._answer_ticks = config.step_ticks if answer_ticks is None else answer_ticks
        self._commands = np.zeros((num_games, 2, *self.batch.command_shape))
        self._games = np.arange(num_games)
        self.sides = np.zeros(num_games, np.int64)
        """Team of each game's learner."""
        self.opponent_names: list[str] = []
        self.deal(opponent)
        self._playing = [self._dealt[0]] * num_games
        self._numbers = np.zeros(num_games, np.int64)
        self._is_settled = np.zeros(num_games, np.bool_)
        """(E,) games whose opponent's command stays as it is."""

    def deal(self, opponent: Opponents, names: Sequence[str] | None = None) -> None:
        """Deal opponents to the games in turn, from each game's next start on; infos call them `names`.

        Raises
        ------
        ConfigError, PolicyError
            If there is none, or one cannot be loaded; the old ones stay.
        """
        alone = isinstance(opponent, str) or not isinstance(opponent, Sequence)
        policies: list[Opponent] = [opponent] if alone else list(opponent)  # type: ignore[list-item, arg-type]
        if not policies:
            raise ConfigError("opponent must be a policy, a name or a sequence of these, got none")
        # Games against the same opponent share one policy object, which answers them together.
        system, theirs = self.config.team_systems[1], self.config
        if isinstance(theirs.observation, tuple):  # a model's channels are looked up in its own one first
            theirs = theirs.replace(observation=theirs.observation[::-1])
        loaded = {key: load(policy, theirs, system) for key, policy in {_key(one): one for one in policies}.items()}
        labels = [name_of(policy) for policy in policies] if names is None else list(names)
        self.opponent_names += [name for name in dict.fromkeys(labels) if name not in self.opponent_names]
        may_hold = not self.batch.simulator.control.is_given  # other systems may refuse it once a team has grown
        dealt = [
            _Opponent(self.opponent_names.index(name), loaded[_key(policy)], may_hold and is_constant(policy))
            for name, policy in zip(labels, policies, strict=True)
        ]
        self._dealt = [dealt[row % len(dealt)] for row in range(self.batch.num_games)]

    def _by_opponent(self, rows: NDArray[np.int64]) -> Iterable[tuple[Player, NDArray[np.int64]]]:
        """Group rows by their opponents."""
        groups: dict[int, list[int]] = {}
        for row in rows.tolist():
            groups.setdefault(id(self._playing[row].player), []).append(row)
        return [(self._playing[group[0]].player, np.array(group)) for group in groups.values()]

    def reset(
        self,
        seeds: Sequence[np.random.SeedSequence],
        rows: NDArray[np.int64],
        scenario: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Start games; each seed decides the start, the learner's side and the opponent's stream."""
        streams = [_child_seeds(seed) for seed in seeds]
        if self._side == "random":
            sides = np.array([np.random.default_rng(side).integers(2) for side, _ in streams], np.int64)
        else:
            sides = np.full(len(seeds), TEAM_NAMES.index(self._side))
        self.batch.reset(seeds, rows, scenario, swapped=sides == BLUE, with_sizes=True)
        self.sides[rows], self._is_settled[rows] = sides, False
        for row in rows.tolist():
            self._playing[row] = self._dealt[row]
            self._numbers[row] = self._dealt[row].number
        streams_of = dict(zip(rows.tolist(), (stream for _, stream in streams), strict=True))
        for policy, mine in self._by_opponent(rows):
            policy.reset([streams_of[row] for row in mine.tolist()], mine)

    def observe(self, rows: NDArray[np.int64] | None = None) -> Observations:
        """Return the learners' observations of some games."""
        chosen = self._games if rows is None else rows
        return self.batch.see(self.format.observation, self.sides[chosen], chosen)

    def step(
        self, actions: ArrayLike | CheckedCommands, after_control_period: Callable[[], None] | None = None
    ) -> StepResult:
        """Play the learners' actions (E, ...), or their commands (E, *command_shape); rewards are theirs (E,).

        Raises
        ------
        CommandError, PolicyError
            If an action or an answer is not valid; no game is changed.
        """
        if isinstance(actions, CheckedCommands):
            mine = actions.values
        else:
            mine = self.batch.pack(self.format.read(actions, self.batch.num_games))
        self._commands[self._games, self.sides] = mine
        due = (self.batch.running & ~self._is_settled).nonzero()[0]
        if len(due):
            due = due[self.batch.simulator.games.ticks[due] % self._answer_ticks == 0]
        for policy, rows in self._by_opponent(due):
            others = 1 - self.sides[rows]
            self._commands[rows, others] = self.batch.ask(policy, others, rows)
            self._is_settled[rows] = self._playing[rows[0]].is_constant
        result = self.batch.step(CheckedCommands(self._commands), after_control_period)
        return result._replace(rewards=result.rewards[self._games, self.sides])

    def infos(self, result: StepResult | None = None, rows: NDArray[np.int64] | None = None) -> dict[str, NDArray[Any]]:
        """Return the learners' infos of some games, or of all: `BatchEnv.infos`, share, side and opponent."""
        chosen = self._games if rows is None else rows
        sides = self.sides[chosen]
        infos = self.batch.infos(result, sides, chosen)
        infos["share"] = infos["size"] / self.config.num_drones
        infos["side"] = sides
        infos["opponent"] = self._numbers[chosen]
        return infos


def _key(policy: Opponent) -> str | int:
    return str(policy) if isinstance(policy, (str, Path)) else id(policy)


def _child_seeds(seed: np.random.SeedSequence) -> list[np.random.SeedSequence]:
    """Derive two seeds from a seed without changing it, unlike `SeedSequence.spawn`."""
    return [
        np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, purpose), pool_size=seed.pool_size)
        for purpose in (1_000_001, 1_000_002)
    ]


class OneLearner:
    """Properties of the Gymnasium wrappers of a `DuelBatch`."""

    duel: DuelBatch
    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's spec, with `max_cycles` as `max_episode_steps`; a `TimeLimit` would not know it."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = spec
        if spec is not None:
            spec.max_episode_steps = self.duel.batch.max_cycles

    @property
    def opponent_names(self) -> list[str]:
        """Names of opponents, by their indices in infos."""
        return self.duel.opponent_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """The names of discrete actions; empty for other actions."""
        return self.duel.format.command_names
