"""From a configuration to the numbers that the kernels take."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, GameConfig
from swarm_pz.kernels.capture import ring_weights
from swarm_pz.kernels.controllers.communication import Talk
from swarm_pz.kernels.controllers.ergodic import ErgodicParameters
from swarm_pz.kernels.controllers.flocking import FlockingParameters
from swarm_pz.kernels.game import Options, RuleParameters

_ENDLESS = 2**40


def rule_parameters(config: GameConfig) -> RuleParameters:
    """Return what a tick needs."""
    tick = 1 / TICKS_PER_SECOND
    # What is compiled must not depend on a game's length, so trails as long as it count as the longest.
    trail_ticks = config.trail_ticks if config.memory.trail is not None else _ENDLESS
    return RuleParameters(
        tick=np.float32(tick),
        drift=np.float32(tick * config.dynamics.speed_factor),
        ticks_per_control_period=TICKS_PER_CONTROL_PERIOD,
        ticks_per_second=TICKS_PER_SECOND,
        capture_enabled=config.capture.enabled,
        capture_threshold=config.capture.threshold,
        ring_weights=ring_weights(config.num_drones * trail_ticks),
    )


def option_parameters(config: GameConfig) -> Options | None:
    """Return what differs from the preset `paper` in kind, None if nothing does."""
    memory, dynamics, flocking = config.memory, config.dynamics, config.flocking
    capture_forgets, command_forgets = (
        (occasion in memory.trail_forgotten_on, occasion in memory.controller_forgotten_on)
        for occasion in ("capture", "command")
    )
    can_fail = dynamics.failure_rate > 0.0
    radius, loss = config.controller.communication_radius, config.controller.message_loss
    red, blue = (controller == "flocking" for controller in config.team_controllers)
    reconstructs = config.capture.field == "reconstruction"
    is_local = can_fail or radius is not None or loss > 0.0
    forgets_as_usual = capture_forgets == (False, True) and not any(command_forgets)
    if forgets_as_usual and not (reconstructs or is_local or red or blue):
        return None
    return Options(
        reconstructs=reconstructs,
        capture_forgets=capture_forgets,
        command_forgets=command_forgets,
        can_fail=can_fail,
        failure_chance=-math.expm1(-dynamics.failure_rate * CONTROL_PERIOD),
        repair_chance=-math.expm1(-dynamics.repair_rate * CONTROL_PERIOD),
        talk=Talk(is_local=is_local, radius=math.inf if radius is None else float(radius), loss=float(loss)),
        flocking=FlockingParameters(
            flies=(red, blue),
            alignment=float(flocking.alignment),
            cohesion=float(flocking.cohesion),
            separation=float(flocking.separation),
            communication_radius=float(flocking.communication_radius),
            separation_radius=float(flocking.separation_radius),
            max_turn=float(flocking.max_turn),
            speed=float(flocking.speed),
            period=CONTROL_PERIOD,
        ),
    )


def sobolev_weights(modes: int) -> NDArray[np.float64]:
    """Return (1 + |k|^2)^(-3/2), (K, K): coarse differences count most, in control and in the ergodic metric."""
    k = np.arange(modes)
    return np.asarray((1.0 + k[:, None] ** 2 + k**2) ** -1.5)


def controller_parameters(config: GameConfig) -> ErgodicParameters:
    """Return what a solve of the ergodic controller needs."""
    controller, factor = config.controller, config.dynamics.speed_factor
    k = np.arange(controller.modes)
    exponential = np.exp(-0.8 * np.sqrt(k[:, None] ** 2 + k**2))
    spectrum = sobolev_weights(controller.modes) if controller.spectrum == "sobolev" else exponential
    decay = 1.0 if config.memory.controller is None else np.exp(-CONTROL_PERIOD / config.memory.controller)
    # A velocity moves a drone by the speed factor: points ahead lie that much further, while the costate,
    # which multiplies two of these times, wants the factor only once.
    return ErgodicParameters(
        modes=tuple(range(controller.modes)),
        times=tuple(np.float32(CONTROL_PERIOD * h * factor) for h in range(controller.horizon + 1)),
        decay=np.float32(decay),
        spectrum=(controller.ergodic_weight * spectrum).astype(np.float32),
        inverse_control_weight=np.float32(1.0 / (controller.control_weight * factor)),
        wall_weight=np.float32(controller.wall_weight),
        wall_margin=np.float32(controller.wall_margin),
        max_acceleration=np.float32(controller.max_acceleration),
    )
