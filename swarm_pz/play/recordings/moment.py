"""A moment of a recorded game, to play on from."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_pz.play.game import LiveGame
from swarm_pz.play.recordings.format import EventLine, Origin


@dataclass(frozen=True, kw_only=True)
class Moment:
    """A moment of a recorded game: the game at that moment, where it is from, and the recording's lines up to there.

    `sizes` are the drones of red and blue, once a second since the start, which `seed` decides.
    """

    game: LiveGame
    seed: int
    sizes: list[tuple[int, int]]
    origin: Origin
    past: list[EventLine]
