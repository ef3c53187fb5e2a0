"""A network for lists of drones, in whatever order they come."""

from __future__ import annotations

import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn


class DroneSets(BaseFeaturesExtractor):
    """Deep sets (Zaheer et al., NeurIPS 2017): each drone by the same layers, then mean and maximum of each side."""

    def __init__(self, observation_space: spaces.Dict, width: int = 64) -> None:
        super().__init__(observation_space, 4 * width + 2)
        self.own, self.opposing = (
            nn.Sequential(nn.Linear(4, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU()) for _ in range(2)
        )

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return features (n, 4 width + 2) of n observations."""
        sides = [self._summary(side, observations) for side in ("own", "opposing")]
        return torch.cat([*sides, observations["own_share"], observations["time_left"]], dim=1)

    def _summary(self, side: str, observations: dict[str, Tensor]) -> Tensor:
        place, speed, mask = (observations[f"{side}_{name}"] for name in ("positions", "velocities", "mask"))
        there = mask.reshape(*place.shape[:2], 1).to(place.dtype)
        features = getattr(self, side)(torch.cat([2.0 * place - 1.0, 4.0 * speed], dim=2)) * there  # ReLU: 0 is least
        mean = features.sum(dim=1) / there.sum(dim=1).clamp(min=1.0)
        return torch.cat([mean, features.amax(dim=1)], dim=1)
