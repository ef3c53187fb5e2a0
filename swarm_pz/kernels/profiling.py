"""A control solve on its own, without the rest of a tick, for tests.

It leaves games in a state that no game has: restore a snapshot afterwards.
"""

from __future__ import annotations

from swarm_pz.kernels import entry_point
from swarm_pz.kernels.controllers.ergodic import ErgodicParameters, ergodic, make_scratch
from swarm_pz.kernels.game import Games, swarm_of


@entry_point
def solve(games: Games, controller: ErgodicParameters) -> None:
    """Do all of `ergodic` once in every game."""
    scratch = make_scratch(games.teams.shape[1], controller)
    for e in range(games.ticks.shape[0]):
        ergodic(swarm_of(games, e, controller.warm_start), games.coefficients[e], controller, scratch)
