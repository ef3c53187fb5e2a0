"""Markers of games over Lab Streaming Layer, beside streams of EEG, eyes, heart, or whatever else a lab records.

One stream of type Markers holds a text of JSON for each moment: that a game began, that a command came into force, that
a drone was taken, that a game ended. It is of all games of a server; `game` is the name of the recording, `tick` the
moment in it, 30 a second of game. Time stamps are LSL's clock when the server did so; a screen shows it later.
"""

from __future__ import annotations

import json
import logging
import socket
from collections.abc import Callable
from types import ModuleType
from typing import Any

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import MissingExtraError, require_extra
from swarm_pz.play.recordings.format import CapturedLine, ClockLine, EndLine, InForceLine, RecordedSeat

NAME = "swarm-pz"
"""What the stream is called, if nobody says."""
log = logging.getLogger("swarm_pz.play")
_READINGS = 20
"""Of both clocks: the pair that is closest together counts."""


class Markers:
    """The stream, as long as this lives.

    Parameters
    ----------
    name : str
        What recorders of streams show.

    Raises
    ------
    MissingExtraError
        If pylsl is not installed, or finds no liblsl.
    """

    def __init__(self, name: str = NAME) -> None:
        self._lsl = _library()
        # Of the same source as before, so that who records goes on when the server is started again.
        source = f"{NAME}:{socket.gethostname()}:{name}"
        lsl = self._lsl
        info = lsl.StreamInfo(name, "Markers", 1, lsl.IRREGULAR_RATE, lsl.cf_string, source)
        told = info.desc()
        told.append_child_value("manufacturer", NAME)
        told.append_child_value("format", "JSON: event (start, command, capture, end), game, tick, and what it is of")
        self._outlet = lsl.StreamOutlet(info)

    def clock(self, now_ms: Callable[[], float]) -> ClockLine:
        """Return LSL's clock and another one, as they were at the same moment, and how sure that is."""
        readings = []
        for _ in range(_READINGS):
            before, seconds, after = now_ms(), float(self._lsl.local_clock()), now_ms()
            readings.append((after - before, (before + after) / 2.0, seconds))
        width, ms, seconds = min(readings)
        return ClockLine(clock="lsl", ms=ms, seconds=seconds, uncertainty_ms=width / 2.0)

    def start(self, game: str, tick: int, red: RecordedSeat, blue: RecordedSeat) -> None:
        """Tell that a game began."""
        players = {
            side: seat.policy or seat.label or seat.kind for side, seat in zip(TEAM_NAMES, (red, blue), strict=True)
        }
        self._send("start", game, tick, **players)

    def note(self, game: str, line: InForceLine | CapturedLine | EndLine) -> None:
        """Tell what happened in a game."""
        if isinstance(line, InForceLine):
            by = {"by": line.sender} if line.sender else {}
            self._send("command", game, line.tick, side=TEAM_NAMES[line.team], number=line.number, **by)
        elif isinstance(line, CapturedLine):
            self._send("capture", game, line.tick, side=TEAM_NAMES[line.team], drone=line.drone)
        else:
            self._send("end", game, line.tick, outcome=line.outcome, ended_by=line.ended_by)

    def _send(self, event: str, game: str, tick: int, **more: Any) -> None:
        marker = json.dumps({"event": event, "game": game, "tick": tick, **more})
        try:
            self._outlet.push_sample([marker], self._lsl.local_clock())
        except Exception:  # whatever is wrong with a recorder's library, the game goes on, and its recording tells all
            log.exception("Lab Streaming Layer has not taken the marker %s", marker)


def _library() -> ModuleType:
    try:
        return require_extra("pylsl", "lab")
    except (RuntimeError, OSError, AttributeError) as error:  # it looks for liblsl as it is imported, and into it
        raise MissingExtraError(
            "pylsl found no liblsl that works here: install one (conda install -c conda-forge liblsl, or a package of "
            f"github.com/sccn/liblsl/releases), or name its file in the variable PYLSL_LIB. It says: {error}"
        ) from error
