"""Policies from any framework: a neural network as an ONNX file, and a JSON card with its inputs and outputs.

Nothing in such a folder is run as code: a separate process does the model's arithmetic, and the card is data.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, Range, check
from swarm_pz.config.constants import GRID_CELLS
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import (
    CheckpointError,
    ConfigError,
    ForfeitError,
    KindError,
    OutputError,
    PolicyError,
    SwarmError,
)
from swarm_pz.files import check_folder, draft_of, read_bytes
from swarm_pz.policies.onnx_network import MOST_BYTES, Arrays, Network, TensorSpec
from swarm_pz.policy import load
from swarm_pz.policy.program import TOO_SLOW, GameClock
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.formats import Format
from swarm_pz.spaces.observation import Observations
from swarm_pz.systems.ergodic import Ergodic

MODEL, CARD = "policy.onnx", "policy.json"
FORMAT = "onnx-1"
_MOST_CARD = 2**16
_GET_AGAIN = "get it again from where it came from, or write it by swarm_pz.policies.onnx_policy.write"


@dataclass(frozen=True, kw_only=True)
class OnnxCard(Config):
    """A model's card: its observations, and the form of its outputs."""

    _section: ClassVar[str] = "card"

    name: str = ""
    """Name in tables."""
    origin: str = ""
    """The author, and how the model was made."""
    answers: str = "density"
    """The kind of its commands, as `ControlSystem.takes`."""
    system: str = ""
    """The control system that it commands; if empty, any that takes such commands."""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    action: ActionKind = "normalised"
    """As of `Format`; outputs are clipped to its limits. A discrete output is a command's number, or a value for each
    command, of which the largest counts."""
    action_cells: Annotated[int, Range(2, GRID_CELLS)] | None = None
    state: Mapping[str, str] = field(default_factory=dict)
    """Memory: inputs, and the outputs that are fed to them at the next step; zeros at first."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("name", "origin", "answers", "system"):
            value = getattr(self, name)
            check(len(value) <= 2000 and value.isprintable(), f"card.{name}", value, "a line of text")
        for name in ("name", "answers"):
            check(bool(getattr(self, name)), f"card.{name}", "", "a line of text that is not empty")
        outputs = list(self.state.values())
        is_map = all(isinstance(name, str) for name in outputs) and len(set(outputs)) == len(outputs)
        check(is_map, "card.state", self.state, "inputs to outputs")

    def format(self, config: GameConfig, system: ControlSystem) -> Format:
        """Return the format of a game's observations and of the model's outputs."""
        return Format(config, self.observation, system, action=self.action, action_cells=self.action_cells)


def digest_of(card: OnnxCard, model: bytes) -> str:
    """Return a hash of card and model."""
    content = hashlib.sha256(json.dumps(card.to_dict(), sort_keys=True).encode())
    content.update(model)
    return content.hexdigest()[:32]


def read_files(folder: Path) -> tuple[OnnxCard, bytes]:
    """Return a folder's card and model; raise a CheckpointError for links, and for changed or missing files."""
    text, model = _read(folder / CARD, _MOST_CARD), _read(folder / MODEL, MOST_BYTES)
    try:
        said = json.loads(text)
        form, digest = said.pop("format", None), said.pop("digest", None)
    except (ValueError, RecursionError, AttributeError, TypeError) as error:
        raise CheckpointError(f"{folder / CARD} is no card: expected a JSON object ({error})") from error
    if form != FORMAT:
        raise CheckpointError(f"the card in {folder} must be of format {FORMAT!r}, got {form!r}")
    try:
        card = OnnxCard.from_dict(said)
    except (SwarmError, TypeError) as error:
        raise CheckpointError(f"the card in {folder} cannot be used: {error}; {_GET_AGAIN}") from error
    if digest != (found := digest_of(card, model)):
        raise CheckpointError(
            f"{folder} was changed after it was written: its card has the digest {digest!r}, its content {found!r}; "
            f"{_GET_AGAIN}"
        )
    return card, model


def _read(path: Path, most: int) -> bytes:
    """Return the content of a file; links are refused."""
    if not (path.exists() or path.is_symlink()):
        found = ", ".join(sorted(one.name for one in path.parent.glob("*.*"))[:9])
        raise CheckpointError(
            f"{path.parent} must hold {CARD} and {MODEL} or policy.safetensors, it has no {path.name}, but {found}"
        )
    try:
        return read_bytes(path, most, links=False)
    except ConfigError as error:
        raise CheckpointError(f"{path} {error}") from error


class OnnxPolicy:
    """Plays a model from an ONNX file for a team with control system `system`, which models of densities do not need.

    Raises a CheckpointError if inputs and outputs do not fit the card or the game.
    """

    def __init__(
        self, card: OnnxCard, network: Network, config: GameConfig, system: ControlSystem | None = None
    ) -> None:
        self.card, self.name, self.answers, self.observation = card, card.name, card.answers, card.observation
        self.network, self.digest = network, digest_of(card, network.data)
        self._config, self._system = config, system
        self._format: Format | None = None
        self._states: dict[int, Arrays] = {}
        self._clock = GameClock()
        signature, state = network.signature, card.state
        for what, named, there in (("input", state, signature.inputs), ("output", state.values(), signature.outputs)):
            if missing := set(named) - set(there):
                raise self._lie(f"the {what}s of its state are {sorted(missing)}, the model has {sorted(there)}")
        for taken, given in state.items():
            if signature.inputs[taken] != signature.outputs[given]:
                raise self._lie(
                    f"{given!r} becomes {taken!r}, but is {signature.outputs[given]} and not {signature.inputs[taken]}"
                )
        answers = [name for name in signature.outputs if name not in state.values()]
        if len(answers) != 1:
            raise self._lie(f"it answers by one output, states aside, the model has {sorted(signature.outputs)}")
        self._answer = answers[0]
        # Densities have the same format for every system; systems with other commands convert them later.
        flown = Ergodic() if self.answers == "density" else system
        if flown is not None:
            try:
                self._format = card.format(config, flown)
            except SwarmError as error:
                raise CheckpointError(f"the card of policy {self.name!r} does not fit this game: {error}") from error
            self._check_inputs(self._format.observation_space)
            self._check_answer(self._format.action_space)

    def _lie(self, what: str) -> CheckpointError:
        return CheckpointError(f"the card of policy {self.name!r} and its model do not agree: {what}")

    def _check_inputs(self, space: spaces.Space[Any]) -> None:
        """Check the model's inputs against its card."""
        seen = {name: spec for name, spec in self.network.signature.inputs.items() if name not in self.card.state}
        rows = self.network.signature.rows
        if isinstance(space, spaces.Dict):
            expected = {name: TensorSpec(str(part.dtype), (rows, *(part.shape or ()))) for name, part in space.items()}
            fits = bool(seen) and all(expected.get(name) == spec for name, spec in seen.items())
        else:
            expected = {"observation": TensorSpec(str(space.dtype), (rows, *(space.shape or ())))}
            fits = list(seen.values()) == list(expected.values())
        if not fits:
            raise self._lie(f"in this game it is to be shown {_listed(expected)}, the model takes {_listed(seen)}")

    def _check_answer(self, space: spaces.Space[Any]) -> None:
        """Check the model's output against its card."""
        spec, rows = self.network.signature.outputs[self._answer], self.network.signature.rows
        if isinstance(space, spaces.Discrete):
            is_number = spec.shape == (rows,) and np.issubdtype(spec.dtype, np.integer)
            fits = is_number or (spec.shape == (rows, space.n) and np.issubdtype(spec.dtype, np.floating))
            expected = f"whole numbers ({rows},), or values ({rows}, {space.n})"
        else:
            shape = (rows, *(space.shape or ()))
            fits = spec.shape == shape and np.issubdtype(spec.dtype, np.floating)
            expected = f"fractions {shape}"
        if not fits:
            raise self._lie(f"in this game it is to answer {expected}, the model gives {_listed({self._answer: spec})}")

    @classmethod
    def read(cls, folder: Path, config: GameConfig) -> OnnxPolicy:
        """Read the policy in a folder; raise a CheckpointError if files are missing, changed or malicious."""
        card, model = read_files(folder)
        return cls(card, _network(folder / MODEL, model), config)

    def for_system(self, system: ControlSystem) -> OnnxPolicy:
        """Return the policy for a team with a control system; raise a KindError if it commands another system."""
        if self.card.system not in ("", system.name):
            raise KindError(
                f"policy {self.name!r} has learned to command {self.card.system}, and not {system.name}: choose "
                f"another policy, or another system by GameConfig.controllers"
            )
        if self.answers == "density" or system == self._system:
            return self
        return OnnxPolicy(self.card, self.network, self._config, system)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows, with no memory of earlier games."""
        self.network.restart()
        self._clock.begin(rows)
        for row in rows.tolist():
            self._states.pop(row, None)

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return commands (n, ...) for n observations; raise a PolicyError if the model fails, or returns NaN."""
        answers, form = self.answers_to(observations, rows), self._told_format()
        if isinstance(form.action_space, spaces.Discrete):
            answers = answers.argmax(axis=1) if answers.ndim == 2 else answers
        elif isinstance(form.action_space, spaces.Box):
            low, high = form.action_space.low, form.action_space.high
            answers = answers.astype(np.float64).clip(low, high)
        return form.read(answers, len(rows), f"the answers of policy {self.name}")

    def answers_to(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Return the model's outputs (n, ...) for n observations; raises as `act`."""
        self._told_format()
        seen = [name for name in self.network.signature.inputs if name not in self.card.state]
        shown = observations if isinstance(observations, dict) else {seen[0]: observations}
        given: Arrays = {name: shown[name] for name in seen}
        size, count = self.network.signature.rows, len(rows)
        starts = range(0, count, size)
        self._clock.start()
        parts = [self._answer_part({k: v[i : i + size] for k, v in given.items()}, rows[i : i + size]) for i in starts]
        return np.concatenate(parts)

    def _told_format(self) -> Format:
        if self._format is None:
            raise KindError(f"policy {self.name!r} needs the control system of its team: load it by `load`")
        return self._format

    def _answer_part(self, given: Arrays, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Return the outputs for a batch of games, or fewer."""
        signature, count = self.network.signature, len(rows)
        # Rounding depends on the batch size, so it never varies: an output cannot depend on other games.
        feeds = {name: np.zeros(spec.shape, spec.dtype) for name, spec in signature.inputs.items()}
        for name, values in given.items():
            feeds[name][:count] = values
        for place, row in enumerate(rows.tolist()):
            for name, values in self._states.get(row, {}).items():
                feeds[name][place] = values
        try:
            answers = self.network.run(feeds)
            if self._clock.is_over(rows):
                raise ForfeitError(f"it {TOO_SLOW}")
        except PolicyError as error:
            raise type(error)(f"the model of policy {self.name!r}: {error}") from error
        if self.card.state:
            for place, row in enumerate(rows.tolist()):
                self._states[row] = {taken: answers[left][place].copy() for taken, left in self.card.state.items()}
        return answers[self._answer][:count]


def write(folder: Path | str, model: bytes, card: OnnxCard, config: GameConfig | None = None) -> None:
    """Try a model, the bytes of an ONNX file, and write it into a folder with its card.

    `config` is a game that it plays, with the control system that it commands. Raises a CheckpointError if the model
    does not fit its card, a PolicyError if the game's control system does not take its commands, an OutputError if the
    folder cannot be written to, or holds something.
    """
    folder, config = Path(folder), GameConfig() if config is None else config
    check_new(folder)
    load(OnnxPolicy(card, _network(folder / MODEL, model), config), config)
    check_folder(folder)
    with draft_of(folder / MODEL) as draft:
        draft.write_bytes(model)
    with draft_of(folder / CARD) as draft:  # last, so that no card is without its model
        plain = {"format": FORMAT} | card.to_dict() | {"digest": digest_of(card, model)}
        draft.write_text(json.dumps(plain, indent=2) + "\n")


def check_new(folder: Path) -> None:
    """Raise an OutputError if the folder is not empty, or the path is a file's, or has a file's name."""
    if folder.suffix == ".onnx":
        raise OutputError(
            f"expected a folder, got {str(folder)!r}: a model's card stands beside it, and players are named by folders"
        )
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        raise OutputError(f"{str(folder)!r} holds something already: choose another folder, or remove it")


def _network(path: Path, model: bytes) -> Network:
    try:
        return Network(model)
    except CheckpointError as error:
        raise CheckpointError(f"the model {path}: {error}") from error


def _listed(specs: Mapping[str, TensorSpec]) -> str:
    return ", ".join(f"{name} {spec.dtype} {spec.shape}" for name, spec in specs.items()) or "nothing"
