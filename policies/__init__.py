"""Policies: tactics written by hand, learned tactics, and how to find them by name."""

from __future__ import annotations

from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import CheckpointError, require_extra
from swarm_pz.policy import Player, registered
from swarm_pz.policy import load as _load

__all__ = ["load", "names"]


def names() -> list[str]:
    """Return the names of all installed policies, in alphabetical order."""
    return sorted(registered())


def load(name: str | Path, config: GameConfig | None = None, system: ControlSystem | None = None) -> Player:
    """Return the policy with a name, or in a folder, as `swarm_pz.policy.load` does.

    `name` is one of `names()`, or a folder with ``policy.json`` and ``policy.safetensors`` or ``policy.onnx``. Without
    `config` it plays the default game. Raises a PolicyError if there is no such name (with the nearest one), or if that
    system does not take its commands; a CheckpointError if the folder's files are missing or corrupt, or do not fit
    the game.
    """
    return _load(name, config if config is not None else GameConfig(), system)


def read_folder(folder: Path, config: GameConfig) -> Player:
    """Return the policy in a folder (an entry point); raise a CheckpointError, or a MissingExtraError."""
    from swarm_pz.policies.onnx_policy import MODEL, OnnxPolicy

    is_learned = (folder / "policy.safetensors").exists()
    is_onnx = (folder / MODEL).exists() or (folder / MODEL).is_symlink()
    if is_onnx or not is_learned:
        if is_learned:
            raise CheckpointError(f"{folder} holds two policies, policy.onnx and policy.safetensors: keep one")
        require_extra("onnxruntime", "onnx")
        return OnnxPolicy.read(folder, config)
    require_extra("torch", "train")
    from swarm_pz.policies.learned import LearnedPolicy

    return LearnedPolicy.read(folder, config)
