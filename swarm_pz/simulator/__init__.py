"""Many games side by side: their starts, commands, control systems and states."""

from swarm_pz.simulator.commands import CheckedCommands, make_target
from swarm_pz.simulator.simulator import Simulator
from swarm_pz.simulator.spawn import Seed

__all__ = ["CheckedCommands", "Seed", "Simulator", "make_target"]
