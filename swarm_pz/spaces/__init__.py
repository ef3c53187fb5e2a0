"""What a side sees and how it answers: observations, named densities, and the forms libraries want them in."""

from swarm_pz.spaces.actions import command_from_action
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands

__all__ = [
    "COMMAND_NAMES",
    "command_from_action",
    "named_commands",
]
