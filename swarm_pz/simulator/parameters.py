"""Conversion of a configuration to the numbers of the rules for kernels; controllers convert their own."""

from __future__ import annotations

import math
from typing import NamedTuple, get_args

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, GameConfig
from swarm_pz.config.sections import Occasion
from swarm_pz.errors import ConfigError
from swarm_pz.kernels.capture import Boards, empty_boards
from swarm_pz.kernels.game import RuleParameters, RuleVariants

_ENDLESS = 2**40


def boards_of(config: GameConfig) -> Boards:
    """Return the empty boards that a game begins with."""
    # Compiled types must not depend on a game's length, so trails as long as the game count as endless.
    trail_ticks = config.trail_ticks if config.memory.trail is not None else _ENDLESS
    return empty_boards(config.num_drones * trail_ticks)


def rule_parameters(config: GameConfig) -> RuleParameters:
    """Return the numbers of a tick."""
    tick = 1 / TICKS_PER_SECOND
    return RuleParameters(
        tick=np.float32(tick),
        drift=np.float32(tick * config.dynamics.speed_factor),
        min_speed=np.float32(config.dynamics.min_speed),
        ticks_per_control_period=TICKS_PER_CONTROL_PERIOD,
        ticks_per_second=TICKS_PER_SECOND,
        capture_enabled=config.capture.enabled,
        capture_threshold=config.capture.threshold,
        ring_weights=boards_of(config).ring_weights,
    )


def rule_variants(config: GameConfig) -> RuleVariants | None:
    """Return the rules that the preset `paper` does not have, None if there are none."""
    memory, dynamics = config.memory, config.dynamics
    capture_forgets, command_forgets, sending_forgets = (
        (occasion in memory.trail_forgotten_on, occasion in memory.controller_forgotten_on)
        for occasion in get_args(Occasion)
    )
    reconstructs = config.capture.field == "reconstruction"
    radius = config.controller.communication_radius
    is_local = radius is not None or dynamics.failure_rate > 0.0
    forgets_as_usual = capture_forgets == (False, True) and not any(command_forgets + sending_forgets)
    kernels = {system.kernel for system in config.team_systems}
    all_ergodic = kernels == {"ergodic"}
    if forgets_as_usual and all_ergodic and not (reconstructs or is_local):
        return None
    return RuleVariants(
        reconstructs=reconstructs,
        capture_forgets=capture_forgets,
        command_forgets=command_forgets,
        sending_forgets=sending_forgets,
        can_fail=dynamics.failure_rate > 0.0,
        failure_chance=-math.expm1(-dynamics.failure_rate * CONTROL_PERIOD),
        repair_chance=-math.expm1(-dynamics.repair_rate * CONTROL_PERIOD),
        is_local=is_local,
        radius=math.inf if radius is None else float(radius),
        is_given=not all_ergodic,
        unit=float(config.controller.max_acceleration),
        is_ergodic="ergodic" in kernels or reconstructs,
    )


def external_rules(config: GameConfig) -> tuple[RuleParameters, RuleVariants]:
    """Return the rules of externally moved drones: kernels neither move them nor let them fail; `failed` may be set."""
    still = rule_parameters(config)._replace(tick=np.float32(0.0), drift=np.float32(0.0), min_speed=np.float32(0.0))
    can_fail = config.dynamics.replace(failure_rate=1.0, min_speed=0.0)
    variants = rule_variants(config.replace(dynamics=can_fail))
    assert variants is not None  # noqa: S101
    return still, variants._replace(failure_chance=0.0, repair_chance=0.0)


def check_finite(parameters: NamedTuple) -> None:
    """Check the numbers that kernels take.

    Raises
    ------
    ConfigError
        If one is not finite in the type that kernels take.
    """
    for name, value in parameters._asdict().items():
        if value is not None and not np.isfinite(value).all():
            raise ConfigError(f"the configuration's {name} must be finite for the kernels, got {value}")
