"""A parked drone is captured by nobody, as docs/parking.md proves."""

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import BLUE, GRID_CELLS, RED, GameConfig
from swarm_pz.envs.batch_env import BatchEnv

GAMES = 50


@pytest.mark.parametrize("opponent", ["uniform", "ring", "halo", "chase"])
def test_no_drone_is_captured_that_has_rested_for_as_long_as_a_trail(opponent):
    config = GameConfig(controllers=("formation", "ergodic"))
    env, rows = BatchEnv(config, GAMES), np.arange(GAMES)
    env.reset(range(GAMES))
    simulator, rests = env.simulator, 0
    teams = [policies.load(name, config, config.team_systems[side]) for side, name in enumerate(("hold", opponent))]
    for policy in teams:
        policy.reset(range(GAMES), rows)
    for _ in range(25):
        live = np.flatnonzero(~simulator.decided)
        for side, policy in enumerate(teams):
            answers = env.ask(policy, np.full(len(live), side), live)
            simulator.command_checked(side, answers, live, holds=True)
        for _ in range(config.step_ticks):
            before, trails = simulator.teams.copy(), simulator.games.trails
            cells = (GRID_CELLS * simulator.positions).astype(int)
            has_whole_rings = ((cells >= 4) & (cells < GRID_CELLS - 4)).all(axis=2)
            is_parked = (trails[:, :1] == trails).all(axis=1) & (trails[:, 0] >= 0) & has_whole_rings & (before == RED)
            simulator.advance(1)
            rests += is_parked.sum()
            assert not (is_parked & (simulator.teams == BLUE)).any()
    assert rests > 1000
