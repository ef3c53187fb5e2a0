from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from swarm_pz.errors import ConfigError
from swarm_pz.policies.network import ORIENTATIONS, Actor, Critic, GroupConv, turn


def turned(images: Tensor, orientation: int) -> Tensor:
    mirrored = images.flip(-1) if orientation >= 4 else images
    return torch.rot90(mirrored, orientation % 4, (-2, -1))


def test_there_are_eight_different_orientations():
    probe = np.arange(9).reshape(3, 3)
    assert len({turn(probe, orientation).tobytes() for orientation in range(ORIENTATIONS)}) == ORIENTATIONS
    for orientation in range(ORIENTATIONS):
        np.testing.assert_array_equal(turn(probe, orientation), turned(torch.from_numpy(probe), orientation).numpy())


@pytest.mark.parametrize("grid", [10, 25])
@pytest.mark.parametrize("orientation", range(ORIENTATIONS))
def test_a_turned_board_is_played_as_the_board(grid, orientation):
    torch.manual_seed(0)
    actor, critic = Actor((3, grid, grid), 5, 16), Critic(5, 16, 6)
    boards = torch.rand(2, 3, grid, grid)
    actions, values = actor(boards), critic(actor.trunk(boards))
    assert (actions - actions.mean()).abs().max() > 1e-3
    torch.testing.assert_close(actor(turned(boards, orientation)), turned(actions, orientation), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(critic(actor.trunk(turned(boards, orientation))), values, atol=1e-5, rtol=1e-4)


def test_one_layer_turns_and_exchanges_its_orientations():
    """A turned input gives, in each orientation, what the turned-back one gave before, turned."""
    torch.manual_seed(0)
    layer = GroupConv(1, 1, 3, padding=1, lifts=True)
    image = torch.rand(1, 1, 5, 5)
    for orientation in range(ORIENTATIONS):
        expected = turned(torch.nn.functional.conv2d(image, layer.weight[:, :, 0], layer.bias, padding=1), orientation)
        torch.testing.assert_close(layer(turned(image, orientation))[:, orientation], expected[:, 0])


def test_a_frozen_network_plays_the_same():
    actor = Actor((3, 10, 10), 5, 8)
    boards = torch.rand(2, 3, 10, 10)
    before = actor(boards).detach()
    actor.freeze()
    torch.testing.assert_close(actor(boards), before)


@pytest.mark.parametrize(("cells", "width"), [(4, 8), (5, 12), (5, 0)])
def test_shapes_that_do_not_fit_are_refused(cells, width):
    with pytest.raises(ConfigError, match=r"action_cells must divide|width must be a multiple"):
        Actor((3, 10, 10), cells, width)
