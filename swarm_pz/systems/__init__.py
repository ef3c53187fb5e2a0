"""The control systems: controllers of a team, and their commands.

======================  ====================================================
`ergodic`               a density, covered over time
`flocking`              attractors, one after the other, for a flock
`coverage`              a density, each drone in the middle of its part
`kernel_ergodic`        a density, by kernels in place of Fourier modes
`potential_field`       what attracts, and what repels
`formation`             a shape with a slot for every drone
`leader_follower`       places of leaders, whom the rest follow
`direct`                an acceleration for every drone
======================  ====================================================

A system's file has its parameters, commands, accelerations and their source. Every system that is installed
under the entry points `swarm_pz.systems` can fly, also of other packages.
"""

from swarm_pz.config.registry import about, faults, registered, system_class
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.systems.flocking import FlockingCommand

__all__ = ["ControlSystem", "Flight", "FlockingCommand", "about", "faults", "registered", "system_class"]
