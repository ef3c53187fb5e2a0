"""Learned tactics: a network's weights as safetensors, and a JSON card that says how to play them.

Loading runs no code from the files: the card names numbers, the weights are arrays.
"""

from __future__ import annotations

import copy
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load, save
from torch import Tensor

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import CheckpointError, ConfigError, KindError, SwarmError
from swarm_pz.files import MOST_TEXT_BYTES, draft_of, read_bytes
from swarm_pz.policies.drones_network import DronesActor
from swarm_pz.policies.network import Actor
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.actions import command_from_action, make_actions

WEIGHTS, CARD = "policy.safetensors", "policy.json"
FORMAT = 3
MOST_BYTES = 64 * 2**20
"""Of the weights."""
_ROWS = 32


def _digest(card: dict[str, Any], weights: dict[str, Tensor]) -> str:
    """Return a hash of all that makes a policy."""
    story = {key: value for key, value in card.items() if key != "digest"}
    content = hashlib.sha256(json.dumps(story, sort_keys=True).encode())
    for name, values in sorted(weights.items()):
        content.update(f"{name} {tuple(values.shape)}".encode())
        content.update(values.float().numpy().tobytes())
    return content.hexdigest()[:32]


def _network(card: dict[str, Any]) -> tuple[ObservationConfig, Actor | DronesActor]:
    """Return what a policy sees, and the network that its card describes."""
    if card.get("answers", "density") != "density":
        shape = tuple(int(size) for size in card["shape"])
        return ObservationConfig(kind="drones"), DronesActor(shape, card["head"], card["width"])
    observation = ObservationConfig(grid=card["grid"], channels=card["channels"])
    seen = (len(observation.channels), card["grid"], card["grid"])
    return observation, Actor(seen, card["action_cells"], card["width"])


class LearnedPolicy:
    """Plays the mean action of a trained actor.

    Parameters
    ----------
    card : dict
        What `policy.json` holds: format, width, config_hash, and the story of the training: command, training (its
        settings), steps, seconds, results. Of a policy that answers densities, channels, grid and action_cells, too; of
        others `answers`, the shape of its actions, and head, as of `DronesActor`. If it names a `system`, no other is
        commanded.
    weights : dict of array
        The actor's parameters by name.
    config : GameConfig
        The game that it will play.
    name : str
    system : ControlSystem, optional
        What flies its team; only who answers densities can do without.

    Attributes
    ----------
    answers : str
        The kind of its commands.
    noise : float
        Standard deviation of noise on its actions, 0 unless it is to be a learner's partner that explores
        as the learner does.

    Raises
    ------
    CheckpointError
        If the card or the weights are not such as training writes.
    """

    def __init__(
        self,
        card: dict[str, Any],
        weights: dict[str, Any],
        config: GameConfig,
        name: str,
        system: ControlSystem | None = None,
    ) -> None:
        self.answers = str(card.get("answers", "density"))
        of_kind = {"grid", "action_cells", "channels"} if self.answers == "density" else {"shape", "head"}
        missing = {"format", "width", *of_kind} - set(card)
        if missing:
            raise CheckpointError(f"a policy's card must hold {sorted(missing)}, got only {sorted(card)}")
        if card["format"] != FORMAT:
            raise CheckpointError(f"the card of policy {name!r} must be of format {FORMAT}, got {card['format']!r}")
        try:
            self.observation, self._actor = _network(card)
            self._actor.load_state_dict({name: torch.as_tensor(values) for name, values in weights.items()})
        except (SwarmError, ArithmeticError, RuntimeError, TypeError, ValueError) as error:
            raise CheckpointError(f"the weights of policy {name!r} do not fit its card: {error}") from error
        if not all(bool(torch.isfinite(values).all()) for values in self._actor.state_dict().values()):
            raise CheckpointError(f"the weights of policy {name!r} must be finite numbers, got NaN or infinity")
        if isinstance(self._actor, Actor):
            self._actor.freeze()
        self.name = name
        self.card = card
        self.digest = _digest(card, self.weights())
        """Identifies card and weights together."""
        self.noise = 0.0
        self._config, self._system = config, system
        self._actions = None if system is None else make_actions(config, system, "normalised", None, flat=False)
        self._check_shape()
        self._generators: dict[int, np.random.Generator] = {}

    @classmethod
    def read(cls, folder: Path, config: GameConfig) -> LearnedPolicy:
        """Read the policy in a folder.

        Raises
        ------
        CheckpointError
            If files are missing, too large, corrupt or foreign.
        """
        files = []
        for name, most in ((WEIGHTS, MOST_BYTES), (CARD, MOST_TEXT_BYTES)):
            if not (folder / name).exists():
                raise CheckpointError(f"{folder} must hold {WEIGHTS} and {CARD}, {name} is missing")
            try:
                files.append(read_bytes(folder / name, most))
            except ConfigError as error:
                raise CheckpointError(f"{folder / name} {error}") from error
        try:
            weights, card = load(files[0]), json.loads(files[1])
        except Exception as error:  # safetensors raises its own kinds, none of them public
            raise CheckpointError(f"{folder} holds a corrupt or foreign policy: {error}") from error
        if not isinstance(card, dict):
            raise CheckpointError(f"{folder / CARD} must hold a JSON object, got {type(card).__name__}")
        policy = cls(card, weights, config, folder.name)
        if card.get("digest") != policy.digest:
            raise CheckpointError(
                f"{folder} was changed after it was written: its card names digest {card.get('digest')!r}, its content "
                f"has {policy.digest!r}; get it again from where it came from"
            )
        try:
            rules = GameConfig.from_dict(card["training"]["game"])
        except (SwarmError, LookupError, TypeError) as error:
            raise CheckpointError(f"the card in {folder} does not say what game it was trained on: {error}") from error
        if rules.hash != card.get("config_hash"):
            raise CheckpointError(
                f"the card in {folder} names config_hash {card.get('config_hash')!r}, its rules have {rules.hash!r}"
            )
        return policy

    def weights(self) -> dict[str, Tensor]:
        """Return the actor's parameters by name."""
        return {name: values.clone() for name, values in self._actor.state_dict().items()}

    def network(self) -> Actor | DronesActor:
        """Return the actor: from observations in [0, 1], or rows of drones, to mean actions."""
        return copy.deepcopy(self._actor)

    def write(self, folder: Path) -> None:
        """Write the policy into a folder, the card last, so that a card never stands alone."""
        folder.mkdir(parents=True, exist_ok=True)
        weights = {name: values.numpy() for name, values in self._actor.state_dict().items()}
        # Not its `save_file`, whose files nobody but their owner may read.
        with draft_of(folder / WEIGHTS) as draft:
            draft.write_bytes(save(weights))
        card = self.card | {"digest": self.digest}
        with draft_of(folder / CARD) as draft:
            draft.write_text(json.dumps(card, indent=2) + "\n")

    def with_results(self, results: dict[str, Any]) -> LearnedPolicy:
        """Return the same policy with results on its card."""
        return LearnedPolicy(self.card | {"results": results}, self.weights(), self._config, self.name, self._system)

    def _check_shape(self) -> None:
        if self._system is None or self._actions is None or isinstance(self._actor, Actor):
            return
        learned, taken = self._actor.shape, self._actions.space.shape
        if learned != taken:
            raise KindError(
                f"policy {self.name!r} has learned to send actions of shape {learned}, but {self._system.name} takes "
                f"those of shape {taken}: choose another policy, or the numbers that it was trained with"
            )

    def for_system(self, system: ControlSystem) -> LearnedPolicy:
        """Return the policy that commands a team flown by a system; itself, if its commands are densities.

        Raises
        ------
        KindError
            If it has learned to command another system, or its actions have another shape.
        """
        if (learned := self.card.get("system", system.name)) != system.name:
            raise KindError(
                f"policy {self.name!r} has learned to command {learned}, and not {system.name}: choose another policy, "
                f"or another system by GameConfig.controllers"
            )
        if self.answers == "density" or system == self._system:
            return self
        return LearnedPolicy(self.card, self.weights(), self._config, self.name, system)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, each with a random stream of its own."""
        if self.noise:
            self._generators |= {
                row: np.random.default_rng(seed) for seed, row in zip(seeds, rows.tolist(), strict=True)
            }

    def act(self, observations: NDArray[Any], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer observations (n, ...) with commands (n, ...)."""
        # Always the same number of rows: another one would round differently, and a game would depend
        # on how many others are played beside it.
        count = len(observations)
        padded = np.zeros((-(-count // _ROWS) * _ROWS, *observations.shape[1:]), observations.dtype)
        padded[:count] = observations
        with torch.inference_mode():
            seen = torch.from_numpy(padded).float() / (255.0 if padded.dtype == np.uint8 else 1.0)
            parts = [self._actor(seen[start : start + _ROWS]) for start in range(0, len(seen), _ROWS)]
            actions = torch.cat(parts)[:count].double().numpy()
        if self.noise:
            shape = actions.shape[1:]
            actions += self.noise * np.stack([self._generators[row].normal(size=shape) for row in rows.tolist()])
        actions = actions.clip(-1.0, 1.0)
        if self.answers == "density":
            return command_from_action(actions, self._config.command_cells, is_log=True)
        if self._actions is None:
            raise KindError(f"policy {self.name!r} must be told which control system flies its team: load it by `load`")
        return self._actions.read(actions, count, f"the actions of policy {self.name}")
