"""Observations and actions of sides and of drones, and named densities."""

from swarm_pz.spaces.actions import command_from_action
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands
from swarm_pz.spaces.drones import DIRECTIONS, DroneView

__all__ = ["COMMAND_NAMES", "DIRECTIONS", "DroneView", "command_from_action", "named_commands"]
