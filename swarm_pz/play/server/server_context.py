"""What all games of a server share."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from swarm_pz.play.game import TableConfig
from swarm_pz.play.lsl import Markers
from swarm_pz.play.server.game_clock import Punctuality
from swarm_pz.play.server.games_folder import SeatIndex
from swarm_pz.play.server.policy_workers import PolicyWorkers

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown before the clock begins: time to find one's drones and to draw, and more than
a policy may take for a command."""


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
