"""Many games side by side: how they begin, what they are told, how they go on.

=============  =============================================================
`simulator`    `Simulator`: E games, advanced together
`spawn`        how a game begins
`control`      who flies which team: control systems, their commands and solves
`commands`     from a density to a target
`parameters`   from a configuration to the numbers that the kernels take
`ergodicity`   looking inside the controller
=============  =============================================================
"""

from swarm_pz.simulator.commands import CheckedCommands, make_target
from swarm_pz.simulator.simulator import Simulator
from swarm_pz.simulator.spawn import Seed

__all__ = ["CheckedCommands", "Seed", "Simulator", "make_target"]
