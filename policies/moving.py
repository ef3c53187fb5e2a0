"""Scripts that keep moving: levels of the web page that one stroke does not beat, and `eddy` and `carousel`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.policies.scripted import CLOCK, View, tactic
from swarm_pz.spaces.densities import disc
from swarm_pz.spaces.densities import ring as ring_at

Array = NDArray[np.float64]


def _lap(view: View, radius: float, period: int) -> Array:
    """Return the distance (n, A, A) of cells from a place that runs around the middle once in `period` commands."""
    angles = 2.0 * np.pi * view.steps / period
    return view.distance_from(0.5 + radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


@tactic(sees=CLOCK)
def pendulum(view: View) -> Array:
    """Swing from left to right and back in 24 s, close together."""
    swing = 0.35 * np.sin(2.0 * np.pi * view.steps / 24)
    return disc(view.distance_from(np.stack([0.5 + swing, np.full_like(swing, 0.5)], axis=1)), 0.1)


@tactic(sees=CLOCK)
def tide(view: View) -> Array:
    """Flow to the left half, then to the right half, five seconds each."""
    beside = np.where((view.steps // 5 % 2 == 0)[:, None, None], view.x, 1.0 - view.x) - 0.25
    return disc(np.hypot(beside, np.maximum(np.abs(view.y - 0.5) - 0.3, 0.0)), 0.1)


@tactic(sees=CLOCK)
def breather(view: View) -> Array:
    """Make a wide ring around the middle, then a narrow one, four seconds each."""
    radius = np.where(view.steps // 4 % 2 == 0, 0.37, 0.2)
    return ring_at(np.hypot(view.x - 0.5, view.y - 0.5) - radius[:, None, None], 0.0)


@tactic(sees=CLOCK)
def stroller(view: View) -> Array:
    """Walk around the middle in ten seconds, all together."""
    return disc(_lap(view, 0.24, 10), 0.18)


@tactic(sees=CLOCK)
def runner(view: View) -> Array:
    """Run around the middle in six seconds, all together, so that the trails close to a ring."""
    return disc(_lap(view, 0.24, 6), 0.18)


@tactic(sees=CLOCK)
def hoop(view: View) -> Array:
    """Move a small ring around the middle in six seconds."""
    return ring_at(_lap(view, 0.15, 6), 0.15)


@tactic(sees=CLOCK)
def eddy(view: View) -> Array:
    """Run a small lap beside the middle in six seconds, all together; opponents enter its ring one by one."""
    angles = 2.0 * np.pi * view.steps / 6
    return disc(view.distance_from(0.3 + 0.1 * np.stack([np.cos(angles), np.sin(angles)], axis=1)), 0.07)


@tactic(sees=("own_positions", "opposing_positions"), grid=25)
def carousel(view: View) -> Array:
    """Run around the middle together, a sixth of a turn ahead of the team's mean; begin opposite the opponents.

    A lap takes six seconds, as `runner`'s, and never falls out of step with the drones that fly it.
    """
    own, towards = view.mean_position("own") - 0.5, view.mean_position("opposing") - 0.5
    opposite = np.arctan2(-towards[:, 1], -towards[:, 0])
    ahead = np.arctan2(own[:, 1], own[:, 0]) + np.pi / 3.0
    angles = np.where(np.hypot(own[:, 0], own[:, 1]) < 0.02, opposite, ahead)
    return disc(view.distance_from(0.5 + 0.24 * np.stack([np.cos(angles), np.sin(angles)], axis=1)), 0.155)
