"""Learned tactics that ship with the project: a folder each, weights and a card.

Each folder is an attribute of this module, which returns the policy if called with a game. `systems` holds a folder
for each control system, for drones that hover and for drones with a least airspeed, all trained by the recipe of
scripts/systems; `trained` returns the policy that fits.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import KindError, require_extra
from swarm_pz.policy.protocol import ANY
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.observation import Observations

if TYPE_CHECKING:
    from swarm_pz.policies.learned import LearnedPolicy

_HERE = Path(__file__).parent
_ABOUT = {
    "champion": "Trained in a league against scripts, its own snapshots and exploiters; veteran beats it.",
    "finisher": "Trained from veteran with generated opponents: it also beats teams that hide, and most that run laps.",
    "hunter": "Trained by swarm-pz train --recipe long, against every script.",
    "marshal": "Trained from warden in a league of nine minutes on a GPU: against its past selves, exploiters, "
    "patterns that evolved, and earlier players.",
    "scholar": "Distilled from four teachers: a league against patterns, a league that began with a lap, finisher and "
    "carousel.",
    "veteran": "Trained from champion in four leagues; it beats champion in nine of ten games.",
    "warden": "Trained from finisher in seven leagues, against patterns that evolved and all earlier players.",
}
"""Descriptions that replace those of the cards, which are part of the policies' digests and cannot change."""


class Shipped:
    """A named tactic of the zoo; calling it with a game makes its policy."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.__name__ = folder.name
        self.__doc__ = _ABOUT.get(folder.name) or str(json.loads((folder / "policy.json").read_text()).get("about", ""))

    def __call__(self, config: GameConfig) -> LearnedPolicy:
        """Make the policy for a game; raise a CheckpointError, or a MissingExtraError without PyTorch."""
        require_extra("torch", "train")
        from swarm_pz.policies.learned import LearnedPolicy

        return LearnedPolicy.read(self.folder, config)


class trained:  # noqa: N801  (reads like the policy's name that it is)
    """The policy that was trained for the team's control system, and for hovering or fixed-wing drones."""

    answers = ANY
    observation = ObservationConfig(kind="drones")

    def __init__(self, config: GameConfig) -> None:
        self._config = config

    def for_system(self, system: ControlSystem) -> LearnedPolicy:
        """Return the policy that was trained for a system; raise a KindError if there is none."""
        track = "fixed_wing" if self._config.dynamics.min_speed > 0 else "hovering"
        folder = _HERE / "systems" / track / system.name
        if not (folder / "policy.json").is_file():
            there = ", ".join(sorted(path.name for path in folder.parent.glob("*"))) or "none"
            raise KindError(f"no {track} policy was trained for {system.name}; there are some for: {there}")
        require_extra("torch", "train")
        from swarm_pz.policies.learned import LearnedPolicy

        return LearnedPolicy.read(folder, self._config).for_system(system)

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Raise an error: `for_system` returns the policy that plays."""
        raise KindError("the policy 'trained' needs the control system of its team: load it by `load`")

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Raise an error: `for_system` returns the policy that plays."""
        raise KindError("the policy 'trained' needs the control system of its team: load it by `load`")


def __getattr__(name: str) -> Shipped:
    folder = _HERE / name
    if name.startswith("_") or not (folder / "policy.json").is_file():
        raise AttributeError(f"the zoo has no tactic {name!r}")
    return Shipped(folder)
