"""Every field of every configuration takes what its type and range allow, and nothing else."""

from __future__ import annotations

import dataclasses
import math
import types
from typing import Annotated, Any, Literal

import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, Range, check_type, hints_of
from swarm_pz.config.base import _parts as parts
from swarm_pz.config.registry import registered, system_class
from swarm_pz.errors import ConfigError
from swarm_pz.evaluation.tournament import TournamentConfig
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.studies.design import Practice
from swarm_pz.play.studies.forms import Item
from swarm_pz.policies.onnx_policy import OnnxCard
from swarm_pz.policies.planner import PlannerConfig
from swarm_pz.training.config import LeagueConfig, TrainConfig

SECTIONS = [kind for kind in map(type, vars(GameConfig()).values()) if issubclass(kind, Config)]
OTHERS = [GameConfig, TrainConfig, LeagueConfig, TournamentConfig, PlannerConfig, TableConfig, Factors]
WHOLE = [kind() for kind in (*SECTIONS, *OTHERS, *map(system_class, sorted(registered())))]
EXAMPLES = [*WHOLE, OnnxCard(name="mine"), Practice(), Item(id="age", text="How old?")]


def ends_of(hint: Any) -> Range | None:
    """Return the range of a number, even if it may be None."""
    origin, args = parts(hint)
    if origin is Annotated:
        return args[1]
    return next(filter(None, map(ends_of, args)), None) if origin is types.UnionType else None


def wrong(hint: Any) -> list[Any]:
    """Return values that a type refuses; for numbers: just out of range, NaN, and too large for a float."""
    origin, args = parts(hint)
    if origin is Annotated:
        (base, ends), beyond = args, [math.nan, 10**400, -(10**5000), "1", True, [1]]
        if base is int:
            return [ends.low - 1, ends.high + 1, float(ends.low), *beyond]
        return [math.nextafter(ends.low, -math.inf), math.nextafter(ends.high, math.inf), *beyond]
    if origin is types.UnionType:
        option = next(one for one in args if one is not types.NoneType)
        right = ((str,) if str in args else ()) + ((int, float) if float in args else ())
        return [one for one in wrong(option) if not isinstance(one, right)]
    if origin is tuple:
        alone = ["text", 5, None, {}]
        if args[-1] is not Ellipsis:
            alone += [(), (wrong(args[0])[0],) * 3]
        return [*alone, *((one,) * (1 if args[-1] is Ellipsis else 2) for one in wrong(args[0])[:8])]
    if origin is Literal:
        return ["nonsense", 5, None, (args[0],)]
    if isinstance(hint, type) and issubclass(hint, Config):
        return [None, 0.5, TrainConfig() if hint is not TrainConfig else GameConfig(), {}]
    return {bool: [1, 0.0, "yes", None], str: [5, ("a",), b"a"]}.get(hint, [5])


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: type(example).__name__)
def test_fields_take_what_their_types_and_ranges_say_and_nothing_else(example):
    for name in (entry.name for entry in dataclasses.fields(example)):
        hint, path = hints_of(type(example))[name], example._path(name)
        for value in wrong(hint) if name != "controllers" else ():  # tests/config/test_registry.py tests these
            if value is None and getattr(type(example), name, ...) is None:
                continue  # the default, replaced once other fields are known
            with pytest.raises(ConfigError, match=rf"^{path} must be .*, got"):
                example.replace(**{name: value})
        for end in ends_of(hint) or ():
            assert check_type(end, path, hint) == end


def test_defaults_are_of_their_types():
    for example in EXAMPLES:
        again = {entry.name: getattr(example, entry.name) for entry in dataclasses.fields(example)}
        copies = {name: float(str(value)) if type(value) is float else value for name, value in again.items()}
        assert type(example)(**copies) == example  # equal numbers as new objects, which are checked


def test_a_message_is_short_whatever_came():
    with pytest.raises(ConfigError, match="thousands of digits") as error:
        GameConfig(drones_per_team=-(10**5000))
    assert len(str(error.value)) < 300
    with pytest.raises(ConfigError, match=r"\.\.\."):
        ObservationConfig(grid="5" * 1000)
