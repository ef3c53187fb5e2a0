"""The reward: named terms, weighted in the configuration, exactly zero-sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, GameConfig


def red_rewards(
    config: GameConfig, gained: NDArray[np.int64], decided: NDArray[np.bool_], won: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return red's reward of a step; blue's is its negative.

    Parameters
    ----------
    config : GameConfig
    gained : int64 array (E,)
        Drones that red has more than before the step.
    decided, won : bool array (E,)
        Whether the step decided the game, and then whether red has won it.

    Returns
    -------
    float64 array (E,)
        `size_change` times red's gain over the mean starting size of a team, plus `outcome` times
        +1 for a win or -1 for a loss.
    """
    outcome = np.where(decided, np.where(won, 1.0, -1.0), 0.0)
    return config.reward.size_change * (gained / (config.num_drones / 2)) + config.reward.outcome * outcome


def drone_rewards(
    config: GameConfig,
    rewards: NDArray[np.float64],
    flew: NDArray[np.bool_],
    teams_before: NDArray[np.int8],
    teams_after: NDArray[np.int8],
    captured_at: NDArray[np.int64],
    decided: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Return what each drone (E, N) gets of its team's reward of a step.

    All of it; but a drone that is captured in the step gets what its team had got to that tick, and one that sat
    out nothing. A drone that changes sides twice in one step was never away.

    Parameters
    ----------
    config : GameConfig
    rewards : float64 array (E, 2)
        Of the step, red's and blue's.
    flew : bool array (E, N)
        Whether each drone's agent played when the step began.
    teams_before, teams_after : int8 array (E, N)
    captured_at : int64 array (E, N)
        Tick in which each drone was captured last.
    decided : bool array (E,)
        Whether the step decided the game; the last capture did it.
    """
    shares = np.where(flew, np.take_along_axis(rewards, teams_before.astype(np.int64), axis=1), 0.0)
    changed = teams_after != teams_before
    games, drones = np.nonzero(flew & changed)
    tick, side = captured_at[games, drones], teams_before[games, drones]
    until = changed[games] & (captured_at[games] <= tick[:, None])
    gained = np.where(until, teams_before[games].astype(np.int64) - teams_after[games], 0).sum(axis=1)
    last = decided[games] & (tick == captured_at[games].max(axis=1))
    red = red_rewards(config, gained, last, teams_after[games, 0] == RED)
    shares[games, drones] = np.where(side == BLUE, 0.0 - red, red)
    return shares
