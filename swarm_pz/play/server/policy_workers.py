"""Where policies think: in processes of their own, so that no thought delays a game.

A process keeps the policies of its seats, with their states and random streams, and shows each the
game from its side. One that hangs is ended, and begins anew with the next question.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import multiprocessing.connection
import signal
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.evaluation.processes import alarm, prepare_process
from swarm_pz.evaluation.rollout import FaultError, blame
from swarm_pz.kernels.game import Games
from swarm_pz.policy import Player
from swarm_pz.simulator.spawn import Seed

Loader = Callable[[str, GameConfig], Player]
LOADING_S = 60.0
"""Seconds that a policy may take to be made: its libraries load then."""
_GRACE_S = 2.0
"""Seconds after which a process that does not even say that it is late is ended."""
_ROW = np.zeros(1, np.int64)


@dataclass(frozen=True, kw_only=True)
class PolicySeat:
    """A policy in a game.

    Attributes
    ----------
    key : hashable
        What no other seat has.
    policy : str
    game : GameConfig
    team : int
    seed : int or SeedSequence
        Of its random stream.
    """

    key: Hashable
    policy: str
    game: GameConfig
    team: int
    seed: Seed


def _work(pipe: multiprocessing.connection.Connection, loader: Loader) -> None:
    """Answer questions until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the server decides when to end
    prepare_process()
    seats: dict[Hashable, tuple[Player, BatchEnv]] = {}
    while True:
        try:
            seat, games, limit_s = pipe.recv()
        except EOFError:
            return
        if games is None:
            seats.pop(seat.key, None)
            continue
        try:
            with blame(seat.team, seat.policy):
                if seat.key not in seats:
                    with alarm(LOADING_S):
                        policy, batch = loader(seat.policy, seat.game), BatchEnv(seat.game)
                        batch.reset([0])
                        policy.reset([seat.seed], _ROW)
                        batch.simulator.restore(games)
                        batch.ask(policy, np.array([seat.team]), _ROW)  # what is compiled is compiled now
                        policy.reset([seat.seed], _ROW)
                    seats[seat.key] = policy, batch
                policy, batch = seats[seat.key]
                batch.simulator.restore(games)
                with alarm(limit_s):
                    answer: object = batch.ask(policy, np.array([seat.team]), _ROW)[0]
        except FaultError as fault:
            answer = fault
        pipe.send(answer)


class _Process:
    """One process of `PolicyWorkers`, started when it is first needed and after it was ended."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="thinker")
        self._process: multiprocessing.process.BaseProcess | None = None
        self._known: set[Hashable] = set()
        self._closing = False

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, self._loader), daemon=True)
        process.start()
        self._process = process
        theirs.close()
        self._known = set()

    def _end(self) -> None:
        if self._process is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
            self._process = None

    def _ask(self, seat: PolicySeat, games: Games, limit_s: float) -> NDArray[np.float64]:
        if self._closing:
            raise PolicyError("the server is ending")
        patience = limit_s + _GRACE_S + (0.0 if seat.key in self._known else LOADING_S)
        try:
            if self._process is None:
                self._start()
            self._pipe.send((seat, games, limit_s))
            if not self._pipe.poll(patience):
                raise TimeoutError
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            self._end()
            how = "did not answer" if isinstance(error, TimeoutError) else "ended its process"
            raise PolicyError(f"policy {seat.policy} {how}") from error
        self._known.add(seat.key)
        if isinstance(answer, FaultError):
            raise PolicyError(str(answer)) from answer
        return np.asarray(answer)

    def _forget(self, seat: PolicySeat) -> None:
        if self._process is not None and seat.key in self._known:
            self._known.discard(seat.key)
            try:
                self._pipe.send((seat, None, 0.0))
            except OSError:
                self._end()

    async def ask(self, seat: PolicySeat, games: Games, limit_s: float) -> NDArray[np.float64]:
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._ask, seat, games, limit_s)

    def forget(self, seat: PolicySeat) -> None:
        self._thread.submit(self._forget, seat)

    def close(self) -> None:
        self._closing = True
        process = self._process
        if process is not None:
            process.kill()  # a thread that waits for it wakes
        self._thread.shutdown(wait=True, cancel_futures=True)
        self._end()


class PolicyWorkers:
    """Processes in which policies think.

    Parameters
    ----------
    loader : callable
        From a name and a game to a policy; found again by its name in other processes.
    processes : int
    limit_s : float
        Seconds that a thought may take.
    """

    def __init__(self, loader: Loader, processes: int = 1, limit_s: float = 2.0) -> None:
        self._processes = [_Process(loader) for _ in range(processes)]
        self._places: dict[Hashable, _Process] = {}
        self._limit_s = limit_s

    async def ask(self, seat: PolicySeat, games: Games) -> NDArray[np.float64]:
        """Return what a policy answers to a game.

        Parameters
        ----------
        seat : PolicySeat
        games : Games
            A snapshot of its one game.

        Raises
        ------
        PolicyError
            If the policy cannot be made, raises, or answers nonsense or too late.
        """
        if seat.key not in self._places:
            load = list(self._places.values())
            self._places[seat.key] = min(self._processes, key=load.count)
        return await self._places[seat.key].ask(seat, games, self._limit_s)

    def forget(self, seat: PolicySeat) -> None:
        """Let a seat's policy go."""
        if (process := self._places.pop(seat.key, None)) is not None:
            process.forget(seat)

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.close()
