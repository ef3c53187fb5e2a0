"""A game in real time: its countdown, its clock, what it shows, and its recording.

Everything here runs on the event loop's thread and never waits for a policy or a client.
"""

from __future__ import annotations

import asyncio
import datetime
import importlib.metadata
import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from swarm_pz.config import BLUE, RED, TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import FlightError
from swarm_pz.play.commands import Command
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.format import (
    FRAME_TICKS,
    VERSION,
    EndedBy,
    Header,
    Outcome,
    RecordedSeat,
    SeatDelays,
    SeatLine,
    reason_of_end,
)
from swarm_pz.play.recordings.moment import Moment
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.server.delays import Measured
from swarm_pz.play.server.game_clock import GameClock
from swarm_pz.play.server.game_log import GameLog
from swarm_pz.play.server.incoming_commands import IncomingCommands
from swarm_pz.play.server.pilot import Pilot
from swarm_pz.play.server.policy_workers import PolicySeat
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.server.thinkers import Thinkers
from swarm_pz.play.server.views import frame_of

_FIELD_TICKS = 3
"""Ticks between two frames that show capture fields."""
_HELD_S = 0.1
"""Seconds between two looks whether a game that is held goes on."""
_LOOK_TICKS = 6
"""Ticks between two looks at the conditions of automatic responses."""
log = logging.getLogger("swarm_pz.play")
_SOFTWARE = f"swarm-pz {importlib.metadata.version('swarm-pz')}"


@dataclass(frozen=True, kw_only=True)
class Callbacks:
    """Whom a session tells what.

    Attributes
    ----------
    began : callable
        The clock runs, and the recording with it.
    refused : callable
        Why the game cannot begin after all; it is to be called off.
    is_seen : callable
        Whether the game goes on; else it is held.
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
    refused: Callable[[str], None]
    is_seen: Callable[[], bool]
    show: Callable[[bytes, int], None]
    look: Callable[[], None]
    in_force: Callable[[Command, int], None]
    failed: Callable[[int, str], None]
    notice: Callable[[str], None]
    over: Callable[[Outcome, EndedBy], None]


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
    log : GameLog
    recorder : Recorder
        Its file's.
    commands : IncomingCommands
    sizes : list of (int, int)
        Drones of red and blue, once a second since the start.
    starts_ms : float
        When the countdown is over, on the server's clock.
    forfeit : str
        How a control system failed, so that its side lost; empty if none did.
    display_measured : (Measured, Measured)
        How much later red and blue are shown moments than they were made, which is for who shows them to note.
    ended : bool
        Nothing comes after this.
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
        self.config, self._context, self._tell = config, context, tell
        self.game = moment.game if moment is not None else LiveGame(config, seed)
        self.sizes = moment.sizes if moment is not None else [self.game.sizes]
        self.starts_ms = context.now_ms() + 1000.0 * context.countdown_s
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
        self.log = GameLog(self.recorder, self.game, seats, context.now_ms, self.starts_ms, context.markers)
        first, second = config.game.team_systems
        self._pilot = None if first.kernel and second.kernel else Pilot(config.game)
        self.forfeit = ""
        red, blue = config.factors
        self.commands = IncomingCommands(self.game, config.factors, self.log, context.now_ms)
        self.display_measured = Measured(red.display_delay_ms), Measured(blue.display_delay_ms)
        answered = self.commands.take_answer
        self._thinkers = Thinkers(self.game, seed, policies, context.workers, answered, tell.failed)
        self._first_tick = self.game.tick
        self._sequence = 0
        self.ended = False
        if moment is None:
            self.log.frame(self._frame())
        else:
            for line in moment.past:
                self.recorder.write(line)
        self._clock = asyncio.create_task(self._run())

    @property
    def has_begun(self) -> bool:
        """Whether the clock runs, or ran."""
        return self.log.has_begun

    def delays(self) -> list[dict[str, dict[str, float | None]]]:
        """Return the delays of red and of blue so far: of commands and display, what was asked for and what was got."""
        return [msgspec.to_builtins(delays) for delays in self._delays()]

    def _delays(self) -> tuple[SeatDelays, SeatDelays]:
        red, blue = (
            SeatDelays(command=commands.told(), display=display.told())
            for commands, display in zip(self.commands.measured, self.display_measured, strict=True)
        )
        return red, blue

    # --- its end ----------------------------------------------------------------------------------

    def call_off(self) -> None:
        """Take back a game that has not begun, and so has no file."""
        self._halt()
        self.commands.drop()
        self.game.withdraw()

    def _halt(self) -> None:
        self.ended = True
        if asyncio.current_task() is not self._clock:
            self._clock.cancel()
        self._thinkers.stop()
        if self._pilot is not None:
            self._pilot.close()

    def stop(self, outcome: Outcome = "stopped", ended_by: EndedBy | None = None) -> None:
        """End the game and finish its file; unless said, what ended it follows from the outcome and who was there."""
        if self.ended:
            return
        self._halt()
        reason = ended_by or reason_of_end(outcome, self.log.is_somebody_away)
        self.commands.end()
        self.log.end(outcome, reason, self._delays() if self.config.varies else None)
        self._tell.over(outcome, reason)

    def _lose(self, error: FlightError) -> None:
        """End a game of which a side has nobody who flies it: the other one has won."""
        if not self.has_begun and not self._begin():
            return
        self.forfeit = str(error)[:500]
        self.log.note(SeatLine(team=error.team, event="forfeit", ms=self.log.now_ms, reason=self.forfeit))
        self._tell.notice(f"{TEAM_NAMES[error.team]} forfeits this game: {self.forfeit}")
        self.stop("blue" if error.team == RED else "red", "forfeit")

    # --- time -------------------------------------------------------------------------------------

    async def _run(self) -> None:
        try:
            self._thinkers.ask()
            await asyncio.gather(asyncio.sleep(self._context.countdown_s), self._thinkers.answers(), self._try_out())
            if not self._begin():
                return
            clock = GameClock(self.config.speed, self._context.punctuality)
            while not self.game.over:
                while not self._tell.is_seen():
                    await asyncio.sleep(_HELD_S)
                    clock = GameClock(self.config.speed, self._context.punctuality)
                for _ in range(await clock.due()):
                    if not self.game.over:
                        await self._tick()
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

    def _begin(self) -> bool:
        """Let the clock run, and tell whether it does: a game that cannot be written down does not begin."""
        try:
            self.log.begin()
        except OSError as error:
            self._tell.refused(f"the game cannot be recorded: {error.strerror}")
            return False
        self._tell.began()
        return True

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
                self.log.captured(event)
        if game.tick % TICKS_PER_SECOND == 0:
            self.sizes.append(game.sizes)
        self._tell.show(self.frame(), self._sequence)
        if game.tick % FRAME_TICKS == 0 or game.over:
            self.log.frame(self._frame())
        if fault := self.log.flush():
            self._tell.notice(fault)

    async def _fly(self, pilot: Pilot) -> None:
        """Wait for control systems that fly in a thread; other games go on meanwhile."""
        with self.log.holding():
            for team in (RED, BLUE):
                await pilot.fly(self.game, team)

    def _note_in_force(self, event: InForce) -> None:
        self.log.in_force(event)
        self._tell.in_force(event.command, event.tick)

    # --- what is seen -----------------------------------------------------------------------------

    def frame(self, keyframe: bool = False) -> bytes:
        """Return the present moment; a keyframe holds all that a client can be shown."""
        self._sequence += 1
        fields = keyframe or self.game.tick % _FIELD_TICKS == 0 or self.game.over
        return self._frame(altitudes=keyframe, fields=fields)

    def _frame(self, *, altitudes: bool = False, fields: bool = False) -> bytes:
        simulator, now = self.game.simulator, self._context.now_ms()
        return frame_of(simulator, self._sequence, now, altitudes=altitudes, fields=fields)
