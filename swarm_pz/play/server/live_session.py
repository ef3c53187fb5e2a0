"""A game in real time: its countdown, its clock, what it shows, and its recording.

Everything here runs on the event loop's thread and never waits for a policy or a client.
"""

from __future__ import annotations

import asyncio
import contextlib
import datetime
import functools
import importlib.metadata
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import FlightError
from swarm_pz.play.commands import Command
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.lsl import Markers
from swarm_pz.play.protocol import StrokeMessage, Timing
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.format import (
    FRAME_TICKS,
    VERSION,
    CapturedLine,
    CommandLine,
    EndedBy,
    EndLine,
    EventLine,
    Header,
    InForceLine,
    Origin,
    Outcome,
    RecordedSeat,
    SeatDelays,
    SeatLine,
    frame_line,
    reason_of_end,
)
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.server.delays import DelayLine, Measured
from swarm_pz.play.server.games_folder import SeatIndex
from swarm_pz.play.server.pilot import Pilot
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers
from swarm_pz.play.server.thinkers import Thinkers
from swarm_pz.play.server.views import frame_of
from swarm_pz.play.shared import SharedCommand

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown before the clock begins: time to find one's drones and to draw, and more than
a policy may take for a command."""
_FIELD_TICKS = 3
"""Ticks between two frames that show capture fields."""
_FLUSH_TICKS = 15
_LOOK_TICKS = 6
"""Ticks between two looks at the conditions of automatic responses."""
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
    countdown_s: float = COUNTDOWN_S
    record_labels: bool = True
    """Whether recordings hold the players' labels; else only those at the table see them."""
    markers: Markers | None = None
    """Where moments of games are told to who records other signals, too."""
    punctuality: Punctuality = field(default_factory=Punctuality)
    began: float = field(default_factory=time.monotonic)

    @cached_property
    def seat_index(self) -> SeatIndex:
        """Which recordings seats' tokens lead to."""
        return SeatIndex(self.folder)

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
    began : callable
        The clock runs, and the recording with it.
    show : callable
        Every frame and its number, 30 times a second of game.
    look : callable
        It is time to look whether automatic responses act, five times a second of game.
    in_force : callable
        A command that is in force now, and the tick.
    failed : callable
        The team of a policy that failed, and why.
    notice : callable
        What everybody should know.
    over : callable
        The outcome, and what ended the game; nothing comes after it.
    """

    began: Callable[[], None]
    show: Callable[[bytes, int], None]
    look: Callable[[], None]
    in_force: Callable[[Command, int], None]
    failed: Callable[[int, str], None]
    notice: Callable[[str], None]
    over: Callable[[Outcome, EndedBy], None]


class _Given(NamedTuple):
    """A command on its way into the game, and when it arrived, on the server's clock."""

    command: Command
    received_ms: float
    strokes: list[StrokeMessage] | None = None
    timing: Timing | None = None
    unless_held: bool = False
    """It is not handed in if it holds already."""


class LiveSession:
    """A game that counts down from when it is made, and then runs by the clock.

    Commands count from the countdown on, and policies are asked for their first ones in it: those come into force
    at the first tick, which is played when the countdown is over and every policy has answered or failed to.

    Parameters
    ----------
    name : str
        What no other session has; its recording is called so.
    config : TableConfig
    seed : int
    seats : (RecordedSeat, RecordedSeat)
        Who plays.
    policies : (PolicySeat or None, PolicySeat or None)
        Where the policies among them are loaded, or a player's helper.
    context : ServerContext
    tell : Callbacks
    moment : Moment, optional
        Of a recorded game, to go on from; its start and rules are this game's, then.
    lesson : bool
        It is a lesson, not a match.
    path : Path, optional
        Of its recording, in place of one of its name.

    Attributes
    ----------
    game : LiveGame
    recorder : Recorder
    sizes : list of (int, int)
        Drones of red and blue, once a second since the start.
    starts_ms : float
        When the countdown is over, on the server's clock.
    has_begun : bool
        Whether the clock runs, or ran.
    sent : list of int
        Ticks at which red's and blue's players last sent a command; of the start, if they have not.
    forfeit : str
        How a control system failed, so that its side lost; empty if none did.
    commands_measured, display_measured : (Measured, Measured)
        How much later red's and blue's commands were handed in than they came; and moments shown than they were made,
        which is for who shows them to note.
    """

    def __init__(
        self,
        name: str,
        config: TableConfig,
        seed: int,
        seats: tuple[RecordedSeat, RecordedSeat],
        policies: tuple[PolicySeat | None, PolicySeat | None],
        context: ServerContext,
        tell: Callbacks,
        moment: Moment | None = None,
        lesson: bool = False,
        path: Path | None = None,
    ) -> None:
        self.config, self._context, self._tell, self._seats = config, context, tell, seats
        self.game = moment.game if moment is not None else LiveGame(config, seed)
        self.sizes = moment.sizes if moment is not None else [self.game.sizes]
        self.starts_ms = self._began_ms = context.now_ms() + 1000.0 * context.countdown_s
        self.has_begun = False
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
            lesson=lesson,
        )
        self.recorder = Recorder(path or context.folder / f"{started:%Y%m%dT%H%M%SZ}-{name}{SUFFIX}", header)
        first, second = config.game.team_systems
        self._pilot = None if first.kernel and second.kernel else Pilot(config.game)
        self._is_flying = False
        self.sent = [self.game.tick, self.game.tick]
        self.forfeit = ""
        factors = config.factors
        self.commands_measured = Measured(factors[RED].command_delay_ms), Measured(factors[BLUE].command_delay_ms)
        self.display_measured = Measured(factors[RED].display_delay_ms), Measured(factors[BLUE].display_delay_ms)
        self._lines = [DelayLine(own.command_delay_ms) for own in factors]
        """By which commands come to the game."""
        cells = self.game.reader.cells
        self._shared = [
            SharedCommand(team, cells, own.share, own.helper) if own.share > 0.0 else None
            for team, own in enumerate(factors)
        ]
        self._held: list[CommandLine] = []
        """What arrives while control systems choose accelerations: it counts from the next solve on."""
        self._early: list[CommandLine | SeatLine] = []
        """What came in the countdown; its times count from when that should have been over."""
        self._thinkers = Thinkers(self.game, seed, policies, context.workers, self.take_answer, tell.failed)
        self._first_tick = self.game.tick
        self._sequence = 0
        self._ended = False
        self._away: set[int] = set()
        if moment is None:
            self.recorder.write(frame_line(self._frame(), 0))
        else:
            for line in moment.past:
                self.recorder.write(line)
        self._clock = asyncio.create_task(self._run())

    @property
    def now_ms(self) -> float:
        """Milliseconds since the game began, on the server's clock; negative in the countdown."""
        return self._context.now_ms() - self._began_ms

    def since_began(self, server_ms: float) -> float:
        """Return a time of the server's clock as milliseconds since the game began."""
        return server_ms - self._began_ms

    def submit(
        self, command: Command, strokes: list[StrokeMessage] | None = None, timing: Timing | None = None
    ) -> None:
        """Hand in a command that was read, and write it down; with its helper's share, and later, where that is so."""
        if not command.sender:
            self.sent[command.team] = self.game.tick
        now, shared = self._context.now_ms(), self._shared[command.team]
        given = [_Given(command, now, strokes, timing)]
        if shared is not None and (mixed := shared.take(command)) is not None:
            given.append(_Given(mixed, now))  # at once after it, and so in its place
        self._give(command.team, given)

    def _give(self, team: int, given: list[_Given]) -> None:
        """Let commands of a team come to the game, together, when its delay is over."""
        self._lines[team].put(functools.partial(self._hand_in, given), self.commands_measured[team])

    def _hand_in(self, given: list[_Given]) -> None:
        for one in given:
            if not (one.unless_held and self.game.holds(one.command)):
                self.game.hand_in(one.command)
                self._write_command(one)

    def _write_command(self, given: _Given) -> None:
        command, received_ms, strokes, timing, _ = given
        plain, is_density = command.values.tolist(), command.kind == "density"
        self._write(
            CommandLine(
                team=command.team,
                number=command.number,
                density=plain if is_density else None,
                received_ms=self.since_began(received_ms),
                strokes=strokes,
                timing=timing,
                tick=self.game.tick,
                command=None if is_density else plain,
                sender=command.sender,
            )
        )

    def take_answer(self, team: int, number: int, answer: NDArray[np.float64], sender: str = "") -> None:
        """Hand in a policy's answer, in the form that all commands have among others, unless that holds already.

        A helper's becomes its share of the command.
        """
        command = self.game.reader.answered(team, number, answer, sender)
        shared, now = self._shared[team], self._context.now_ms()
        if shared is None:
            self._give(team, [_Given(command, now, unless_held=True)])
        elif (mixed := shared.be_helped(command.values)) is not None:
            self._give(team, [_Given(mixed, now)])

    def delays(self) -> list[dict[str, dict[str, float | None]]]:
        """Return the delays of red and of blue so far: of commands and display, what was asked for and what was got."""
        return [msgspec.to_builtins(delays) for delays in self._delays()]

    def _delays(self) -> tuple[SeatDelays, SeatDelays]:
        red, blue = (
            SeatDelays(command=commands.told(), display=display.told())
            for commands, display in zip(self.commands_measured, self.display_measured, strict=True)
        )
        return red, blue

    def note(self, line: SeatLine) -> None:
        """Write down what became of a seat's connection."""
        if line.event == "disconnected":
            self._away.add(line.team)
        elif line.event == "connected":
            self._away.discard(line.team)
        self._write(line)

    def _write(self, line: CommandLine | SeatLine) -> None:
        """Write down what somebody did; what was done in the countdown, once the game has begun."""
        if not self.has_begun:
            self._early.append(line)
        elif self._is_flying and isinstance(line, CommandLine):
            line.tick = self.game.tick + 1
            self._held.append(line)
        else:
            self.recorder.write(line)

    def call_off(self) -> None:
        """Take back a game that has not begun, and its file: nothing of it was played."""
        self._halt()
        for line in self._lines:
            line.close()
        self.game.withdraw()
        self.recorder.close()
        with contextlib.suppress(OSError):
            self.recorder.path.unlink()

    def _halt(self) -> None:
        self._ended = True
        if asyncio.current_task() is not self._clock:
            self._clock.cancel()
        self._thinkers.stop()
        if self._pilot is not None:
            self._pilot.close()

    @property
    def ended(self) -> bool:
        """Whether nothing comes after this."""
        return self._ended

    def stop(self, outcome: Outcome = "stopped", ended_by: EndedBy | None = None) -> None:
        """End the game and finish its file; unless said, what ended it follows from the outcome and who was there."""
        if self._ended:
            return
        self._halt()
        reason = ended_by or reason_of_end(outcome, bool(self._away))
        self._write_delayed()
        self._note_clock()
        self._mark(
            EndLine(
                outcome=outcome,
                tick=self.game.tick,
                sizes=self.game.sizes,
                ms=self.now_ms,
                ended_by=reason,
                delays=self._delays() if self.config.varies else None,
            )
        )
        self.recorder.close()
        self._tell.over(outcome, reason)

    def _write_delayed(self) -> None:
        """Write down the commands that the end came before; within a solve they are of a tick that is not played."""
        left = [act for line in self._lines for act in line.close()]
        if not self.game.has_begun_period:
            for hand_in in left:
                hand_in()

    # --- time -------------------------------------------------------------------------------------

    async def _run(self) -> None:
        try:
            self._thinkers.ask()
            await asyncio.gather(asyncio.sleep(self._context.countdown_s), self._thinkers.answers(), self._try_out())
            self._begin()
            await self._play()
        except FlightError as error:
            self._lose(error)
            return
        except Exception:
            log.exception("a game was stopped")
            self._tell.notice("this game was stopped by a fault of the server")
            self.stop(ended_by="server")
            return
        self.stop("red" if self.game.outcome == "red" else "blue" if self.game.outcome == "blue" else "draw")

    async def _try_out(self) -> None:
        if self._pilot is not None:
            await self._pilot.try_out()

    def _lose(self, error: FlightError) -> None:
        """End a game of which a side has nobody who flies it: the other one has won."""
        if not self.has_begun:
            self._begin()
        self.forfeit = str(error)[:500]
        self.note(SeatLine(team=error.team, event="forfeit", ms=self.now_ms, reason=self.forfeit))
        self._tell.notice(f"{TEAM_NAMES[error.team]} forfeits this game: {self.forfeit}")
        self.stop("blue" if error.team == RED else "red", "forfeit")

    def _begin(self) -> None:
        planned, self._began_ms = self._began_ms, self._context.now_ms()
        self.has_begun = True
        for line in self._early:
            if isinstance(line, CommandLine):
                line.received_ms -= self._began_ms - planned
            else:
                line.ms -= self._began_ms - planned
            self.recorder.write(line)
        self._early.clear()
        self._note_clock()
        if self._context.markers is not None:
            self._context.markers.start(self.recorder.path.stem, self.game.tick, *self._seats)
        self._tell.began()

    async def _play(self) -> None:
        loop, punctuality = asyncio.get_running_loop(), self._context.punctuality
        period = 1.0 / (TICKS_PER_SECOND * self.config.speed)
        due = loop.time()
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
                    await self._tick()

    async def _tick(self) -> None:
        game = self.game
        if game.tick % self.config.game.step_ticks == 0 and game.tick > self._first_tick:
            self._thinkers.ask()
        if game.tick % _LOOK_TICKS == 0:
            self._tell.look()
        for began in game.begin_period():
            self._note_in_force(began)
        if self._pilot is not None and game.is_at_solve:
            await self._fly(self._pilot)
        for event in game.advance():
            if isinstance(event, Captured):
                self._mark(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))
        if game.tick % TICKS_PER_SECOND == 0:
            self.sizes.append(game.sizes)
        self._tell.show(self.frame(), self._sequence)
        if game.tick % FRAME_TICKS == 0 or game.over:
            self.recorder.write(frame_line(self._frame(), game.tick))
        if game.tick % _FLUSH_TICKS == 0 or self.recorder.is_behind:
            self.recorder.flush()
            if self.recorder.fault:
                self._tell.notice(self.recorder.fault)
                self.recorder.fault = ""

    async def _fly(self, pilot: Pilot) -> None:
        """Wait for control systems that fly in a thread; other games go on meanwhile."""
        self._is_flying = True
        try:
            for team in (RED, BLUE):
                await pilot.fly(self.game, team)
        finally:
            self._is_flying = False
        for line in self._held:
            self.recorder.write(line)
        self._held.clear()

    def _note_in_force(self, event: InForce) -> None:
        command = event.command
        self._mark(
            InForceLine(
                team=command.team, number=command.number, tick=event.tick, ms=self.now_ms, sender=command.sender
            )
        )
        self._tell.in_force(command, event.tick)

    def _mark(self, line: InForceLine | CapturedLine | EndLine) -> None:
        """Write down what happened, and tell it to who records other signals, too."""
        self.recorder.write(line)
        if self._context.markers is not None and self.has_begun:
            self._context.markers.note(self.recorder.path.stem, line)

    def _note_clock(self) -> None:
        if self._context.markers is not None and self.has_begun:
            self.recorder.write(self._context.markers.clock(lambda: self.now_ms))

    # --- what is seen -----------------------------------------------------------------------------

    def frame(self, keyframe: bool = False) -> bytes:
        """Return the present moment; a keyframe holds all that a client can be shown."""
        self._sequence += 1
        fields = keyframe or self.game.tick % _FIELD_TICKS == 0 or self.game.over
        return self._frame(altitudes=keyframe, fields=fields)

    def _frame(self, *, altitudes: bool = False, fields: bool = False) -> bytes:
        simulator, now = self.game.simulator, self._context.now_ms()
        return frame_of(simulator, self._sequence, now, altitudes=altitudes, fields=fields)
