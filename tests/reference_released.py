"""The slow mirror of whole games by the preset `released`: who knows what, who flies where, who is captured.

Float64 NumPy and plain Python like `tests.reference`, and in its words and orders of axes. It plays along with a game:
it is told what is sent and where the drones are, and keeps targets, memories, trails and fields of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.reference import Booleans, ControllerReference, Floats, cell_of, target_coefficients
from tests.reference_variants import VariantRules, reconstruction_captures, reconstruction_field

TARGET_MASS = 10.0
"""What a density that was sent sums to; the one that a team has before it is sent anything sums to 1."""


def published_controller() -> ControllerReference:
    """The controller of the preset `released`."""
    return ControllerReference(tau=None, q=1.0, r=1.0, wall_margin=0.01, speed_factor=0.8, spectrum="exponential")


class ReleasedReference:
    """One game by the preset `released`, of which positions and velocities are given.

    It has `rules`, and as of the last solve `phi` (2, K, K), `memory` (N, K, K), `memory_weight` (N,) and the capture
    `fields` (2, 50, 50), which are 0 for a team without drones.
    """

    def __init__(self, teams: NDArray[np.integer], cells: int = 10) -> None:
        self.rules = VariantRules(teams, trail_ticks=None, forgotten_on_capture=True)
        self.controller = published_controller()
        uniform = np.full((cells, cells), 1.0 / cells**2)
        self._targets = [uniform, uniform]  # what the teams follow, as densities of sum 1
        self._sent: list[Floats | None] = [None, None]  # what they are to follow from the next solve on
        self.phi: Floats = np.stack([target_coefficients(uniform)] * 2)
        self.memory: Floats = np.zeros((len(teams), 10, 10))
        self.memory_weight: Floats = np.zeros(len(teams))
        self.fields: Floats = np.zeros((2, 50, 50))

    def command(self, team: int, density: NDArray[np.floating]) -> None:
        """Send a team an (A, A) density, row = y, column = x, of any sum; zeros mean uniform."""
        values = np.array(density, dtype=np.float64)
        if not values.any():
            values[:] = 1.0
        self._sent[team] = values / values.sum()

    def step(self, team: int, density: NDArray[np.floating]) -> None:
        """Ask for an (A, A) density as a step does: what was asked for last is held, anything else is sent."""
        last, sent = self._targets[team], self._sent[team]
        self.command(team, density)
        if np.abs(self._sent[team] - (last if sent is None else sent)).max() <= 1e-9:
            self._sent[team] = sent

    def solve(self, positions: NDArray[np.floating], velocities: NDArray[np.floating]) -> Floats:
        """One solve: accelerations of all drones, (N, 2) float64, not saturated."""
        for team in (0, 1):
            self._follow(team)
        state = (positions, velocities, self.rules.teams, self.memory, self.memory_weight)
        accelerations, self.memory, self.memory_weight = self.controller.solve(*state, self.phi)
        rollouts = self.controller.look_ahead(positions, velocities)
        coefficients = self.controller.coefficients(rollouts, self.memory, self.memory_weight)
        for team in (0, 1):
            members = coefficients[self.rules.teams == team]
            self.fields[team] = reconstruction_field(members.mean(axis=0)) if len(members) else 0.0
        return accelerations

    def _follow(self, team: int) -> None:
        """Take over what a team was sent, if anything: memories are emptied by all of it, trails by what is new."""
        sent = self._sent[team]
        if sent is None:
            return
        if np.abs(sent - self._targets[team]).max() > 1e-9:
            self.rules.command(team)
        self._forget(self.rules.teams == team)
        self._targets[team] = sent
        self._sent[team] = None
        self.phi[team] = target_coefficients(sent, mass=TARGET_MASS)

    def _forget(self, drones: Booleans) -> None:
        self.memory[drones] = 0.0
        self.memory_weight[drones] = 0.0

    def tick(self, positions: NDArray[np.float32]) -> list[int]:
        """Extend the trails by positions (N, 2) after a move, apply all captures at once, and return them."""
        captured = self.rules.tick(positions, captures=reconstruction_captures(self.fields))
        for drone in captured:
            self._forget(np.arange(len(positions)) == drone)
        return captured

    def values(self, positions: NDArray[np.float32]) -> Floats:
        """What the opposing field is at each of (N, 2) positions, (N,) float64; with the teams as they are now."""
        places = zip(self.rules.teams, positions, strict=True)
        return np.array([self.fields[1 - team][cell_of(position)] for team, position in places])
