"""The way to capture a parked drone, as docs/parking.md describes it."""

import numpy as np

from swarm_pz.config import BLUE, GRID_CELLS, RED, GameConfig
from swarm_pz.simulator import Simulator


def test_three_drones_given_away_disarm_a_parked_drone_for_six_others():
    simulator = Simulator(GameConfig(controllers="direct"))
    parked = [(row, column) for row in (10, 40) for column in (25, 5, 15, 35, 45)]
    corners = np.array([(row, column) for column in (-1, 1) for row in (-1, 0, 1)])
    waiting = [(10 + 6 * row, 25 + 6 * column) for row, column in corners]
    cells = np.array([*parked, *waiting, *[(22, 25)] * 3, (30, 10)])
    centres = (cells[:, ::-1] + 0.5) / GRID_CELLS
    simulator.reset([0], scenario={"positions": centres, "teams": [RED] * 10 + [BLUE] * 10})
    goals = (np.array([10, 25]) + 2 * corners)[:, ::-1] + 0.5
    while simulator.games.ticks[0] < 420 and simulator.teams[0, 0] == RED:
        command = np.zeros((1, 20, 2))
        if simulator.games.ticks[0] >= 330:
            command[0, 16:19] = [0.0, -1.0]
        if (simulator.teams[0, 16:19] == RED).all():
            missing = goals / GRID_CELLS - simulator.positions[0, 10:16]
            wanted = np.sign(missing) * np.sqrt(1.2 * np.maximum(np.abs(missing) - 0.002, 0.0))
            command[0, 10:16] = np.clip(7 * (wanted - simulator.velocities[0, 10:16]), -1.0, 1.0)
        simulator.command(BLUE, command)
        simulator.advance(3)
    np.testing.assert_array_equal(simulator.positions[0, 0], centres[0].astype(np.float32))
    assert simulator.teams[0].tolist() == [BLUE] + [RED] * 9 + [BLUE] * 6 + [RED] * 3 + [BLUE]
