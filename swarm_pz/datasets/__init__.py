"""Games as datasets to learn from, in the format of Minari: who played, what they saw, what they did, what came of it.

An episode is one game as one seat saw it, with observations and actions as environments write them. A match's
episodes are games of the Gymnasium environment: the seed of an episode and its actions give it again.
"""

from swarm_pz.datasets.matches import record_match
from swarm_pz.datasets.tables import record_table

__all__ = ["record_match", "record_table"]
