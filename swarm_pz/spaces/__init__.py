"""What a side sees and how it answers: observations, named densities, and the forms libraries want them in."""

from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands
from swarm_pz.spaces.formats import command_from_action

__all__ = [
    "COMMAND_NAMES",
    "command_from_action",
    "named_commands",
]
