"""Learned policies: a network's weights as safetensors, and a JSON card; loading them runs no code."""

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
from swarm_pz.files import MOST_TEXT_BYTES, draft_of, read_bytes, write_json
from swarm_pz.policies.drones_network import DronesActor
from swarm_pz.policies.network import Actor
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.actions import command_from_action, make_actions

WEIGHTS, CARD = "policy.safetensors", "policy.json"
ANCESTORS = "ancestors"
"""On a card: the policies whose weights the training began with, the latest first, each with its own steps and seconds.
None stands for a number that is not known."""
FORMAT = 3
MOST_BYTES = 64 * 2**20
"""Largest size of the weights."""
_REMEDY = "get the policy again from where it came from, or train it again"
_ROWS = 32


def _is_cost(value: Any) -> bool:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return value is None or (is_number and 0 <= value < 1e15)


def _are_ancestors(value: Any) -> bool:
    return isinstance(value, list) and all(
        isinstance(one, dict)
        and set(one) == {"name", "steps", "seconds"}
        and isinstance(one["name"], str)
        and _is_cost(one["steps"])
        and _is_cost(one["seconds"])
        for one in value
    )


def _check_card(card: dict[str, Any], name: str) -> None:
    """Raise a CheckpointError if a card has another format, or if its ancestors are malformed."""
    if card.get("format") != FORMAT:
        raise CheckpointError(
            f"the card of policy {name!r} must be of format {FORMAT}, got {card.get('format')!r}; {_REMEDY}"
        )
    if not _are_ancestors(card.get(ANCESTORS, [])):
        raise CheckpointError(
            f"the card of policy {name!r} must have a list of name, steps and seconds as {ANCESTORS!r}, got "
            f"{card[ANCESTORS]!r:.200}; {_REMEDY}"
        )


def _digest(card: dict[str, Any], weights: dict[str, Tensor]) -> str:
    """Return a hash of card and weights, without the ancestors, which do not change the policy's actions."""
    story = {key: value for key, value in card.items() if key not in ("digest", ANCESTORS)}
    content = hashlib.sha256(json.dumps(story, sort_keys=True).encode())
    for name, values in sorted(weights.items()):
        content.update(f"{name} {tuple(values.shape)}".encode())
        content.update(values.float().numpy().tobytes())
    return content.hexdigest()[:32]


def lineage(card: dict[str, Any]) -> list[dict[str, Any]]:
    """Return name, steps and seconds of a policy's own training and of each ancestor's, the latest first.

    If a card names the policy that training started from, but no ancestors, that policy is one of unknown cost.
    """
    own = {name: card.get(name) for name in ("steps", "seconds")}
    start = card.get("training", {}).get("start_from")
    unknown = [] if start is None else [{"name": start, "steps": None, "seconds": None}]
    return [{"name": "", **own}, *card.get(ANCESTORS, unknown)]


def _network(card: dict[str, Any]) -> tuple[ObservationConfig, Actor | DronesActor]:
    """Return the observation and the network that a card describes."""
    if card.get("answers", "density") != "density":
        return ObservationConfig(kind="drones"), DronesActor(tuple(card["shape"]), card["head"], card["width"])
    observation = ObservationConfig(grid=card["grid"], channels=card["channels"])
    seen = (len(observation.channels), card["grid"], card["grid"])
    return observation, Actor(seen, card["action_cells"], card["width"])


class LearnedPolicy:
    """Plays the mean action of a trained actor; raises a CheckpointError if card or weights are corrupt.

    Parameters
    ----------
    card : dict
        The content of `policy.json`: format, width, config_hash, and, about the training, command, training (settings),
        steps, seconds, results. Policies for densities have channels, grid and action_cells, too; others have
        `answers`, and shape and head of `DronesActor`. A policy with a `system` commands only that system.
    weights : dict of array
        The actor's parameters by name.
    system : ControlSystem, optional
        The control system of its team; needed unless its commands are densities.
    """

    def __init__(
        self,
        card: dict[str, Any],
        weights: dict[str, Any],
        config: GameConfig,
        name: str,
        system: ControlSystem | None = None,
    ) -> None:
        _check_card(card, name)
        self.answers = str(card.get("answers", "density"))
        try:
            self.observation, self._actor = _network(card)
            self._actor.load_state_dict({name: torch.as_tensor(values) for name, values in weights.items()})
        except (SwarmError, ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as error:
            raise CheckpointError(f"the weights of policy {name!r} do not fit its card: {error!r}") from error
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
        self._actions = None if system is None else make_actions(config, system, "normalised", None)
        learned, taken = (
            getattr(self._actor, "shape", None),
            None if self._actions is None else self._actions.space.shape,
        )
        if system is not None and learned is not None and learned != taken:
            raise KindError(
                f"policy {name!r} has learned to send actions of shape {learned}, but {system.name} takes those of "
                f"shape {taken}: choose another policy, or the numbers that it was trained with"
            )
        self._generators: dict[int, np.random.Generator] = {}

    @classmethod
    def read(cls, folder: Path, config: GameConfig) -> LearnedPolicy:
        """Read the policy in a folder; raise a CheckpointError if files are missing, too large, corrupt or foreign."""
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
        except Exception as error:  # safetensors raises classes of its own
            raise CheckpointError(f"{folder} holds a corrupt or foreign policy: {error}") from error
        if not isinstance(card, dict):
            raise CheckpointError(f"{folder / CARD} must hold a JSON object, got {type(card).__name__}")
        policy = cls(card, weights, config, folder.name)
        if card.get("digest") != policy.digest:
            raise CheckpointError(
                f"{folder} was changed after it was written: its card names digest {card.get('digest')!r}, its content "
                f"has {policy.digest!r}; {_REMEDY}"
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
        """Return a copy of the actor, which maps observations in [0, 1], or rows of drones, to mean actions."""
        return copy.deepcopy(self._actor)

    def write(self, folder: Path) -> None:
        """Write the policy into a folder, the card last."""
        folder.mkdir(parents=True, exist_ok=True)
        weights = {name: values.numpy() for name, values in self._actor.state_dict().items()}
        # Not `save_file` of safetensors: only the owner could read the file.
        with draft_of(folder / WEIGHTS) as draft:
            draft.write_bytes(save(weights))
        card = self.card | {"digest": self.digest}
        write_json(folder / CARD, card)

    def with_results(self, results: dict[str, Any]) -> LearnedPolicy:
        """Return the same policy with results on its card."""
        return LearnedPolicy(self.card | {"results": results}, self.weights(), self._config, self.name, self._system)

    def for_system(self, system: ControlSystem) -> LearnedPolicy:
        """Return the policy for a team with a control system; raise a KindError if it cannot command that system."""
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
        """Return commands (n, ...) for observations (n, ...)."""
        # Rounding depends on the batch size, so it never varies: an action cannot depend on other games.
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
            raise KindError(f"policy {self.name!r} needs the control system of its team: load it by `load`")
        return self._actions.read(actions, count, f"the actions of policy {self.name}")
