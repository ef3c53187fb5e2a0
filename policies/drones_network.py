"""The network of learned policies that see drones, for commands other than densities.

The same layers read every drone, and the averages of each side decide, so the order of drones does not matter (Zaheer
et al., "Deep Sets", NeurIPS 2017). A row for each drone, or a value for each cell, is decided from the averages and
from the place of the drone or the cell.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import torch
from torch import Tensor, nn

from swarm_pz.errors import ConfigError

Head = Literal["vector", "drones", "image"]
COLUMNS = 5
"""Numbers of a drone: x, y, vx, vy, and 1 for an own drone or -1 for an opposing one."""
LARGEST = 512
"""Largest width; a command has at most 8 times as many numbers. No foreign card may ask for all memory."""


def head_of(shape: tuple[int, ...], drones: int) -> Head:
    """Return the head for commands of a shape: for rows of drones, cells of images, or whole vectors."""
    if len(shape) == 2 and shape[0] == drones:
        return "drones"
    return "image" if len(shape) == 3 and shape[1] == shape[2] else "vector"


class DronesActor(nn.Module):
    """The part that plays: observations (n, N, 5) to mean actions (n, *shape).

    `head` says how an action is decided (see `head_of`); `width` is that of the hidden layers.
    """

    def __init__(self, shape: tuple[int, ...], head: Head, width: int) -> None:
        super().__init__()
        if not 1 <= width <= LARGEST or not 1 <= math.prod(shape) <= 8 * LARGEST:
            raise ConfigError(f"width must be from 1 to {LARGEST}, and an action of few numbers, got {width}, {shape}")
        if head not in get_args(Head):
            raise ConfigError(f"head must be one of {', '.join(get_args(Head))}, got {head!r}")
        if (head == "drones" and len(shape) != 2) or (head == "image" and (len(shape) != 3 or shape[1] != shape[2])):
            raise ConfigError(f"an action decided for {head!r} cannot be of the shape {shape}")
        self.shape, self.kind, self.width = shape, head, width
        self.read = nn.Sequential(nn.Linear(COLUMNS, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh())
        outputs, places = math.prod(shape), 0
        if head == "drones":
            outputs, places = shape[1], COLUMNS
        elif head == "image":
            outputs, places = shape[0], 2
            line = (torch.arange(shape[1]) + 0.5) / shape[1] * 2.0 - 1.0
            cells = torch.stack(torch.meshgrid(line, line, indexing="xy"), dim=-1).reshape(1, -1, 2)
            self.register_buffer("cells", cells, persistent=False)
        self.think = nn.Sequential(
            nn.Linear(2 * width + 2 + places, width), nn.Tanh(), nn.Linear(width, width), nn.Tanh()
        )
        self.head = nn.Linear(width, outputs)

    def summary(self, observations: Tensor) -> Tensor:
        """Return a summary (n, 2 * width + 2) of both sides, independent of the order of drones."""
        read, own = self.read(centred(observations)), observations[..., 4:] > 0
        parts = []
        for side in (own, ~own):
            share = side.float().mean(dim=1)
            parts += [(read * side).mean(dim=1) / share.clamp(min=1e-3), share]
        return torch.cat(parts, dim=1)

    def features(self, observations: Tensor) -> Tensor:
        """Return the last hidden layer (n, rows, width), with a single row, a row a drone or a row a cell."""
        summary = self.summary(observations)[:, None]
        if self.kind == "vector":
            return self.think(summary)  # type: ignore[no-any-return]
        cells = self.get_buffer("cells") if self.kind == "image" else None
        rows = centred(observations) if cells is None else cells.expand(len(observations), -1, -1)
        return self.think(torch.cat([rows, summary.expand(-1, rows.shape[1], -1)], dim=2))  # type: ignore[no-any-return]

    def decide(self, features: Tensor) -> Tensor:
        """Turn features into actions (n, *shape)."""
        actions: Tensor = self.head(features)
        if self.kind == "image":
            actions = actions.swapaxes(1, 2)
        return actions.reshape(-1, *self.shape)

    def forward(self, observations: Tensor) -> Tensor:
        """Turn observations into mean actions."""
        return self.decide(self.features(observations))


def centred(observations: Tensor) -> Tensor:
    """Return observations with positions in [-1, 1] and velocities times 4."""
    return torch.cat([2.0 * observations[..., :2] - 1.0, 4.0 * observations[..., 2:4], observations[..., 4:]], dim=-1)
