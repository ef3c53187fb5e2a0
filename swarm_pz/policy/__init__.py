"""Policies: what they are, and how a name, a folder or a trained model becomes one."""

from swarm_pz.policy.identity import digest_of, identity_of, sort_of
from swarm_pz.policy.model_policy import Model, ModelPolicy
from swarm_pz.policy.names import (
    FOLDERS,
    GROUP,
    about,
    allow_files,
    faults,
    folder_of,
    is_constant,
    kind_of,
    load,
    load_players,
    name_of,
    registered,
)
from swarm_pz.policy.program import Program
from swarm_pz.policy.protocol import Player, Policy, PolicyFactory, PrivilegedPolicy, answers_of, constant

__all__ = [
    "FOLDERS",
    "GROUP",
    "Model",
    "ModelPolicy",
    "Player",
    "Policy",
    "PolicyFactory",
    "PrivilegedPolicy",
    "Program",
    "about",
    "allow_files",
    "answers_of",
    "constant",
    "digest_of",
    "faults",
    "folder_of",
    "identity_of",
    "is_constant",
    "kind_of",
    "load",
    "load_players",
    "name_of",
    "registered",
    "sort_of",
]
