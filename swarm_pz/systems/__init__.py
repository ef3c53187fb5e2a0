"""The control systems: how a team can be flown, and by which commands.

======================  ====================================================
`ergodic`               a density, covered over time
`flocking`              a flock that flies to one place
`coverage`              a density, each drone in the middle of its part
`potential_field`       what attracts, and what repels
`direct`                an acceleration for every drone
======================  ====================================================

A system's file holds all of it: its numbers, its commands, its accelerations and their source. All that are
installed under the entry points `swarm_pz.systems` can fly, those of other packages, too.
"""

from swarm_pz.config.registry import registered, system_class
from swarm_pz.config.system import ControlSystem, Flight

__all__ = ["ControlSystem", "Flight", "registered", "system_class"]
