"""The network that PPO trains: the actor that later plays alone, and a critic beside it."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from swarm_pz.policies.network import Actor, Critic

_CRITIC_FEATURES = 16


class _Heads(nn.Module):
    """What SB3 calls the MLP extractor: latent features of the actor and of the critic."""

    def __init__(self, actor: Actor, cells: int, width: int) -> None:
        super().__init__()
        self.trunk = actor.trunk
        self.latent_dim_pi, self.latent_dim_vf = width * cells**2, _CRITIC_FEATURES
        self.critic = Critic(cells, width, _CRITIC_FEATURES)

    def forward(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        features = self.trunk(observations)
        return features.flatten(1), self.critic(features)

    def forward_actor(self, observations: Tensor) -> Tensor:
        features: Tensor = self.trunk(observations)
        return features.flatten(1)

    def forward_critic(self, observations: Tensor) -> Tensor:
        value: Tensor = self.critic(self.trunk(observations))
        return value


class _Decide(nn.Module):
    """The actor's last layer, from features that SB3 wants flat."""

    def __init__(self, actor: Actor, cells: int, width: int) -> None:
        super().__init__()
        self.head = actor.head
        self._decide = actor.decide
        self._shape = (width, cells, cells)

    def forward(self, features: Tensor) -> Tensor:
        return self._decide(features.reshape(-1, *self._shape)).flatten(1)


class GridPolicy(ActorCriticPolicy):
    """SB3 actor-critic whose action is an image: one convolutional trunk, one output a cell.

    Parameters
    ----------
    *args, **kwargs
        Of `ActorCriticPolicy`.
    width : int
        Channels of the hidden layers, a multiple of eight.

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
        self.mlp_extractor = _Heads(self.actor, cells, self.width)  # type: ignore[assignment]

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        cells = self.action_space.shape[-1]  # type: ignore[index]
        # SB3 initialises what it knows; the actor's head comes in its place, with a small start, so
        # that the untrained tactic is close to uniform coverage.
        nn.init.orthogonal_(self.actor.head.weight, gain=0.01)
        nn.init.zeros_(self.actor.head.bias)  # type: ignore[arg-type]
        self.action_net = _Decide(self.actor, cells, self.width)
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]
