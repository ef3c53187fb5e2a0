"""The loop that plays games between two policies.

Games 2p and 2p + 1 are pair p of a match: the same start, with the policy as red, then as blue. Seed and number
determine a game.
"""

from __future__ import annotations

import functools
import math
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, TEAM_NAMES, GameConfig
from swarm_pz.config.base import check_choice, check_count
from swarm_pz.config.installed import FAULTS
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CommandError, FlightError, ForfeitError, PolicyError
from swarm_pz.policy import Player, load_players, name_of
from swarm_pz.simulator.commands import CheckedCommands
from swarm_pz.simulator.spawn import check_seed

Watch = Callable[["Rollout"], None]
Clock = Callable[[int, bool], AbstractContextManager[None]]
_MATCH = 7
"""Sets the seeds of matches apart from those of training."""


def game_number(pair: int, side: str = TEAM_NAMES[RED]) -> int:
    """Return the number of a pair's game with the policy on a side, "red" or "blue"."""
    check_count(pair, "pair", 0, 10**9)
    check_choice(side, "side", TEAM_NAMES)
    return 2 * pair + TEAM_NAMES.index(side)


def _streams(seed: int, number: int) -> list[np.random.SeedSequence]:
    """Return the seeds of a game's start, policy and opponent, which both games of a pair share."""
    return [np.random.SeedSequence(seed, spawn_key=(_MATCH, number // 2, place)) for place in range(3)]


@dataclass(frozen=True, kw_only=True)
class Game:
    """One finished game, from the policy's side."""

    pair: int
    side: str
    outcome: str
    share: float
    """The policy's final fraction of all drones."""
    seconds: float
    captures: int
    """Captures of both teams."""
    recaptures: int
    """Captures within a second of the same drone's previous one."""
    fingerprint: bytes
    """Final positions and teams."""
    sizes: list[int]
    """Red's drones at the start and after every step."""
    sent: tuple[int, int] = (0, 0)
    """Commands of the policy and of its opponent that differed from the one before."""
    thinking_ms: tuple[float, float] = field(default=(0.0, 0.0), compare=False)
    """Mean milliseconds of a command of the policy and of its opponent."""
    forfeit: str = ""
    """The reason, if the game was forfeited."""


class FaultError(PolicyError):
    """A policy (place 0) or its opponent (1) raised an error, returned invalid commands, or took too long."""

    def __init__(self, place: int, reason: str) -> None:
        super().__init__(place, reason)  # all arguments, so that it can be pickled
        self.place = place

    def __str__(self) -> str:
        return str(self.args[1])


class GroundedError(FaultError):
    """A control system or program failed, returned invalid values or took too long: its side forfeits."""


@contextmanager
def policy_errors(place: int, name: str) -> Iterator[None]:
    """Turn errors of a policy in this context into a FaultError with its place."""
    try:
        yield
    except (FlightError, ForfeitError) as error:  # a control system may fail to convert the densities
        raise GroundedError(place, str(error)) from error
    except PolicyError as error:
        raise FaultError(place, str(error)) from error
    except FAULTS as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        raise FaultError(place, f"policy {name} raised {error!r} ({where})") from error


class Rollout:
    """Games of a match, side by side, which can be watched.

    Raises a CommandError if the seed is no whole number of at least 0, a PolicyError if a policy is unknown, a
    FaultError if its reset fails, and a ConfigError if a control system cannot be used.

    Parameters
    ----------
    numbers : sequence of int
        The games, by `game_number`. A game does not depend on the games beside it.
    seed : int
        It determines the starts and both policies' random streams.
    config : GameConfig, optional
        The rules. Handicaps belong to red and blue. The first of two controllers flies for the policy, the second for
        its opponent, on either side.
    clock : callable, optional
        Maps a number of games, and whether they begin, to a context for a policy's reset or commands. The context
        raises if they take too long.

    Attributes
    ----------
    batch : BatchEnv
        The games, in the order of `numbers`.
    rows : int64 array (n,)
        Games that ran before the latest step; all at the start.
    """

    def __init__(
        self,
        policy: str | Player,
        opponent: str | Player,
        numbers: Sequence[int],
        *,
        seed: int = 0,
        config: GameConfig | None = None,
        threads: int = 1,
        clock: Clock | None = None,
    ) -> None:
        if isinstance(seed, np.random.SeedSequence):
            raise CommandError(f"a match's seed is a whole number, which its games' seeds follow from, got {seed!r}")
        check_seed(seed)
        self.config = config if config is not None else GameConfig()
        self._numbers = [int(number) for number in numbers]
        self.sides = np.stack([np.array(self._numbers) % 2, 1 - np.array(self._numbers) % 2])
        """(2, E) teams of the policy and of its opponent."""
        self._names = name_of(policy), name_of(opponent)
        self._players = load_players(policy, opponent, self.config)
        self._clock = clock if clock is not None else lambda *_: nullcontext()
        self.rows = np.arange(len(self._numbers))
        self.batch = BatchEnv(self.config, len(self._numbers), threads=threads)
        self.simulator = self.batch.simulator
        starts, *streams = zip(*(_streams(seed, number) for number in self._numbers), strict=True)
        with self._flying():
            self.batch.reset(starts, swapped=self.sides[0] == BLUE)
        for place, player in enumerate(self._players):
            with policy_errors(place, self._names[place]), self._clock(len(self.rows), True):
                player.reset(streams[place], self.rows)
        self._spent = np.zeros((2, len(self.rows)))
        self._latest = np.full((len(self.rows), 2, *self.batch.command_shape), np.nan)
        self._sent = np.zeros((len(self.rows), 2), np.int64)
        """(E, 2) new commands of red and blue."""
        self._sizes = [self.simulator.sizes[:, RED]]

    def play(
        self,
        seconds: float | None = None,
        *,
        after_step: Watch | None = None,
        after_control_period: Watch | None = None,
    ) -> None:
        """Play to the end, or to the step in which the game time reaches `seconds`.

        `after_step` and `after_control_period` are called with this object. Raises a FaultError if a policy fails, and
        a GroundedError if a control system fails.
        """
        end = math.inf if seconds is None else seconds
        look = None if after_control_period is None else functools.partial(after_control_period, self)
        while self.batch.running.any() and self.simulator.time_s.max() < end:
            self.rows = np.flatnonzero(self.batch.running)
            commands = self.ask()
            with self._flying():
                self.batch.step(CheckedCommands(commands), look)
            self._sizes.append(self.simulator.sizes[:, RED])
            if after_step is not None:
                after_step(self)

    @contextmanager
    def _flying(self) -> Iterator[None]:
        """Turn errors of a control system in this context into a GroundedError."""
        try:
            yield
        except FlightError as error:
            place = 0 if self.sides[0, error.rows[0]] == error.team else 1
            raise GroundedError(place, str(error)) from error

    def ask(self) -> NDArray[np.float64]:
        """Return the commands (E, 2, *command_shape) of both players in the running games."""
        rows = self.rows
        commands = np.zeros((len(self._numbers), 2, *self.batch.command_shape))
        for place, player in enumerate(self._players):
            teams = self.sides[place, rows]
            began = time.perf_counter()
            clock = self._clock(len(rows), len(self._sizes) == 1)
            with policy_errors(place, self._names[place]):
                commands[rows, teams] = self.batch.ask(player, teams, rows, clock)
            self._spent[place, rows] += 1000.0 * (time.perf_counter() - began) / len(rows)
        is_new = (commands[rows] != self._latest[rows]).any(axis=tuple(range(2, commands.ndim)))
        self._sent[rows] += is_new
        self._latest[rows] = commands[rows]
        return commands

    @property
    def finished(self) -> int:
        """Number of games that have ended."""
        return int((~self.batch.running).sum())

    def games(self) -> list[Game]:
        """Return the games; raise a CommandError if one has not ended."""
        history = np.stack(self._sizes, axis=1)
        return [self._game(row, history[row]) for row in range(len(self._numbers))]

    def _game(self, row: int, sizes: NDArray[np.int64]) -> Game:
        simulator, side = self.simulator, int(self.sides[0, row])
        outcome = self.batch.outcome(row, side)
        if outcome is None:
            raise CommandError(f"expected games that have ended, got {self.standing(row)}: play them to the end")
        steps = -(-int(simulator.games.ticks[row]) // self.config.step_ticks)
        return Game(
            pair=self._numbers[row] // 2,
            side=TEAM_NAMES[side],
            outcome=outcome,
            share=float(simulator.sizes[row, side] / self.config.num_drones),
            seconds=float(simulator.time_s[row]),
            captures=int(simulator.games.captures[row].sum()),
            recaptures=int(simulator.games.recaptures[row].sum()),
            fingerprint=simulator.positions[row].tobytes() + simulator.teams[row].tobytes(),
            sizes=sizes[: steps + 1].tolist(),
            sent=(int(self._sent[row, side]), int(self._sent[row, 1 - side])),
            thinking_ms=(float(self._spent[0, row] / steps), float(self._spent[1, row] / steps)),
        )

    def names(self, row: int = 0) -> tuple[str, str]:
        """Return the names of red and blue in a game."""
        policy, opponent = self._names
        return (policy, opponent) if self.sides[0, row] == RED else (opponent, policy)

    def result(self, row: int = 0) -> str:
        """Return the result of a game in words."""
        outcomes = {None: "unfinished", "win": "red won", "loss": "blue won", "draw": "a draw"}
        return outcomes[self.batch.outcome(row, RED)]

    def standing(self, row: int = 0) -> str:
        """Return the state of a game in words."""
        red, blue = self.simulator.sizes[row]
        return f"{self.result(row)} ({self.simulator.time_s[row]:.1f} s, red {red}, blue {blue})"

    def close(self) -> None:
        """End the simulator's threads; games can still be read."""
        self.batch.close()


def play_games(
    policy: str | Player,
    opponent: str | Player,
    numbers: Sequence[int],
    *,
    seed: int,
    config: GameConfig | None = None,
    threads: int = 1,
    clock: Clock | None = None,
    after_step: Watch | None = None,
) -> list[Game]:
    """Play games of a match to their ends; arguments and errors as of `Rollout` and its `play`."""
    rollout = Rollout(policy, opponent, numbers, seed=seed, config=config, threads=threads, clock=clock)
    with closing(rollout):
        rollout.play(after_step=after_step)
        return rollout.games()


def play_or_forfeit(
    make: Callable[[], tuple[Player, Player]],
    numbers: Sequence[int],
    *,
    forfeits: type[FaultError] = GroundedError,
    progress: Callable[[int], None] = lambda _: None,
    **options: Any,
) -> list[Game]:
    """Play games as `play_games` does; a side with a fault of type `forfeits` loses its game, other faults are raised.

    One call of a player serves many games. So after a fault each game is played again alone, with players from `make`.
    `progress` is called with the number of games that have ended.
    """
    try:
        return play_games(*make(), numbers, after_step=lambda rollout: progress(rollout.finished), **options)
    except forfeits as fault:
        if len(numbers) == 1:
            return [_forfeited(numbers[0], fault)]
    played: list[Game] = []

    def report(ended: int) -> None:
        progress(len(played) + ended)

    for number in numbers:
        played += play_or_forfeit(make, [number], forfeits=forfeits, progress=report, **options)
    return played


def _forfeited(number: int, fault: FaultError) -> Game:
    return Game(
        pair=number // 2,
        side=TEAM_NAMES[number % 2],
        outcome="loss" if fault.place == 0 else "win",
        share=float(fault.place),
        seconds=0.0,
        captures=0,
        recaptures=0,
        fingerprint=f"forfeit {number}".encode(),
        sizes=[],
        forfeit=str(fault),
    )
