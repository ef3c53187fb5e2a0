"""A game in real time: its clock, what it shows, and its recording.

Everything here runs on the event loop's thread and never waits for a policy or a client.
"""

from __future__ import annotations

import asyncio
import datetime
import importlib.metadata
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import SwarmError
from swarm_pz.play.game import Captured, Command, InForce, LiveGame, TableConfig
from swarm_pz.play.protocol import StrokeMessage, Timing
from swarm_pz.play.recordings.format import (
    FRAME_TICKS,
    SUFFIX,
    VERSION,
    CapturedLine,
    CommandLine,
    EndLine,
    EventLine,
    Header,
    InForceLine,
    Origin,
    RecordedSeat,
    Recorder,
    frame_line,
)
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.play.server.views import frame_of

Outcome = Literal["red", "blue", "draw", "stopped"]
_FIELD_TICKS = 3
"""Ticks between two frames that show capture fields."""
_FLUSH_TICKS = 15
_CATCH_UP = 2
"""Ticks that a late game makes up for at once; beyond that its time slips."""
log = logging.getLogger("swarm_pz.play")
_SOFTWARE = f"swarm-pz {importlib.metadata.version('swarm-pz')}"


@dataclass
class Punctuality:
    """How late the ticks of all games were, of late."""

    lateness_ms: deque[float] = field(default_factory=lambda: deque(maxlen=200_000))
    most_caught_up: int = 0
    slipped: int = 0
    """How often a game's time had to slip."""


@dataclass(frozen=True, kw_only=True)
class ServerContext:
    """What all games of a server share."""

    folder: Path
    workers: PolicyWorkers
    table: TableConfig = field(default_factory=TableConfig)
    """What rooms start from; their settings replace parts of it."""
    record_labels: bool = True
    """Whether recordings hold the players' labels; else only those at the table see them."""
    punctuality: Punctuality = field(default_factory=Punctuality)
    began: float = field(default_factory=time.monotonic)

    def now_ms(self) -> float:
        """Return the server's clock."""
        return 1000.0 * (time.monotonic() - self.began)


@dataclass(frozen=True, kw_only=True)
class Moment:
    """A moment of a recorded game.

    Attributes
    ----------
    game : LiveGame
        At that moment.
    seed : int
        Of its start.
    sizes : list of (int, int)
        Drones of red and blue, once a second since the start.
    origin : Origin
        Where it is from.
    past : list
        The lines of the recording up to there.
    """

    game: LiveGame
    seed: int
    sizes: list[tuple[int, int]]
    origin: Origin
    past: list[EventLine]


@dataclass(frozen=True, kw_only=True)
class Callbacks:
    """Whom a session tells what.

    Attributes
    ----------
    show : callable
        Every frame and its number, 30 times a second of game.
    in_force : callable
        A team, the number of its command that is in force now, and the tick.
    failed : callable
        The team of a policy that failed, and why.
    notice : callable
        What everybody should know.
    over : callable
        The outcome; nothing comes after it.
    """

    show: Callable[[bytes, int], None]
    in_force: Callable[[int, int, int], None]
    failed: Callable[[int, str], None]
    notice: Callable[[str], None]
    over: Callable[[Outcome], None]


class LiveSession:
    """A game that runs by the clock from when it is made.

    Parameters
    ----------
    name : str
        What no other session has; its recording is called so.
    config : TableConfig
    seed : int
    seats : (RecordedSeat, RecordedSeat)
        Who plays.
    context : ServerContext
    tell : Callbacks
    moment : Moment, optional
        Of a recorded game, to go on from; its start and rules are this game's, then.

    Attributes
    ----------
    game : LiveGame
    recorder : Recorder
    sizes : list of (int, int)
        Drones of red and blue, once a second since the start.
    """

    def __init__(
        self,
        name: str,
        config: TableConfig,
        seed: int,
        seats: tuple[RecordedSeat, RecordedSeat],
        context: ServerContext,
        tell: Callbacks,
        moment: Moment | None = None,
    ) -> None:
        self.config, self.seats, self._context, self._tell = config, seats, context, tell
        self.game = moment.game if moment is not None else LiveGame(config, seed)
        self.sizes = moment.sizes if moment is not None else [self.game.sizes]
        self._began_ms = context.now_ms()
        started = datetime.datetime.now(datetime.UTC)
        header = Header(
            version=VERSION,
            software=_SOFTWARE,
            started=started.isoformat(timespec="milliseconds"),
            table=config.to_dict(),
            config_hash=config.hash,
            seed=seed,
            red=seats[0],
            blue=seats[1],
            origin=moment.origin if moment is not None else None,
            rules_hash=config.game.rules_hash,
        )
        self.recorder = Recorder(context.folder / f"{started:%Y%m%dT%H%M%SZ}-{name}{SUFFIX}", header)
        self._thinking: list[asyncio.Task[None] | None] = [None, None]
        self._places = [
            PolicySeat(
                key=(name, team),
                policy=seat.policy,
                game=config.game,
                team=team,
                seed=np.random.SeedSequence(seed, spawn_key=(team,)),  # neither the other's nor the start's
            )
            for team, seat in enumerate(seats)
        ]
        self._numbers = [0, 0]
        self._sequence = 0
        self._ended = False
        if moment is None:
            self.recorder.write(frame_line(self._frame(), 0))
        else:
            for line in moment.past:
                self.recorder.write(line)
        self._clock = asyncio.create_task(self._run())

    @property
    def now_ms(self) -> float:
        """Milliseconds since the game began, on the server's clock."""
        return self._context.now_ms() - self._began_ms

    def since_began(self, server_ms: float) -> float:
        """Return a time of the server's clock as milliseconds since the game began."""
        return server_ms - self._began_ms

    def submit(
        self,
        team: int,
        number: int,
        density: ArrayLike,
        strokes: list[StrokeMessage] | None = None,
        timing: Timing | None = None,
    ) -> Command:
        """Hand in a command and write it down.

        Raises
        ------
        CommandError
            If it is not valid; the game goes on with what it had.
        """
        command = self.game.submit(team, number, density)
        self._write_down(command, strokes, timing)
        return command

    def _write_down(
        self, command: Command, strokes: list[StrokeMessage] | None = None, timing: Timing | None = None
    ) -> None:
        self.recorder.write(
            CommandLine(
                team=command.team,
                number=command.number,
                density=command.density.tolist(),
                received_ms=self.now_ms,
                strokes=strokes,
                timing=timing,
            )
        )

    def stop(self, outcome: Outcome = "stopped") -> None:
        """End the game and finish its file."""
        if self._ended:
            return
        self._ended = True
        if asyncio.current_task() is not self._clock:
            self._clock.cancel()
        for task, place in zip(self._thinking, self._places, strict=True):
            if task is not None:
                task.cancel()
            self._context.workers.forget(place)
        self.recorder.write(EndLine(outcome=outcome, tick=self.game.tick, sizes=self.game.sizes, ms=self.now_ms))
        self.recorder.close()
        self._tell.over(outcome)

    # --- time -------------------------------------------------------------------------------------

    async def _run(self) -> None:
        loop, punctuality = asyncio.get_running_loop(), self._context.punctuality
        period = 1.0 / (TICKS_PER_SECOND * self.config.speed)
        due = loop.time()
        try:
            while not self.game.over:
                due += period
                await asyncio.sleep(max(due - loop.time(), 0.0))
                late = max(loop.time() - due, 0.0)
                ticks = 1 + min(int(late / period), _CATCH_UP - 1)
                punctuality.lateness_ms.append(1000.0 * late)
                punctuality.most_caught_up = max(punctuality.most_caught_up, ticks)
                due += (ticks - 1) * period
                if late > _CATCH_UP * period:
                    due = loop.time()
                    punctuality.slipped += 1
                for _ in range(ticks):
                    if not self.game.over:
                        self._tick()
        except Exception:
            log.exception("a game was stopped")
            self._tell.notice("this game was stopped by a fault of the server")
            self.stop()
            return
        self.stop("red" if self.game.outcome == "red" else "blue" if self.game.outcome == "blue" else "draw")

    def _tick(self) -> None:
        game = self.game
        if game.tick % self.config.game.step_ticks == 0:
            for team, seat in enumerate(self.seats):
                task = self._thinking[team]
                if seat.kind == "policy" and (task is None or task.done()):
                    self._thinking[team] = asyncio.create_task(self._think(team))
        for event in game.advance():
            if isinstance(event, Captured):
                self.recorder.write(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))
            else:
                self._note_in_force(event)
        if game.tick % TICKS_PER_SECOND == 0:
            self.sizes.append(game.sizes)
        self._tell.show(self.frame(), self._sequence)
        if game.tick % FRAME_TICKS == 0 or game.over:
            self.recorder.write(frame_line(self._frame(), game.tick))
        if game.tick % _FLUSH_TICKS == 0:
            self.recorder.flush()
            if self.recorder.fault:
                self._tell.notice(self.recorder.fault)
                self.recorder.fault = ""

    async def _think(self, team: int) -> None:
        try:
            density = await self._context.workers.ask(self._places[team], self.game.simulator.snapshot())
            if not self._ended:
                self._numbers[team] += 1
                self._write_down(self.game.submit_checked(team, self._numbers[team], density))
        except SwarmError as error:
            self._tell.failed(team, str(error))
        except Exception:
            log.exception("a policy was not asked")
            self._tell.failed(team, "it could not be asked")

    def _note_in_force(self, event: InForce) -> None:
        team, number = event.command.team, event.command.number
        self.recorder.write(InForceLine(team=team, number=number, tick=event.tick, ms=self.now_ms))
        self._tell.in_force(team, number, event.tick)

    # --- what is seen -----------------------------------------------------------------------------

    def frame(self, keyframe: bool = False) -> bytes:
        """Return the present moment; a keyframe holds all that a client can be shown."""
        self._sequence += 1
        fields = keyframe or self.game.tick % _FIELD_TICKS == 0 or self.game.over
        return self._frame(altitudes=keyframe, fields=fields)

    def _frame(self, *, altitudes: bool = False, fields: bool = False) -> bytes:
        simulator, now = self.game.simulator, self._context.now_ms()
        return frame_of(simulator, self._sequence, now, altitudes=altitudes, fields=fields)
