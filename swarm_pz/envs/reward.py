"""The reward: named terms, weighted in the configuration, exactly zero-sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig


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
        Games that the step decided, and those of them that red has won.

    Returns
    -------
    float64 array (E,)
        `size_change` times red's gain over the mean starting size of a team, plus `outcome` times
        +1 for a win or -1 for a loss.
    """
    outcome = np.where(decided, np.where(won, 1.0, -1.0), 0.0)
    return config.reward.size_change * (gained / (config.num_drones / 2)) + config.reward.outcome * outcome
