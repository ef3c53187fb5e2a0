"""Networks: for lists of drones, in whatever order they come, and with a memory."""

from __future__ import annotations

import torch
from gymnasium import spaces
from sb3_contrib.common.recurrent.policies import RecurrentActorCriticPolicy
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


class WholeSequences(RecurrentActorCriticPolicy):
    """`MlpLstmPolicy`, but faster: RecurrentPPO cuts sequences where games begin, so each is one call of the LSTM."""

    @staticmethod
    def _process_sequence(
        features: Tensor, lstm_states: tuple[Tensor, Tensor], episode_starts: Tensor, lstm: nn.LSTM
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        count = lstm_states[0].shape[1]
        goes_on = 1.0 - episode_starts.reshape(count, -1)[:, 0].view(1, count, 1)
        hidden, cell = (goes_on * state for state in lstm_states)
        found, states = lstm(features.reshape(count, -1, lstm.input_size).swapaxes(0, 1), (hidden, cell))
        return found.swapaxes(0, 1).flatten(0, 1), states
