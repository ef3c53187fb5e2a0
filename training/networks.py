"""The network that PPO trains: the actor that later plays alone, and a critic beside it."""

from __future__ import annotations

from typing import Any, cast

import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.policies.drones_network import COLUMNS, DronesActor, head_of
from swarm_pz.policies.learned import FORMAT, LearnedPolicy
from swarm_pz.policies.network import Actor, Critic
from swarm_pz.training.config import TrainConfig

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
        return _flat(features), self.critic(features)

    def forward_actor(self, observations: Tensor) -> Tensor:
        return _flat(self.trunk(observations))

    def forward_critic(self, observations: Tensor) -> Tensor:
        value: Tensor = self.critic(self.trunk(observations))
        return value


def _flat(features: Tensor) -> Tensor:
    """Turn features (n, width, a, a) into those that SB3 wants, flat, in the order in which they lie in memory."""
    return features.permute(0, 2, 3, 1).flatten(1)


class _Decide(nn.Module):
    """The actor's last layer, from flat features."""

    def __init__(self, actor: Actor, cells: int, width: int) -> None:
        super().__init__()
        self.head = actor.head
        self._decide = actor.decide
        self._shape = (cells, cells, width)

    def forward(self, features: Tensor) -> Tensor:
        return self._decide(features.reshape(-1, *self._shape).permute(0, 3, 1, 2)).flatten(1)


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


class _DronesHeads(nn.Module):
    """As `_Heads` for an actor that looks at drones."""

    def __init__(self, actor: DronesActor, drones: int) -> None:
        super().__init__()
        self._reader, self._shape = [actor], (drones, COLUMNS)  # in a list: its weights are the policy's already
        rows = actor.features(torch.zeros(1, *self._shape)).shape[1]
        self.latent_dim_pi, self.latent_dim_vf = rows * actor.width, actor.width
        self.critic = nn.Sequential(nn.Linear(2 * actor.width + 2, actor.width), nn.Tanh())

    def forward(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        return self.forward_actor(observations), self.forward_critic(observations)

    def forward_actor(self, observations: Tensor) -> Tensor:
        return self._reader[0].features(observations.reshape(-1, *self._shape)).flatten(1)

    def forward_critic(self, observations: Tensor) -> Tensor:
        value: Tensor = self.critic(self._reader[0].summary(observations.reshape(-1, *self._shape)))
        return value


class _DecideRows(nn.Module):
    """As `_Decide` for an actor that looks at drones."""

    def __init__(self, actor: DronesActor) -> None:
        super().__init__()
        self.head = actor.head
        self._actor = [actor]

    def forward(self, features: Tensor) -> Tensor:
        actor = self._actor[0]
        rows = features.shape[1] // actor.width
        return actor.decide(features.reshape(-1, rows, actor.width)).flatten(1)


class DronesPolicy(ActorCriticPolicy):
    """SB3 actor-critic whose observation is a row for each drone and whose action is any Box.

    Parameters
    ----------
    *args, **kwargs
        Of `ActorCriticPolicy`.
    width : int
        Features of the hidden layers.

    Attributes
    ----------
    actor : DronesActor
        The part that plays.
    """

    def __init__(self, *args: Any, width: int = 32, **kwargs: Any) -> None:
        self.width = width
        super().__init__(*args, **kwargs)

    def _build_mlp_extractor(self) -> None:
        drones, shape = (
            cast("tuple[int, int]", self.observation_space.shape)[0],
            cast("tuple[int, ...]", self.action_space.shape),
        )
        self.actor = DronesActor(shape, head_of(shape, drones), self.width)
        self.mlp_extractor = _DronesHeads(self.actor, drones)  # type: ignore[assignment]

    def _build(self, lr_schedule: Any) -> None:
        super()._build(lr_schedule)
        nn.init.orthogonal_(self.actor.head.weight, gain=0.01)
        nn.init.zeros_(self.actor.head.bias)
        self.action_net = _DecideRows(self.actor)
        self.optimizer = self.optimizer_class(self.parameters(), lr=lr_schedule(1), **self.optimizer_kwargs)  # type: ignore[call-arg]


def policy_class(game: GameConfig) -> type[GridPolicy] | type[DronesPolicy]:
    """Return the network that learns to command the first of a game's control systems."""
    return GridPolicy if game.team_systems[0].takes == "density" else DronesPolicy


def card_of(network: GridPolicy | DronesPolicy, game: GameConfig) -> dict[str, Any]:
    """Return what the card of a policy must say for the network to be made again."""
    system = game.team_systems[0]
    named = {} if system.name == "ergodic" else {"system": system.name}  # whose densities others take, too
    if isinstance(network, DronesPolicy):
        actor = network.actor
        seen: dict[str, Any] = {"answers": system.takes, "shape": list(actor.shape), "head": actor.kind}
    else:
        observation = game.observations[0]
        cells = network.action_space.shape[-1]  # type: ignore[index]
        seen = {"channels": list(observation.channels), "grid": observation.grid, "action_cells": cells}
    return named | seen | {"width": network.width}


def as_policy(
    network: GridPolicy | DronesPolicy,
    config: TrainConfig,
    name: str,
    *,
    steps: int = 0,
    seconds: float = 0.0,
    command: str = "",
) -> LearnedPolicy:
    """Return the tactic of a network as it stands: it plays, and `write` makes the folder that others start from.

    Parameters
    ----------
    network : GridPolicy or DronesPolicy
    config : TrainConfig
        What it was trained with; its game and width are the network's.
    name : str
    steps, seconds : int, float
        That it was trained for.
    command : str
        What was called.
    """
    card = {
        "format": FORMAT,
        **card_of(network, config.game),
        "config_hash": config.game.hash,
        **provenance(config.game, command),
        "training": config.to_dict(),
        "steps": steps,
        "seconds": round(seconds, 1),
    }
    weights = {key: value.detach().clone().numpy() for key, value in network.actor.state_dict().items()}
    return LearnedPolicy(card, weights, config.game, name, config.game.team_systems[0])
