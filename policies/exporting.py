"""Trained networks as ONNX files: ours, and models of Stable-Baselines3."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import stable_baselines3
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.save_util import load_from_zip_file
from stable_baselines3.dqn.policies import DQNPolicy
from stable_baselines3.sac.policies import SACPolicy
from stable_baselines3.td3.policies import TD3Policy
from torch import Tensor, nn

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import CheckpointError, PolicyError
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.policies.onnx_network import ROWS
from swarm_pz.policies.onnx_policy import OnnxCard, write
from swarm_pz.policy.model_policy import format_of
from swarm_pz.spaces.formats import Format

OPSET = 18


class _Ours(nn.Module):
    """Maps images of bytes, or rows of drones, to actions in [-1, 1]."""

    def __init__(self, actor: nn.Module, *, bytes_: bool) -> None:
        super().__init__()
        self.actor, self.scale = actor, 255.0 if bytes_ else 1.0

    def forward(self, observations: Tensor) -> Tensor:
        actions: Tensor = self.actor(observations.float() / self.scale)
        return actions.clamp(-1.0, 1.0)


class _Theirs(nn.Module):
    """The deterministic action of a policy of SB3."""

    def __init__(self, policy: Any) -> None:
        super().__init__()
        self.policy = policy
        self.keys = sorted(policy.observation_space) if isinstance(policy.observation_space, spaces.Dict) else None
        space = policy.action_space
        if isinstance(space, spaces.Box):
            self.register_buffer("low", torch.as_tensor(space.low))
            self.register_buffer("high", torch.as_tensor(space.high))
        self.memory = (policy.lstm_actor.num_layers, policy.lstm_actor.hidden_size) if _remembers(policy) else None

    def forward(self, *given: Tensor) -> Any:
        count = 1 if self.keys is None else len(self.keys)
        seen = given[0] if self.keys is None else dict(zip(self.keys, given, strict=False))
        if self.memory is None:
            return self._limited(self._decided(seen))
        features = self.policy.extract_features(seen, self.policy.pi_features_extractor)
        hidden, cell = (part.swapaxes(0, 1).contiguous() for part in given[count:])
        latent, (hidden, cell) = self.policy.lstm_actor(features[None], (hidden, cell))
        means = self.policy.action_net(self.policy.mlp_extractor.forward_actor(latent[0]))
        return self._limited(means), hidden.swapaxes(0, 1), cell.swapaxes(0, 1)

    def _decided(self, seen: Any) -> Any:
        policy = self.policy
        if isinstance(policy, DQNPolicy):
            return policy.q_net(seen)
        if isinstance(policy, TD3Policy):
            return policy.actor(seen)
        if isinstance(policy, SACPolicy):
            return torch.tanh(policy.actor.get_action_dist_params(seen)[0])
        features = policy.extract_features(seen, policy.pi_features_extractor)
        answer = policy.action_net(policy.mlp_extractor.forward_actor(features))
        return torch.tanh(answer) if policy.squash_output else answer

    def _limited(self, answer: Tensor) -> Tensor:
        space = self.policy.action_space
        if not isinstance(space, spaces.Box):
            return answer
        low, high = self.get_buffer("low"), self.get_buffer("high")
        answer = answer.reshape(-1, *space.shape)
        if self.policy.squash_output:
            return low + 0.5 * (answer + 1.0) * (high - low)
        return answer.clamp(low, high)


def _remembers(policy: Any) -> bool:
    return isinstance(getattr(policy, "lstm_actor", None), nn.LSTM)


def export_learned(policy: LearnedPolicy, config: GameConfig, system: ControlSystem, folder: Path) -> None:
    """Write one of our own policies, for a game and a system, as an ONNX file with its card."""
    images, cells = policy.observation.kind == "grids", policy.card.get("action_cells")
    card = OnnxCard(
        name=policy.name,
        origin=f"the policy {policy.name!r} of swarm-pz, digest {policy.digest}",
        answers=policy.answers,
        system=str(policy.card.get("system", "")),
        observation=policy.observation,
        action="normalised",
        action_cells=cells if policy.answers == "density" else None,
    )
    actor = policy.network()
    space = card.format(config, system).observation_space
    write(folder, _traced(_Ours(actor, bytes_=images), {"observation": space}, {}), card, config)


def load_model(path: Path) -> Any:
    """Return the policy of a model that Stable-Baselines3 saved; loading such a pickle runs its code."""
    try:
        data, parts, _ = load_from_zip_file(path, device="cpu")
        settings = dict(data["policy_kwargs"])  # type: ignore[index]
        if data.get("use_sde"):  # type: ignore[union-attr]
            settings["use_sde"] = True
        seen, answered = data["observation_space"], data["action_space"]  # type: ignore[index]
        policy = data["policy_class"](seen, answered, lambda _: 0.0, **settings)  # type: ignore[index]
        policy.load_state_dict(parts["policy"])
    except Exception as error:  # a pickle may raise anything
        raise CheckpointError(f"{path} is no model that Stable-Baselines3 has saved: {error!r}") from error
    if not isinstance(policy, (ActorCriticPolicy, DQNPolicy, SACPolicy, TD3Policy)):
        raise CheckpointError(
            f"{path} holds a {type(policy).__name__}: expected a model of PPO, A2C, SAC, TD3, DDPG, DQN or RecurrentPPO"
        )
    policy.set_training_mode(False)
    return policy


def export_model(policy: Any, config: GameConfig, system: ControlSystem, folder: Path, name: str) -> None:
    """Write a policy of SB3, as of `load_model`, as ONNX; raise a PolicyError or CheckpointError if it cannot play."""
    observation, options = format_of(policy.observation_space, policy.action_space, config, system=system)
    shown = Format(config, observation, system, **options).observation_space
    if shown != policy.observation_space:
        raise PolicyError(f"{name} observes {policy.observation_space}, but in this game it would be shown {shown}")
    module = _Theirs(policy)
    state = {"hidden": "next_hidden", "cell": "next_cell"} if module.memory else {}
    card = OnnxCard(
        name=name,
        origin=f"{type(policy).__name__} of Stable-Baselines3 {stable_baselines3.__version__}",
        answers=system.takes,
        system="" if system.takes == "density" else system.name,
        observation=observation,
        state=state,
        **options,
    )
    entries = (
        {key: shown[key] for key in module.keys or ()} if isinstance(shown, spaces.Dict) else {"observation": shown}
    )
    memory = {key: spaces.Box(-1, 1, module.memory) for key in state} if module.memory else {}
    write(folder, _traced(module, entries | memory, state), card, config)


def _traced(module: nn.Module, inputs: dict[str, spaces.Space[Any]], state: dict[str, str]) -> bytes:
    """Return a network as an ONNX file for `ROWS` games, without traces of this machine."""
    examples = tuple(torch.as_tensor(np.zeros((ROWS, *(space.shape or ())), space.dtype)) for space in inputs.values())
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # it warns that torchvision is missing
    with warnings.catch_warnings(), torch.no_grad():
        warnings.simplefilter("ignore")  # about PyTorch's own code
        program = torch.onnx.export(
            module.eval(),
            examples,
            dynamo=True,
            opset_version=OPSET,
            input_names=list(inputs),
            output_names=["action", *state.values()],
            external_data=False,
            verbose=False,
        )
    model = program.model_proto  # type: ignore[union-attr]
    for part in _parts_of(model):  # these fields hold source lines and local paths
        for name in ("doc_string", "metadata_props"):
            if name in part.DESCRIPTOR.fields_by_name:
                part.ClearField(name)
    return bytes(model.SerializeToString(deterministic=True))


def _parts_of(message: Any) -> Iterator[Any]:
    """Yield a message of protobuf and all that it holds."""
    yield message
    for field, value in message.ListFields():
        if field.message_type is not None:
            for part in [value] if hasattr(value, "ListFields") else value:
                yield from _parts_of(part)
