"""What a run and the callbacks beside it both know: how it went so far, and how it explores."""

from __future__ import annotations

import json
import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from swarm_pz.training.config import TrainConfig

_RECENT = 256
"""Finished games over which the running figures are taken."""


@dataclass
class History:
    """How a run went: one record an evaluation.

    Attributes
    ----------
    records : list of dict
        step, seconds, and of `evaluation_games` games without exploration against the first
        opponent: win_rate, loss_rate, share and the interval of the win rate; of the latest training
        games, with exploration: training_share.
    seconds : float
        Time spent training, over all sittings.
    """

    records: list[dict[str, float]] = field(default_factory=list)
    seconds: float = 0.0

    def to_json(self) -> str:
        """Return the history as JSON."""
        return json.dumps({"seconds": self.seconds, "records": self.records})

    @classmethod
    def from_json(cls, text: str) -> History:
        """Read what `to_json` wrote."""
        plain = json.loads(text)
        return cls(records=list(plain["records"]), seconds=float(plain["seconds"]))


@dataclass
class RunState:
    """What has happened in a run.

    Attributes
    ----------
    config : TrainConfig
    history : History
    recent : deque of (bool, float)
        Of the latest games, with exploration: won, and the final share of drones.
    """

    config: TrainConfig
    history: History = field(default_factory=History)
    recent: deque[tuple[bool, float]] = field(default_factory=lambda: deque(maxlen=_RECENT))

    def exploration(self, steps: int) -> float:
        """Return the standard deviation that the learner explores with after so many steps."""
        done = min(steps / self.config.total_steps, 1.0)
        return math.exp(self.config.log_std + done * (self.config.final_log_std - self.config.log_std))

    def training_win_rate(self) -> float:
        """Return the fraction of the latest games won, with exploration."""
        return float(np.mean([won for won, _ in self.recent])) if self.recent else 0.0

    def training_share(self) -> float:
        """Return the mean final share of drones in the latest games, with exploration."""
        return float(np.mean([share for _, share in self.recent])) if self.recent else 0.0
