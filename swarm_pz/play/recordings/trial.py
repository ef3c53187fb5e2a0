"""A recorded game as rows of an experiment: those of the tables, with what an experiment's own files want besides."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play.recordings.format import CapturedLine, Recording
from swarm_pz.play.recordings.seats import seat_rows


def trial_rows(recording: Recording) -> list[dict[str, Any]]:
    """Return a row for each seat: those of `seat_rows`, its captures and losses, and the seed of the game's start."""
    takers = [capture.team for capture in recording.of(CapturedLine)]
    counts = [takers.count(team) for team in range(2)]
    rows = []
    for row in seat_rows(recording):
        team = TEAM_NAMES.index(row.side)
        more = {"captured": counts[team], "lost": counts[1 - team], "seed": recording.header.seed}
        rows.append(asdict(row) | more)
    return rows
