from __future__ import annotations

import pytest
import torch

from swarm_pz.errors import ConfigError
from swarm_pz.policies.drones_network import DronesActor, head_of


@pytest.mark.parametrize(("head", "shape"), [("drones", (6, 2)), ("vector", (3, 2)), ("image", (2, 4, 4))])
def test_the_head_follows_from_the_shape_and_the_order_of_the_drones_means_nothing(head, shape):
    assert head_of(shape, 6) == head
    torch.manual_seed(0)
    actor, boards = DronesActor(shape, head, 8), torch.rand(3, 6, 5)
    boards[..., 4] = torch.tensor([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])
    order = torch.tensor([4, 0, 5, 2, 1, 3])
    first, other = actor(boards), actor(boards[:, order])
    assert first.shape == (3, *shape)
    torch.testing.assert_close(other, first[:, order] if head == "drones" else first)
    boards[..., 4] = -1.0  # a team without drones
    assert torch.isfinite(actor(boards)).all()


def test_cells_of_an_image_stand_where_a_command_has_them():
    cells = DronesActor((1, 4, 4), "image", 8).get_buffer("cells").reshape(4, 4, 2)
    torch.testing.assert_close(cells[0, :, 0], torch.tensor([-0.75, -0.25, 0.25, 0.75]))
    torch.testing.assert_close(cells[:, 0, 1], cells[0, :, 0])


@pytest.mark.parametrize(
    ("shape", "head", "width"),
    [
        ((3, 2), "vector", 100_000),
        ((3, 2), "vector", 0),
        ((10_000, 2), "vector", 8),
        ((2**33, 2**31), "drones", 8),  # whose product overflows to 0 in 64 bits
        ((5,), "drones", 8),
        ((5,), "image", 8),
        ((2, 4, 5), "image", 8),
    ],
)
def test_a_card_that_asks_for_too_much_or_the_impossible_is_refused(shape, head, width):
    with pytest.raises(ConfigError, match=r"must be from 1 to|cannot be of the shape"):
        DronesActor(shape, head, width)
