"""A moment of a recorded game, to play on from."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_pz.play.game import LiveGame
from swarm_pz.play.recordings.format import EventLine, Origin


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
