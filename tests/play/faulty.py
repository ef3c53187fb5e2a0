"""Policies that fail as their names say, at their second command."""

import os
import time

import numpy as np

from swarm_pz.config import ObservationConfig
from swarm_pz.policy import load

FAULTS = ("raises", "nan", "sleeps", "exits")


class Faulty:
    observation = ObservationConfig(grid=10)

    def __init__(self, fault):
        self.fault, self.count = fault, 0

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        self.count += 1
        answer = np.full((len(rows), 10, 10), 1.0 / self.count)
        if self.count == 3:  # the first is asked for when the policy is loaded
            if self.fault == "raises":
                raise RuntimeError("no idea")
            if self.fault == "nan":
                answer[:] = np.nan
            if self.fault == "sleeps":
                time.sleep(10)
            if self.fault == "exits":
                os._exit(3)
        return answer


def loader(name, config, system):
    """Load a policy, faulty ones included."""
    return Faulty(name) if name in FAULTS else load(name, config, system)
