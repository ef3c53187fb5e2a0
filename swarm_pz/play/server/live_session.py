"""A game in real time: its countdown, its clock, its frames, its recording.

Everything here runs on the event loop's thread and never waits for a policy or a client.
"""

from __future__ import annotations

import asyncio
import datetime
import functools
import importlib.metadata
import itertools
import logging
from collections.abc import Callable, Sequence

import numpy as np

from swarm_pz.config import RED, TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, GameConfig
from swarm_pz.errors import FlightError
from swarm_pz.play import protocol
from swarm_pz.play.game import Captured, InForce, LiveGame
from swarm_pz.play.protocol import SIDES, EndedBy, Header, Outcome, SeatDelays, SeatEvent, SeatMessage
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.recordings.recording import FRAME_TICKS, reason_of_end
from swarm_pz.play.server.audience import Audience
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.delays import Measured
from swarm_pz.play.server.game_log import GameLog
from swarm_pz.play.server.incoming_commands import IncomingCommands
from swarm_pz.play.server.policy_workers import Answer, SeatPolicy
from swarm_pz.play.server.rendered_command import target_of
from swarm_pz.play.server.room_settings import RoomPlan
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.server_context import GameClock, ServerContext
from swarm_pz.play.server.views import frame_of
from swarm_pz.play.server.worker import Worker
from swarm_pz.simulator import Simulator

_FIELD_TICKS = 3
"""Ticks between two frames with capture fields."""
HELD_S = 0.1
"""Seconds between two checks whether a paused or unseen game can go on."""
SOLVE_S = 2.0
"""Seconds that one solve may take; the simulator checks that solves keep up on average."""
TRIAL_S = 120.0
"""Seconds for a solve before the game begins, since it may compile something."""
_TRIAL_PERIODS = 2
_SOFTWARE = f"swarm-pz {importlib.metadata.version('swarm-pz')}"
log = logging.getLogger("swarm_pz.play")


class ControlThread:
    """A thread for one game's control systems in Python; if it hangs, other games go on."""

    def __init__(self, game: GameConfig) -> None:
        self._game = game
        self._worker = Worker("control")

    def close(self) -> None:
        """Let the thread end."""
        self._worker.close()

    async def fly(self, simulator: Simulator, limit_s: float | None = None) -> None:
        """Let the control systems choose accelerations where a control period begins.

        Raises FlightError if one raises, returns invalid accelerations, is slower than the game, or does not return.
        """
        limit_s = limit_s or SOLVE_S
        for team, system in enumerate(self._game.team_systems):
            if system.kernel:
                continue
            who = f"{system.name}, which flies {TEAM_NAMES[team]},"
            try:
                await asyncio.wait_for(self._worker.do(simulator.solve, team), limit_s)
            except FlightError:
                raise
            except TimeoutError as error:
                raise FlightError(team, system.name, (0,), f"{who} did not answer within {limit_s:g} s") from error
            except RuntimeError as error:
                raise FlightError(team, system.name, (0,), f"{who} {error}") from error

    async def try_out(self) -> None:
        """Let the control systems fly another game for a moment; errors as of `fly`."""
        trial = Simulator(self._game)
        for _ in range(_TRIAL_PERIODS):
            await self.fly(trial, TRIAL_S)
            trial.advance(TICKS_PER_CONTROL_PERIOD)


class LiveSession:
    """A game that counts down once made, and then runs in real time while somebody sees it or a study hosts it.

    Commands count from the countdown on; those of the countdown come into force at the first tick. This tick waits
    until the countdown is over and every policy, which is asked in the countdown, has answered or failed.

    - `name`: unique; a part of the recording's name.
    - `began`: called when the clock and the recording start.
    - `refused`: called with the reason why the game cannot begin; it must call the game off.
    - `over`: called at the end, with the outcome and what ended the game.
    - `sizes`: drones of red and blue, once a second since the start.
    - `starts_ms`: end of the countdown, on the server's clock.
    - `forfeit`: failure of a control system that made its side lose; empty if none failed.
    - `ended`: the game is over or called off.
    - `is_paused`: its player has stopped the clock.
    """

    def __init__(
        self,
        name: str,
        plan: RoomPlan,
        seats: Sequence[Seat],
        audience: Audience,
        context: ServerContext,
        *,
        began: Callable[[], None],
        refused: Callable[[str], None],
        over: Callable[[Outcome, EndedBy], None],
    ) -> None:
        config, seed = plan.config, plan.seed or 0
        self.config, self._hosted = config, plan.hosted
        self._seats, self._audience, self._context = seats, audience, context
        self._began, self._refused, self._over = began, refused, over
        self._robots = context.robots
        self.game = LiveGame(config, seed, robots=self._robots is not None)
        self.sizes = [self.game.sizes]
        self.starts_ms = context.now_ms() + 1000.0 * context.countdown_s
        red, blue = (seat.recorded(with_label=context.record_labels) for seat in seats)
        started = datetime.datetime.now(datetime.UTC)
        header = Header(
            protocol=protocol.SUBPROTOCOL,
            software=_SOFTWARE,
            started=started.isoformat(timespec="milliseconds"),
            began_ms=self.starts_ms,
            table=config.to_dict(),
            seed=seed,
            red=red,
            blue=blue,
            lesson=plan.lesson,
        )
        path = context.folder / f"{started:%Y%m%dT%H%M%SZ}-{name}{SUFFIX}"
        path = plan.hosted.path if plan.hosted is not None else path
        self.recorder = Recorder(path, header)
        self.log = GameLog(self.recorder, header, self.game, context.now_ms)
        self.commands = IncomingCommands(self.game, config.factors, self.log)
        is_compiled = all(system.kernel for system in config.game.team_systems)
        self._control = None if is_compiled else ControlThread(config.game)
        self.forfeit = ""
        self._displays = [Measured(own.display_delay_ms) for own in config.factors]
        self._policies = [(seat.team, seat.loaded) for seat in seats if seat.loaded is not None]
        self._seeds = [np.random.SeedSequence(seed, spawn_key=(team,)) for team in range(2)]
        self._numbers = [itertools.count(1), itertools.count(1)]
        self._sequence = 0
        self.ended = self.is_paused = False
        if self._robots is not None:
            self._robots.begin(self.game)
        self._record_frame()
        self._clock = asyncio.create_task(self._run())

    @property
    def has_begun(self) -> bool:
        """True once the clock runs."""
        return self.log.has_begun

    # --- seats ------------------------------------------------------------------------------------

    def measure(self, seat: Seat) -> None:
        """Measure the display delay of a seat."""
        if seat.view is not None:
            seat.view.measured = self._displays[seat.team]

    def delays(self) -> tuple[SeatDelays, SeatDelays]:
        """Return the delays of red and of blue so far."""
        red, blue = (
            SeatDelays(command=commands.summary(), display=display.summary())
            for commands, display in zip(self.commands.measured, self._displays, strict=True)
        )
        return red, blue

    def note(self, seat: Seat, event: SeatEvent, reason: str = "") -> None:
        """Record an event of a seat's client, or policy."""
        client = seat.connection.client if event == "connected" and seat.connection is not None else None
        self.log.note(SeatMessage(seat.side, event, self._context.now_ms(), client, reason[:500]))

    def _ask(self, team: int, policy: SeatPolicy) -> None:
        answered, failed = functools.partial(self._answered, team), functools.partial(self._failed, team)
        policy.ask(self.game.simulator, self._seeds[team], answered, failed)

    def _answered(self, team: int, answer: Answer) -> None:
        self.commands.take_answer(team, next(self._numbers[team]), answer)

    def _failed(self, team: int, reason: str) -> None:
        seat = self._seats[team]
        self.note(seat, "failed", reason)
        kept = "command" if seat.policy else "share of the command"
        self._audience.notice(f"{seat.policy or seat.helper} keeps its last {kept}: {reason}")

    # --- end --------------------------------------------------------------------------------------

    def call_off(self) -> None:
        """Call off a game that has not begun; it leaves no file."""
        self._halt()
        self.commands.end(is_played=False)

    def _halt(self) -> None:
        self.ended = True
        if asyncio.current_task() is not self._clock:
            self._clock.cancel()
        for _, policy in self._policies:
            policy.rest()
        if self._control is not None:
            self._control.close()
        if self._robots is not None:
            self._robots.end(self.game)

    def stop(self, outcome: Outcome = "stopped", ended_by: EndedBy | None = None) -> None:
        """End the game and finish its file; by default `ended_by` follows from the outcome and who was there."""
        if self.ended:
            return
        self._halt()
        reason = ended_by or reason_of_end(outcome, self.game.sizes, self.log.is_somebody_away)
        self.commands.end(is_played=True)
        self.log.end(outcome, reason, self.delays() if self.config.varies else None)
        self._over(outcome, reason)

    def _lose(self, error: FlightError) -> None:
        """End a game in which a control system failed: the other side has won."""
        if not self.has_begun and not self._begin():
            return
        self.forfeit = str(error)[:500]
        self.note(self._seats[error.team], "forfeit", self.forfeit)
        self._audience.notice(f"{TEAM_NAMES[error.team]} forfeits this game: {self.forfeit}")
        self.stop("blue" if error.team == RED else "red", "forfeit")

    def _give_up(self, reason: str) -> None:
        """End a game that the robots cannot fly."""
        if not self.has_begun:
            self._refused(reason)
            return
        self._audience.notice(f"this game is stopped: {reason}")
        self.stop(ended_by="server")

    # --- time -------------------------------------------------------------------------------------

    async def _run(self) -> None:
        try:
            for team, policy in self._policies:
                self._ask(team, policy)
            trial = [self._control.try_out()] if self._control is not None else []
            answers = [policy.wait() for _, policy in self._policies]
            await asyncio.gather(asyncio.sleep(self._context.countdown_s), *answers, *trial)
            if self._robots is not None:
                await self._robots.gather(self.game, self._audience.notice)
            if self._begin():
                await self._play()
        except FlightError as error:
            self._lose(error)
        except RefusedError as error:  # by the robots
            self._give_up(str(error))
        except Exception:
            log.exception("a game was stopped")
            self._audience.notice("this game was stopped by a fault of the server")
            self.stop(ended_by="server")

    async def _play(self) -> None:
        clock = GameClock(self.config.speed)
        while not self.game.over:
            while self.is_paused or (self._hosted is None and not self._audience.connections):  # nobody sees it
                await asyncio.sleep(HELD_S)
                clock = GameClock(self.config.speed)
            for _ in range(await clock.due()):
                if not self.game.over:
                    await self._tick()
        self.stop(self.game.outcome or "stopped")

    def _begin(self) -> bool:
        """Start the clock and return true, unless the game cannot be recorded."""
        try:
            self.log.begin()
        except OSError as error:
            self._refused(f"the game cannot be recorded: {error.strerror}")
            return False
        self._began()
        return True

    async def _tick(self) -> None:
        game = self.game
        if self._robots is not None:
            poses = self._robots.see(game)
            self.recorder.write(protocol.PosesMessage(game.tick, poses.astype("<f4").tobytes()))
            game.place(poses)
        if game.tick % self.config.game.step_ticks == 0 and game.tick > 0:
            for team, policy in self._policies:
                self._ask(team, policy)
        for began in game.begin_period():
            self._note_in_force(began)
        if self._control is not None and game.is_at_solve:
            with self.log.holding():  # other games go on meanwhile
                await self._control.fly(game.simulator)
        for event in game.advance():
            if isinstance(event, Captured):
                self.recorder.write(protocol.CapturedMessage(SIDES[event.team], event.tick, event.drone))
        if self._robots is not None:
            self._robots.order(game)
        if game.tick % TICKS_PER_SECOND == 0:
            self.sizes.append(game.sizes)
        self._audience.show(self.frame(), self._sequence)
        if game.tick % FRAME_TICKS == 0 or game.over:
            self._record_frame()
        if fault := self.log.flush():
            self._audience.notice(fault)

    def _note_in_force(self, event: InForce) -> None:
        command, seat = event.command, self._seats[event.command.team]
        now = self._context.now_ms()
        message = protocol.InForceMessage(seat.side, command.number, event.tick, now, command.sender)
        self.recorder.write(message)
        seat.send(message)
        if seat.helper:
            seat.show_target(target_of(command, self.game.reader))

    # --- frames -----------------------------------------------------------------------------------

    def frame(self, keyframe: bool = False) -> bytes:
        """Return the present moment; a keyframe holds altitudes and capture fields."""
        self._sequence += 1
        fields = keyframe or self.game.tick % _FIELD_TICKS == 0 or self.game.over
        return self._frame(altitudes=keyframe, fields=fields)

    def _frame(self, *, altitudes: bool = False, fields: bool = False) -> bytes:
        simulator, now = self.game.simulator, self._context.now_ms()
        return frame_of(simulator, self._sequence, now, altitudes=altitudes, fields=fields)

    def _record_frame(self) -> None:
        self.recorder.write(protocol.FrameMessage(self.game.tick, self._frame()))
