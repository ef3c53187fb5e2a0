"""Control systems on the command line: by their names, with their usual numbers."""

from __future__ import annotations

import tyro
from tyro.constructors import ConstructorRegistry, PrimitiveConstructorSpec, PrimitiveTypeInfo

from swarm_pz.config.registry import system_of
from swarm_pz.config.system import ControlSystem

REGISTRY = ConstructorRegistry()
"""What tyro has to know besides."""


@REGISTRY.primitive_rule
def _by_name(told: PrimitiveTypeInfo) -> PrimitiveConstructorSpec[ControlSystem] | None:
    if told.type is not ControlSystem:
        return None
    return tyro.constructors.PrimitiveConstructorSpec(
        nargs=1,
        metavar="SYSTEM",
        instance_from_str=lambda words: system_of(words[0]),
        is_instance=lambda given: isinstance(given, ControlSystem),
        str_from_instance=lambda system: [system.name],
    )
