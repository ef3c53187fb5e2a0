"""Whole games by the published rules beside the slow reference of them, and what the newer of these rules say alone."""

from __future__ import annotations

import numpy as np

from benchmarks.mirror_released import Mirrored, play
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.reference_released import ReleasedReference

RELEASED = GameConfig.preset("released")


def test_solves_and_captures_of_whole_games_are_the_references():
    # At full length: python -m benchmarks.mirror_released
    found, seed = Mirrored(), 0
    while found.solves < 150:
        play(seed, 5, found)
        seed += 1
    assert found.mismatches == 0
    assert max(found.acceleration, found.flown, found.field) < 1e-4
    assert found.captures > 5
    assert 0 < found.resent < found.commands


# --- each rule alone --------------------------------------------------------------------------------------------------


def test_a_step_holds_what_is_in_force_and_sends_anything_else():
    simulator = Simulator(RELEASED.replace(capture=CaptureConfig(enabled=False, field="reconstruction")))
    simulator.reset([0])
    reference = ReleasedReference(simulator.teams[0])
    generator = np.random.default_rng(0)
    uniform, some, other = np.ones((10, 10)), *generator.random((2, 10, 10))
    steps = [0.7 * uniform, some, 0.3 * some, other, uniform, 0.9 * uniform, some]
    for second, asked in enumerate(steps):
        if second == 6:  # sent and asked for at once: it is a sending
            simulator.command(0, asked[None])
            reference.command(0, asked)
        simulator.advance(3, commands=np.stack([asked, uniform])[None])
        reference.step(0, asked)
        reference.step(1, uniform)
        reference.solve(simulator.positions[0], simulator.velocities[0])
        np.testing.assert_array_equal(simulator.games.memory_weight[0], reference.memory_weight)
        np.testing.assert_allclose(simulator.games.coefficients[0], reference.phi, atol=1e-5)
    assert simulator.games.memory_weight[0, [0, 10]].tolist() == [1.0, 7.0]
