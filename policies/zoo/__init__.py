"""Learned tactics that ship with the project: a folder each, weights and a card.

An attribute of this module is a folder's name; called with a game, it gives the policy.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra

if TYPE_CHECKING:
    from swarm_pz.policies.learned import LearnedPolicy

_HERE = Path(__file__).parent


class Shipped:
    """A tactic of the zoo by name: called with a game, it makes the policy that plays it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.__name__ = folder.name
        self.__doc__ = str(json.loads((folder / "policy.json").read_text()).get("about", ""))

    def __call__(self, config: GameConfig) -> LearnedPolicy:
        """Make the policy for a game.

        Raises
        ------
        CheckpointError
            If its files are damaged or were changed.
        MissingExtraError
            If PyTorch is not installed.
        """
        require_extra("torch", "training")
        from swarm_pz.policies.learned import LearnedPolicy

        return LearnedPolicy.read(self.folder, config)


def __getattr__(name: str) -> Shipped:
    folder = _HERE / name
    if name.startswith("_") or not (folder / "policy.json").is_file():
        raise AttributeError(f"the zoo has no tactic {name!r}")
    return Shipped(folder)
