"""The reward: named terms, weighted in the configuration, exactly zero-sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import RED, GameConfig


def red_rewards(
    config: GameConfig, sizes_before: NDArray[np.int64], sizes_after: NDArray[np.int64], decided: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return red's reward of a step; blue's is its negative.

    Parameters
    ----------
    config : GameConfig
    sizes_before, sizes_after : int64 array (E, 2)
        Drones of each team before and after the step.
    decided : bool array (E,)
        Whether the step decided the game.

    Returns
    -------
    float64 array (E,)
        `size_change` times red's gain over the mean starting size of a team, plus `outcome` times
        +1 for a win or -1 for a loss.
    """
    gain = (sizes_after - sizes_before)[:, RED] / (config.num_drones / 2)
    won = np.where(sizes_after[:, RED] > 0, 1.0, -1.0)
    return np.asarray(config.reward.size_change * gain + config.reward.outcome * np.where(decided, won, 0.0))
