"""The network of learned tactics, which is equivariant: it turns and mirrors its actions with the board.

The square has eight symmetries, and so has the game. A network that respects them learns from each
position what it would otherwise have to see eight times. Its layers are group convolutions (Cohen &
Welling, "Group equivariant convolutional networks", ICML 2016): every feature exists in eight
orientations, whose kernels are one kernel, turned and mirrored.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from swarm_pz.errors import ConfigError
from swarm_pz.policies.symmetry import ORIENTATIONS, kernel_places

LARGEST = 2560
"""Bound on width times cells a side: a card from elsewhere must not ask for all memory."""


class GroupConv(nn.Module):
    """A convolution whose outputs turn with its inputs, of a kernel with `size` cells a side.

    Channels are ordered by orientation, then by feature. Each output has eight orientations, and so has each input
    unless the layer `lifts` plain images. With `padding` empty cells around the image, the stride is one cell. Without,
    the stride is `size`, and the image must be a whole number of kernels a side.
    """

    def __init__(
        self, inputs: int, outputs: int, size: int, *, padding: int | None = None, lifts: bool = False
    ) -> None:
        super().__init__()
        sources = 1 if lifts else ORIENTATIONS
        fan_in = inputs * sources * size**2
        self.weight = nn.Parameter(torch.randn(outputs, inputs, sources, size, size) * (2.0 / fan_in) ** 0.5)
        self.bias = nn.Parameter(torch.zeros(outputs))
        self.size, self.padding = size, padding
        self._kernel: Tensor | None = None
        self.register_buffer("places", torch.from_numpy(kernel_places(tuple(self.weight.shape))), persistent=False)

    def _full_kernel(self) -> Tensor:
        places = self.get_buffer("places")
        # Not `weight[places]`: PyTorch's threads sum up its gradient in an order that varies.
        return self.weight.reshape(-1).index_select(0, places.reshape(-1)).reshape(places.shape)

    def freeze(self) -> None:
        """Keep the full kernel from now on: the weights will not change any more."""
        self._kernel = self._full_kernel().detach()

    def forward(self, images: Tensor) -> Tensor:
        """Turn (n, channels, rows, columns) into (n, 8 * outputs, rows', columns')."""
        kernel = self._full_kernel() if self._kernel is None else self._kernel
        bias = self.bias.repeat(ORIENTATIONS)
        if self.padding is not None:
            return nn.functional.conv2d(images, kernel, bias, padding=self.padding)
        # Blocks that do not overlap are one product of matrices, several times as fast as PyTorch's convolution.
        count, channels, rows, columns = images.shape
        size = self.size
        blocks = images.reshape(count, channels, rows // size, size, columns // size, size).permute(0, 2, 4, 3, 5, 1)
        answers = nn.functional.linear(blocks.flatten(3), kernel.permute(0, 2, 3, 1).flatten(1), bias)
        return answers.permute(0, 3, 1, 2)


class GridTrunk(nn.Module):
    """Convolutions over the board, shared by actor and critic, with `width` hidden channels, a multiple of eight.

    The first one shrinks an observation (channels, rows, columns) to the action's cells. So the same weights decide
    every cell of the action, from the ground around it and a summary of the whole board. A plane with the distance from
    the centre shows where the walls are.
    """

    def __init__(self, observation_shape: tuple[int, ...], action_cells: int, width: int) -> None:
        super().__init__()
        channels, grid, _ = observation_shape
        if grid % action_cells:
            raise ConfigError(f"action_cells must divide the observation's grid of {grid}, got {action_cells}")
        if width < ORIENTATIONS or width % ORIENTATIONS:
            raise ConfigError(f"width must be a multiple of {ORIENTATIONS}, got {width}")
        if width * action_cells > LARGEST:
            raise ConfigError(f"width times action_cells must be at most {LARGEST}, got {width} times {action_cells}")
        block, features = grid // action_cells, width // ORIENTATIONS
        axis = torch.linspace(-1.0, 1.0, grid).abs()
        self.register_buffer("edge", torch.maximum(axis[:, None], axis)[None, None], persistent=False)
        self._shape = observation_shape
        self.near = nn.Sequential(
            GroupConv(channels + 1, features, block, lifts=True),
            nn.ReLU(),
            GroupConv(features, features, 3, padding=1),
            nn.ReLU(),
        )
        self.around = GroupConv(features, features, 3, padding=1)
        self.whole = nn.Sequential(
            GroupConv(features, features, action_cells), nn.ReLU(), GroupConv(features, features, 1)
        )

    def forward(self, observations: Tensor) -> Tensor:
        """Turn observations in [0, 1], flattened or not, into features (n, width, a, a)."""
        images = observations.reshape(-1, *self._shape)
        edge = self.get_buffer("edge").expand(len(images), -1, -1, -1)
        near = self.near(torch.cat([images, edge], dim=1))
        return torch.relu(self.around(near) + self.whole(near))


class Actor(nn.Module):
    """The part of a network that plays: observations to mean actions; arguments as of `GridTrunk`."""

    def __init__(self, observation_shape: tuple[int, ...], action_cells: int, width: int) -> None:
        super().__init__()
        self.trunk = GridTrunk(observation_shape, action_cells, width)
        self.head = nn.Conv2d(width // ORIENTATIONS, 1, 1)

    def forward(self, observations: Tensor) -> Tensor:
        """Turn observations in [0, 1], (n, C, G', G'), into actions (n, a, a)."""
        return self.decide(self.trunk(observations))

    def freeze(self) -> None:
        """Precompute the kernels, to play many times with these weights."""
        for module in self.modules():
            if isinstance(module, GroupConv):
                module.freeze()

    def decide(self, features: Tensor) -> Tensor:
        """Turn the trunk's features (n, width, a, a) into actions (n, a, a)."""
        weight = self.head.weight.flatten(1).repeat(1, ORIENTATIONS) / ORIENTATIONS  # averages over orientations
        return nn.functional.linear(features.permute(0, 2, 3, 1), weight, self.head.bias).squeeze(3)


class Critic(nn.Module):
    """Maps the trunk's features (n, width, a, a) to features (n, features) of a state's value in any orientation."""

    def __init__(self, action_cells: int, width: int, features: int) -> None:
        super().__init__()
        self.summary = nn.Sequential(GroupConv(width // ORIENTATIONS, features, action_cells), nn.ReLU())

    def forward(self, features: Tensor) -> Tensor:
        """Turn features into a summary."""
        return over_orientations(self.summary(features)).flatten(1)


def over_orientations(images: Tensor) -> Tensor:
    """Return the mean (n, features, a, a) of features over their eight orientations."""
    n, _, rows, columns = images.shape
    return images.reshape(n, ORIENTATIONS, -1, rows, columns).mean(dim=1)
