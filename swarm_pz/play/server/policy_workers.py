"""Processes in which policies load and act, so that neither delays a game.

A policy is loaded when it gets a seat, and asked once, so that all is compiled before its game begins. A process that
hangs is ended; its policies are loaded again when next asked.
"""

from __future__ import annotations

import asyncio
import logging
import multiprocessing
import multiprocessing.connection
import os
import threading
from collections import Counter
from collections.abc import Callable, Coroutine, Hashable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError, SwarmError
from swarm_pz.evaluation.processes import alarm, interrupts_blocked, prepare_process
from swarm_pz.evaluation.rollout import FaultError, policy_errors
from swarm_pz.kernels.game import Games
from swarm_pz.play.server.worker import Worker
from swarm_pz.policy import Player
from swarm_pz.simulator import CheckedCommands, Simulator
from swarm_pz.simulator.spawn import Seed

Loader = Callable[[str, GameConfig, ControlSystem], Player]
Answer = NDArray[np.float64]
LOADING_S = 180.0
"""Seconds that a policy may take to be loaded and asked once."""
MOST_PROCESSES = max(4, os.cpu_count() or 1)
"""Each takes 190 MB, or 380 MB with PyTorch; with four, a room plays while another room's policies load."""
_GRACE_S = 2.0
"""Seconds beyond a limit after which a process that does not answer is ended."""
_ROW = np.zeros(1, np.int64)
log = logging.getLogger("swarm_pz.play")


@dataclass(frozen=True, kw_only=True)
class PolicySeat:
    """A policy in a seat; the key is unique."""

    key: Hashable
    policy: str
    game: GameConfig
    team: int


@dataclass(frozen=True, kw_only=True)
class _Question:
    """A question to a policy; without a game the policy is only loaded."""

    seat: PolicySeat
    games: Games | None = None
    seed: Seed = 0
    begins: bool = False
    limit_s: float = 0.0


def _load(seat: PolicySeat, loader: Loader) -> tuple[Player, BatchEnv]:
    with alarm(LOADING_S):
        policy = loader(seat.policy, seat.game, seat.game.team_systems[seat.team])
        batch = BatchEnv(seat.game)
        batch.reset([0])
        policy.reset([0], _ROW)
        batch.ask(policy, np.array([seat.team]), _ROW)  # compiles what is needed, before the game
        return policy, batch


def _work(pipe: multiprocessing.connection.Connection, loader: Loader) -> None:
    """Answer questions until the pipe is closed; a seat without a question is forgotten."""
    prepare_process()
    seats: dict[Hashable, tuple[Player, BatchEnv]] = {}
    while True:
        try:
            request: _Question | PolicySeat = pipe.recv()
        except EOFError:
            return
        if isinstance(request, PolicySeat):
            seats.pop(request.key, None)
            continue
        seat = request.seat
        answer: object = None
        try:
            with policy_errors(seat.team, seat.policy):
                is_new = seat.key not in seats
                if is_new:
                    seats[seat.key] = _load(seat, loader)
                if request.games is not None:
                    policy, batch = seats[seat.key]
                    batch.simulator.restore(request.games)
                    with alarm(request.limit_s):
                        if is_new or request.begins:
                            policy.reset([request.seed], _ROW)
                        answers = batch.ask(policy, np.array([seat.team]), _ROW)
                        # The game will draw the answer; a control system that cannot draw it fails here already.
                        batch.simulator.command(seat.team, CheckedCommands(answers))
                        answer = answers[0]
        except FaultError as fault:
            answer = fault
        pipe.send(answer)


class _Process:
    """One process of `PolicyWorkers`, started when it is first needed and again after it was ended.

    - `known`: policies that were loaded here; their libraries are imported.
    """

    def __init__(self, loader: Loader) -> None:
        self.known: set[str] = set()
        self._loader = loader
        self._worker = Worker("policies")
        self._process: multiprocessing.process.BaseProcess | None = None
        self._loaded: set[Hashable] = set()
        self._loading: Hashable = None
        self._lock = threading.Lock()  # so that no process is started after the end
        self._killed = self._closing = False

    @property
    def is_started(self) -> bool:
        return self._process is not None

    def _start(self) -> None:
        with self._lock:
            if self._closing:
                raise PolicyError("the server is ending")
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe()
            process = context.Process(target=_work, args=(theirs, self._loader), daemon=True)
            with interrupts_blocked():  # the server decides when to end
                process.start()
            self._process = process
            theirs.close()

    def _end(self) -> None:
        if self._process is not None:
            self._pipe.close()
            self._process.kill()
            self._process.join()
        self._process, self._killed = None, False
        self._loaded.clear()
        self.known.clear()

    def _kill(self) -> None:
        """End the process from another thread, which wakes the one that waits for it."""
        with self._lock:
            if self._process is not None:
                self._killed = True
                self._process.kill()

    def _ask(self, question: _Question) -> Answer | None:
        key, name = question.seat.key, question.seat.policy
        try:
            if self._killed:
                self._end()
            if self._process is None:
                self._start()
            is_loaded = key in self._loaded
            self._loading = None if is_loaded else key
            self._pipe.send(question)
            if not self._pipe.poll(question.limit_s + _GRACE_S + (0.0 if is_loaded else LOADING_S)):
                raise TimeoutError
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            self._end()
            failure = "did not answer" if isinstance(error, TimeoutError) else "ended its process"
            raise PolicyError("the server is ending" if self._closing else f"policy {name} {failure}") from error
        finally:
            self._loading = None
        if isinstance(answer, FaultError):
            raise PolicyError(str(answer)) from answer
        self._loaded.add(key)
        return None if answer is None else np.asarray(answer)

    def _forget(self, seat: PolicySeat) -> None:
        self._loaded.discard(seat.key)
        if self._process is not None and not self._killed:
            try:
                self._pipe.send(seat)
            except OSError:
                self._end()

    def ask(self, question: _Question) -> asyncio.Future[Answer | None]:
        self.known.add(question.seat.policy)
        return self._worker.do(self._ask, question)

    def forget(self, seat: PolicySeat, *, was_alone: bool) -> None:
        if was_alone and self._loading == seat.key:
            self._kill()  # nobody waits for it any more, and others may need the process
        self._worker.do(self._forget, seat)

    def close(self) -> None:
        self._closing = True
        self._kill()
        self._worker.close(wait=True)
        self._end()


class PolicyWorkers:
    """Processes in which policies load and act.

    A policy is loaded in a process without other seats, if there is one. The last such process is kept for policies
    that no process knows yet.

    - `loader`: loads a policy by its name, for a game and a control system; processes import it.
    - `processes`: at most; each is started when first needed.
    - `limit_s`: seconds that an answer may take.
    """

    def __init__(self, loader: Loader, processes: int = MOST_PROCESSES, limit_s: float = 2.0) -> None:
        self._processes = [_Process(loader) for _ in range(processes)]
        self._places: dict[Hashable, _Process] = {}
        self._playing: set[Hashable] = set()
        self._limit_s = limit_s

    def _place(self, seat: PolicySeat) -> _Process:
        """Return a seat's process, which its first question chooses."""
        if seat.key not in self._places:
            seats = Counter(self._places.values())
            players = Counter(self._places[key] for key in self._playing)
            free = [process for process in self._processes if not seats[process]]
            knowing = [process for process in self._processes if seat.policy in process.known]
            choices = knowing if knowing and len(free) <= 1 else free or self._processes
            self._places[seat.key] = min(
                choices, key=lambda p: (players[p], seats[p], seat.policy not in p.known, not p.is_started)
            )
        return self._places[seat.key]

    async def load(self, seat: PolicySeat) -> None:
        """Load a policy for its seat, and ask it once.

        Raises PolicyError if it cannot be loaded, raises, or answers invalidly.
        """
        await self._place(seat).ask(_Question(seat=seat))

    async def ask(self, seat: PolicySeat, games: Games, seed: Seed, *, begins: bool = False) -> Answer:
        """Return a policy's answer to a snapshot of its game; if the game `begins`, `seed` starts its random stream.

        Raises PolicyError if the policy cannot be loaded, raises, or answers invalidly or too late.
        """
        process = self._place(seat)
        self._playing.add(seat.key)
        question = _Question(seat=seat, games=games, seed=seed, begins=begins, limit_s=self._limit_s)
        answer = await process.ask(question)
        assert answer is not None  # noqa: S101
        return answer

    def pause(self, seat: PolicySeat) -> None:
        """Note that a seat's game is over; its policy stays loaded for the next one."""
        self._playing.discard(seat.key)

    def forget(self, seat: PolicySeat) -> None:
        """Unload a seat's policy."""
        self._playing.discard(seat.key)
        if (process := self._places.pop(seat.key, None)) is not None:
            process.forget(seat, was_alone=process not in self._places.values())

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.close()


async def _fault_of(work: Coroutine[Any, Any, None], unexpected: str) -> str:
    """Await work, and return the reason why it failed; empty if it did not."""
    try:
        await work
    except SwarmError as error:
        return str(error)[:500]
    except Exception:
        log.exception("a policy was not loaded or asked")
        return unexpected
    return ""


class SeatPolicy:
    """Loads a policy, calls `changed` then, and asks it when it is free; no game waits for either.

    - `reason`: why it could not be loaded.
    """

    def __init__(self, place: PolicySeat, workers: PolicyWorkers, changed: Callable[[], None]) -> None:
        self.place, self._workers = place, workers
        self.state: Literal["loading", "loaded", "failed"] = "loading"
        self.reason = ""
        self._plays = False
        self._question: asyncio.Task[None] | None = None
        self._loading = asyncio.create_task(self._load(changed))

    async def _load(self, changed: Callable[[], None]) -> None:
        self.reason = await _fault_of(self._workers.load(self.place), "it could not be loaded")
        self.state = "failed" if self.reason else "loaded"
        changed()

    def ask(
        self, simulator: Simulator, seed: Seed, answered: Callable[[Answer], None], failed: Callable[[str], None]
    ) -> None:
        """Ask the policy, unless it is busy; the first question of a game starts its random stream."""
        if self._question is not None and not self._question.done():
            return
        games, begins, self._plays = simulator.snapshot(), not self._plays, True

        async def ask() -> None:
            answered(await self._workers.ask(self.place, games, seed, begins=begins))

        async def watch() -> None:
            if reason := await _fault_of(ask(), "it could not be asked"):
                failed(reason)

        self._question = asyncio.create_task(watch())

    async def wait(self) -> None:
        """Wait until it has answered or failed."""
        if self._question is not None:
            await self._question

    def rest(self) -> None:
        """End its game; later answers are dropped."""
        self._plays = False
        self._drop_question()
        self._workers.pause(self.place)

    def _drop_question(self) -> None:
        if self._question is not None:
            self._question.cancel()
        self._question = None

    def close(self) -> None:
        """Unload the policy."""
        self._loading.cancel()
        self._drop_question()
        self._workers.forget(self.place)
