"""The networks that PPO trains: the actor that later plays alone, and a critic beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.policies.drones_network import COLUMNS, DronesActor, head_of
from swarm_pz.policies.learned import ANCESTORS, FORMAT, LearnedPolicy
from swarm_pz.policies.network import Actor, Critic
from swarm_pz.training.config import TrainConfig

_CRITIC_FEATURES = 16


class _GridFeatures(nn.Module):
    """Flat latent features of the actor and of the critic: SB3's MLP extractor."""

    def __init__(self, actor: Actor, cells: int, width: int) -> None:
        super().__init__()
        self.trunk = actor.trunk
        self.latent_dim_pi, self.latent_dim_vf = width * cells**2, _CRITIC_FEATURES
        self.critic = Critic(cells, width, _CRITIC_FEATURES)

    def forward(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        features = self.trunk(observations)
        return self._flat(features), self.critic(features)

    def forward_actor(self, observations: Tensor) -> Tensor:
        return self._flat(self.trunk(observations))

    def forward_critic(self, observations: Tensor) -> Tensor:
        return self.critic(self.trunk(observations))  # type: ignore[no-any-return]

    @staticmethod
    def _flat(features: Tensor) -> Tensor:
        return features.movedim(1, -1).flatten(1)  # in the order in which they lie in memory


class _DronesFeatures(nn.Module):
    """As `_GridFeatures` for an actor that looks at drones."""

    def __init__(self, actor: DronesActor, drones: int) -> None:
        super().__init__()
        self._actor, self._shape = [actor], (drones, COLUMNS)  # a list: the policy holds these weights already
        rows = actor.features(torch.zeros(1, *self._shape)).shape[1]
        self.latent_dim_pi, self.latent_dim_vf = rows * actor.width, actor.width
        self.critic = nn.Sequential(nn.Linear(2 * actor.width + 2, actor.width), nn.Tanh())

    def forward(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        return self.forward_actor(observations), self.forward_critic(observations)

    def forward_actor(self, observations: Tensor) -> Tensor:
        return self._actor[0].features(observations.reshape(-1, *self._shape)).flatten(1)

    def forward_critic(self, observations: Tensor) -> Tensor:
        return self.critic(self._actor[0].summary(observations.reshape(-1, *self._shape)))  # type: ignore[no-any-return]


class _Decide(nn.Module):
    """The actor's last layer, for flat features, which it reshapes to (cells, cells, width) or (-1, width)."""

    def __init__(self, actor: Actor | DronesActor, shape: tuple[int, ...]) -> None:
        super().__init__()
        self.head = actor.head
        self._actor, self._shape = [actor], shape

    def forward(self, features: Tensor) -> Tensor:
        parts = features.reshape(len(features), *self._shape)
        return self._actor[0].decide(parts.movedim(-1, 1) if parts.ndim == 4 else parts).flatten(1)


class _ActorPolicy(ActorCriticPolicy):
    """SB3 actor-critic around an actor."""

    actor: Actor | DronesActor
    _shape: tuple[int, ...]
    """Shape of the actor's features, which SB3 passes on flat."""

    def __init__(self, *args: Any, width: int = 32, **kwargs: Any) -> None:
        self.width = width
        super().__init__(*args, **kwargs)

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        # The actor's head replaces SB3's action net. Its small initial weights keep the untrained tactic close to
        # uniform coverage.
        nn.init.orthogonal_(self.actor.head.weight, gain=0.01)
        nn.init.zeros_(cast("Tensor", self.actor.head.bias))
        self.action_net = _Decide(self.actor, self._shape)
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]


class GridPolicy(_ActorPolicy):
    """SB3 actor-critic whose action is an image: one convolutional trunk, one output a cell.

    `width` is the number of channels of hidden layers, a multiple of eight.
    """

    actor: Actor

    def _build_mlp_extractor(self) -> None:
        cells, _ = cast("tuple[int, int]", self.action_space.shape)
        self._shape = cells, cells, self.width
        self.actor = Actor(self.observation_space.shape, cells, self.width)  # type: ignore[arg-type]
        self.mlp_extractor = _GridFeatures(self.actor, cells, self.width)  # type: ignore[assignment]


class DronesPolicy(_ActorPolicy):
    """SB3 actor-critic whose observation is a row for each drone and whose action is any Box."""

    actor: DronesActor

    def _build_mlp_extractor(self) -> None:
        drones, shape = self.observation_space.shape[0], cast("tuple[int, ...]", self.action_space.shape)  # type: ignore[index]
        self.actor = DronesActor(shape, head_of(shape, drones), self.width)
        self.mlp_extractor = _DronesFeatures(self.actor, drones)  # type: ignore[assignment]
        self._shape = -1, self.width


def policy_class(game: GameConfig) -> type[GridPolicy] | type[DronesPolicy]:
    """Return the network that learns to command the first of a game's control systems."""
    return GridPolicy if game.team_systems[0].takes == "density" else DronesPolicy


def as_policy(
    network: GridPolicy | DronesPolicy,
    config: TrainConfig,
    name: str,
    *,
    steps: int = 0,
    seconds: float = 0.0,
    command: str = "",
    ancestors: Sequence[dict[str, Any]] = (),
) -> LearnedPolicy:
    """Return the tactic of a network; its card records steps and seconds of training, command and ancestors."""
    game = config.game
    system, observation = game.team_systems[0], game.observations[0]
    if isinstance(network, DronesPolicy):
        actor = network.actor
        made: dict[str, Any] = {"answers": system.takes, "shape": list(actor.shape), "head": actor.kind}
    else:
        cells, *_ = cast("tuple[int, int]", network.action_space.shape)
        made = {"channels": list(observation.channels), "grid": observation.grid, "action_cells": cells}
    card = {
        "format": FORMAT,
        **({} if system.name == "ergodic" else {"system": system.name}),  # other systems take densities, too
        **made,
        "width": network.width,
        "config_hash": game.hash,
        **provenance(game, command),
        "training": config.to_dict(),
        "steps": steps,
        "seconds": round(seconds, 1),
        **({ANCESTORS: list(ancestors)} if ancestors else {}),
    }
    weights = {key: value.detach().clone().numpy() for key, value in network.actor.state_dict().items()}
    return LearnedPolicy(card, weights, game, name, system)
