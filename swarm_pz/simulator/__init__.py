"""Many games side by side: how they begin, what they are told, how they go on.

=============  =============================================================
`simulator`    `Simulator`: E games, advanced together
`spawn`        how a game begins
`commands`     from a command to a target
`parameters`   from a configuration to the numbers that the kernels take
`ergodicity`   looking inside the controller
=============  =============================================================
"""

from swarm_pz.simulator.simulator import Simulator

__all__ = ["Simulator"]
