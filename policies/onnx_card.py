"""What stands beside an ONNX model in a policy's folder: the card, which says how to play it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import Config, check, check_choice, check_count
from swarm_pz.config.constants import GRID_CELLS
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import CheckpointError, ConfigError, SwarmError
from swarm_pz.files import draft_of, read_bytes
from swarm_pz.policies.onnx_checks import MOST_BYTES
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.formats import Dtype, Format

MODEL, CARD = "policy.onnx", "policy.json"
FORMAT = "onnx-1"
_MOST_CARD = 2**16


@dataclass(frozen=True, kw_only=True)
class OnnxCard(Config):
    """What a model's card says; see `swarm_pz.spaces.formats.Format` for how actions and images are written.

    Attributes
    ----------
    name : str
        What tables call it.
    origin : str
        Who made it, from what, and how.
    answers : str
        The kind of its commands, as `ControlSystem.takes`.
    system : str
        The control system that it has learned to command; if empty, any that takes such commands.
    observation : ObservationConfig
        What it sees.
    observation_dtype : {"uint8", "float32"}
    channels_last : bool
    action : {"normalised", "command", "discrete"}
        How its answers are read, as of `Format`; those outside of the format's limits are clipped. Of discrete ones,
        an answer is the number of a command, or else a value for each, of which the largest is taken.
    action_cells : int, optional
    flatten_actions : bool
    state : dict of str to str
        Of a model with memory: the output whose values an input has at the next step; zeros at first.
    """

    name: str = ""
    origin: str = ""
    answers: str = "density"
    system: str = ""
    observation: ObservationConfig = field(default_factory=ObservationConfig)
    observation_dtype: Dtype = "uint8"
    channels_last: bool = False
    action: ActionKind = "normalised"
    action_cells: int | None = None
    flatten_actions: bool = False
    state: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("name", "origin", "answers", "system"):
            value = getattr(self, name)
            is_line = isinstance(value, str) and len(value) <= 2000 and value.isprintable()
            check(is_line, f"card.{name}", value, "a line of text")
        for name in ("name", "answers"):
            check(bool(getattr(self, name)), f"card.{name}", "", "a line of text that is not empty")
        check_choice(self.action, "card.action", get_args(ActionKind))
        check_choice(self.observation_dtype, "card.observation_dtype", get_args(Dtype))
        for name in ("channels_last", "flatten_actions"):
            check(isinstance(getattr(self, name), bool), f"card.{name}", getattr(self, name), "true or false")
        if self.action_cells is not None:
            check_count(self.action_cells, "card.action_cells", 2, GRID_CELLS)
        is_map = isinstance(self.state, Mapping) and all(isinstance(one, str) for one in self.state.values())
        check(
            is_map and len(set(self.state.values())) == len(self.state), "card.state", self.state, "inputs to outputs"
        )
        check(isinstance(self.observation, ObservationConfig), "card.observation", self.observation, "an object")

    def format(self, config: GameConfig, system: ControlSystem) -> Format:
        """Return how a game's observations are shown, and answers are read."""
        return Format(
            config,
            self.observation,
            system,
            action=self.action,
            action_cells=self.action_cells,
            flatten_actions=self.flatten_actions,
            observation_dtype=self.observation_dtype,
            channels_last=self.channels_last,
        )


def digest_of(card: OnnxCard, model: bytes) -> str:
    """Return a hash of all that makes a policy."""
    content = hashlib.sha256(json.dumps(card.to_dict(), sort_keys=True).encode())
    content.update(model)
    return content.hexdigest()[:32]


def read_files(folder: Path) -> tuple[OnnxCard, bytes]:
    """Return a folder's card and model, which belong together.

    Raises
    ------
    CheckpointError
        If they are missing, links, too large, or were changed.
    """
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
        raise CheckpointError(f"the card in {folder} cannot be used: {error}") from error
    if digest is None:
        raise CheckpointError(
            f"the card in {folder} names no digest, so nobody can tell whether it was changed: write the folder by "
            "swarm_pz.policies.onnx_policy.write, which puts it in"
        )
    if digest != (found := digest_of(card, model)):
        raise CheckpointError(
            f"{folder} was changed after it was written: its card names digest {digest!r}, its content has "
            f"{found!r}; get it again from where it came from, or write it by swarm_pz.policies.onnx_policy.write"
        )
    return card, model


def is_card(path: Path) -> bool:
    """Tell whether a file is the card of an ONNX model, by the format that it names."""
    try:
        return bool(json.loads(_read(path, _MOST_CARD))["format"] == FORMAT)
    except (CheckpointError, ValueError, RecursionError, LookupError, TypeError):
        return False


def write_files(folder: Path, card: OnnxCard, model: bytes) -> None:
    """Write a folder's files, the card last, so that a card never stands alone."""
    with draft_of(folder / MODEL) as draft:
        draft.write_bytes(model)
    said = {"format": FORMAT} | card.to_dict() | {"digest": digest_of(card, model)}
    with draft_of(folder / CARD) as draft:
        draft.write_text(json.dumps(said, indent=2) + "\n")


def _read(path: Path, most: int) -> bytes:
    """Return what stands in a file itself, and not where a link leads."""
    if not (path.exists() or path.is_symlink()):
        others = sorted(one.name for one in path.parent.glob("*.onnx")) if path.name == MODEL else []
        hint = f"; it holds {', '.join(others[:3])}: a model must be called {MODEL}" if others else ""
        raise CheckpointError(f"{path.parent} must hold {MODEL} and {CARD}, {path.name} is missing{hint}")
    try:
        return read_bytes(path, most, links=False)
    except ConfigError as error:
        raise CheckpointError(f"{path} {error}") from error
