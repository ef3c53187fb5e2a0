from __future__ import annotations

import numpy as np
import pytest
import torch

from swarm_pz.errors import ConfigError
from swarm_pz.policies.network import ORIENTATIONS, Actor, Critic, GroupConv
from swarm_pz.policies.symmetry import turn


def turned(images, orientation):
    mirrored = images.flip(-1) if orientation >= 4 else images
    return torch.rot90(mirrored, orientation % 4, (-2, -1))


@pytest.mark.parametrize("orientation", range(ORIENTATIONS))
def test_a_turned_board_is_played_as_the_board(orientation):
    probe = np.arange(9).reshape(3, 3)
    np.testing.assert_array_equal(turn(probe, orientation), turned(torch.from_numpy(probe), orientation).numpy())
    torch.manual_seed(0)
    actor, critic = Actor((3, 10, 10), 5, 16), Critic(5, 16, 6)
    boards = torch.rand(2, 3, 10, 10)
    actions, values = actor(boards), critic(actor.trunk(boards))
    assert (actions - actions.mean()).abs().max() > 1e-3
    torch.testing.assert_close(actor(turned(boards, orientation)), turned(actions, orientation), atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(critic(actor.trunk(turned(boards, orientation))), values, atol=1e-5, rtol=1e-4)


@pytest.mark.parametrize(("cells", "size", "lifts"), [(10, 2, True), (10, 5, False), (6, 6, False), (3, 1, False)])
def test_a_layer_without_padding_is_a_convolution_block_beside_block(cells, size, lifts):
    torch.manual_seed(0)
    layer = GroupConv(3, 2, size, lifts=lifts).double()
    torch.nn.init.normal_(layer.bias)
    images = torch.rand(4, 3 if lifts else 24, cells, cells, dtype=torch.double)
    expected = torch.nn.functional.conv2d(images, layer._full_kernel(), layer.bias.repeat(8), stride=size)
    torch.testing.assert_close(layer(images), expected)
    torch.testing.assert_close(layer(images.contiguous(memory_format=torch.channels_last)), expected)


def test_gradients_are_the_same_bits_in_every_thread_and_each_time():
    """Else no run could be repeated, and a resumed run would differ from an uninterrupted one."""
    torch.manual_seed(0)
    layer = GroupConv(8, 32, 5)  # PyTorch splits 2**15 entries or more between threads
    upstream = torch.randn(layer.get_buffer("places").shape)
    threads, gradients = torch.get_num_threads(), set()
    try:
        for count in (1, *[2] * 8):
            torch.set_num_threads(count)
            (gradient,) = torch.autograd.grad(layer._full_kernel(), layer.weight, upstream)
            gradients.add(gradient.numpy().tobytes())
    finally:
        torch.set_num_threads(threads)
    assert len(gradients) == 1


def test_a_frozen_network_plays_the_same_and_sees_how_far_from_the_centre_each_cell_is():
    actor, boards = Actor((3, 5, 5), 5, 8), torch.rand(2, 3, 5, 5)
    before = actor(boards).detach()
    actor.freeze()
    torch.testing.assert_close(actor(boards), before)
    expected = [[max(abs(row - 2), abs(column - 2)) / 2 for column in range(5)] for row in range(5)]
    torch.testing.assert_close(actor.trunk.get_buffer("edge")[0, 0], torch.tensor(expected))


@pytest.mark.parametrize(
    ("grid", "cells", "width", "message"),
    [
        (10, 4, 8, "action_cells must divide"),
        (10, 5, 0, "width must be a multiple"),
        (10, 5, 520, "at most 2560, got 520 times 5"),
    ],
)
def test_shapes_that_do_not_fit_or_any_memory_are_refused(grid, cells, width, message):
    with pytest.raises(ConfigError, match=message):
        Actor((3, grid, grid), cells, width)
    assert Actor((1, 10, 10), 10, 256).head.weight.shape == (1, 32, 1, 1)  # the largest
