"""The controllers: from a team's command and its drones' past to accelerations, as kernels.

=================  ======================================================
`ergodic`          receding-horizon control towards a density
`communication`    the same where not everybody hears everybody
`flocking`         alignment, cohesion, separation, and an attractor
`coverage`         towards the centroids of Voronoi cells
`potential_field`  repulsion between drones, and images of charges
=================  ======================================================

A controller's file holds its kernel, its numbers as a named tuple, and what makes them of a configuration; the last two
are entry points that control systems of `swarm_pz.systems` call, which make their numbers themselves.
`CONTROLLERS` lists all of them; `tests/kernels/controllers/test_family.py` tries whatever stands there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from swarm_pz.config import GameConfig
from swarm_pz.kernels.controllers.ergodic import ergodic, ergodic_parameters
from swarm_pz.kernels.controllers.flocking import flocking, flocking_parameters


class Parts(NamedTuple):
    """What a controller is made of."""

    kernel: Callable[..., None]
    """Writes the accelerations of one game's drones; all take the same arguments."""
    parameters: Callable[[GameConfig], Any]
    """Returns its numbers, which are its kernel's `parameters`."""
    target: str
    """The field of `swarm_pz.kernels.game.Games` that tells it where to."""


CONTROLLERS: Mapping[str, Parts] = MappingProxyType(
    {
        "ergodic": Parts(ergodic, ergodic_parameters, "coefficients"),
        "flocking": Parts(flocking, flocking_parameters, "attractors"),
    }
)
"""All controllers, by the names that `GameConfig.controllers` takes."""
NUMBERS: Mapping[str, int] = MappingProxyType({name: number for number, name in enumerate(CONTROLLERS)})
"""Their places in that list, by which `Games.flown_by` knows them."""
GIVEN = len(NUMBERS)
"""From this number on, a team's accelerations are given by a control system outside of the kernels."""
