"""The network that PPO trains: the actor that later plays alone, and a critic beside it."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from policies.learned import Actor


class _Heads(nn.Module):
    """What SB3 calls the MLP extractor: latent features of the actor and of the critic."""

    def __init__(self, actor: Actor, features: int) -> None:
        super().__init__()
        self.trunk = actor.trunk
        self.latent_dim_pi, self.latent_dim_vf = features, 128
        self.value = nn.Sequential(nn.Linear(features, self.latent_dim_vf), nn.ReLU())

    def forward(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        latent = self.forward_actor(observations)
        return latent, self.value(latent)

    def forward_actor(self, observations: Tensor) -> Tensor:
        features: Tensor = self.trunk(observations)
        return features.flatten(1)

    def forward_critic(self, observations: Tensor) -> Tensor:
        value: Tensor = self.value(self.forward_actor(observations))
        return value


class GridPolicy(ActorCriticPolicy):
    """SB3 actor-critic whose action is an image: one convolutional trunk, one output a cell.

    Parameters
    ----------
    *args, **kwargs
        Of `ActorCriticPolicy`.
    width : int
        Channels of the hidden layers.

    Attributes
    ----------
    actor : Actor
        The part that plays.
    """

    def __init__(self, *args: Any, width: int = 32, **kwargs: Any) -> None:
        self.width = width
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        cells = self.action_space.shape[-1]  # type: ignore[index]
        self.actor = Actor(self.observation_space.shape, cells, self.width)  # type: ignore[arg-type]
        self.mlp_extractor = _Heads(self.actor, self.width * cells * cells)  # type: ignore[assignment]

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        cells = self.action_space.shape[-1]  # type: ignore[index]
        # SB3 initialises what it knows; the actor's head comes in its place, with a small start, so
        # that the untrained tactic is close to uniform coverage.
        nn.init.orthogonal_(self.actor.head.weight, gain=0.01)
        nn.init.zeros_(self.actor.head.bias)  # type: ignore[arg-type]
        self.action_net = nn.Sequential(nn.Unflatten(1, (self.width, cells, cells)), self.actor.head, nn.Flatten())
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]
