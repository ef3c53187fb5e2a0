"""Parts of a control period on their own, for whoever measures them; see `swarm_pz.bench`.

They leave games in a state that no game has: restore a snapshot afterwards.
"""

from __future__ import annotations

from swarm_pz.kernels import entry_point
from swarm_pz.kernels.controllers.ergodic import (
    ErgodicParameters,
    ergodic,
    expect,
    list_members,
    make_scratch,
    remember,
)
from swarm_pz.kernels.game import Games, swarm_of


@entry_point
def find_coefficients(games: Games, controller: ErgodicParameters) -> None:
    """Do steps 1 to 4 of `ergodic`, memory, rollout and coefficients, once in every game."""
    scratch = make_scratch(games.teams.shape[1], controller)
    for e in range(games.ticks.shape[0]):
        swarm = swarm_of(games, e, controller.warm_start)
        sizes = list_members(swarm.teams, scratch.members)
        remember(swarm, sizes, controller, scratch)
        for team in range(2):
            drones = scratch.members[team, : sizes[team]]
            expect(drones, swarm, controller, scratch.tables, scratch.means[team])


@entry_point
def solve(games: Games, controller: ErgodicParameters) -> None:
    """Do all of `ergodic` once in every game."""
    scratch = make_scratch(games.teams.shape[1], controller)
    for e in range(games.ticks.shape[0]):
        ergodic(swarm_of(games, e, controller.warm_start), games.coefficients[e], controller, scratch)
