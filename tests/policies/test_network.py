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
    """Else no training is repeated, and none that was stopped goes on as the run that never stopped."""
    torch.manual_seed(0)
    layer = GroupConv(8, 32, 5)  # PyTorch shares out what has 2**15 entries
    asked = torch.randn(layer.get_buffer("places").shape)
    threads, found = torch.get_num_threads(), set()
    try:
        for count in (1, 2, 2, 2, 2, 2, 2, 2, 2):
            torch.set_num_threads(count)
            (gradient,) = torch.autograd.grad(layer._full_kernel(), layer.weight, asked)
            found.add(gradient.numpy().tobytes())
    finally:
        torch.set_num_threads(threads)
    assert len(found) == 1


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


def test_a_network_too_large_for_any_memory_is_refused_and_the_largest_is_not():
    with pytest.raises(ConfigError, match="width times action_cells must be at most 2560, got 520 times 5"):
        Actor((1, 10, 10), 5, 520)
    with pytest.raises(ConfigError, match="got 64 times 50"):
        Actor((1, 50, 50), 50, 64)
    assert Actor((1, 10, 10), 10, 256).head.weight.shape == (1, 32, 1, 1)


def test_the_plane_beside_the_board_tells_how_far_from_the_centre_each_cell_is():
    edge = Actor((3, 5, 5), 5, 8).trunk.get_buffer("edge")[0, 0]
    expected = [[max(abs(row - 2), abs(column - 2)) / 2 for column in range(5)] for row in range(5)]
    torch.testing.assert_close(edge, torch.tensor(expected))


@pytest.mark.parametrize(("inputs", "lifts"), [(32, True), (4, False)])
def test_what_a_fresh_layer_gives_has_twice_the_variance_of_which_rectifying_leaves_half(inputs, lifts):
    torch.manual_seed(0)
    layer = GroupConv(inputs, 16, 3, lifts=lifts)
    out = layer(torch.randn(8, inputs if lifts else 8 * inputs, 9, 9))
    assert 1.6 < float(out.detach().var()) < 2.4
