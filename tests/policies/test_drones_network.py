from __future__ import annotations

import pytest
import torch

from swarm_pz.errors import ConfigError
from swarm_pz.policies.drones_network import DronesActor, head_of

CASES = {"drones": (6, 2), "vector": (3, 2), "image": (2, 4, 4)}


def boards(count=3):
    torch.manual_seed(0)
    seen = torch.rand(count, 6, 5)
    seen[..., 4] = torch.tensor([1.0, -1.0, 1.0, 1.0, -1.0, -1.0])
    return seen


@pytest.mark.parametrize(("head", "shape"), CASES.items())
def test_the_head_follows_from_the_shape_and_actions_are_of_that_shape(head, shape):
    assert head_of(shape, 6) == head
    assert DronesActor(shape, head, 8)(boards()).shape == (3, *shape)


@pytest.mark.parametrize(("head", "shape"), CASES.items())
def test_the_order_of_the_drones_means_nothing(head, shape):
    actor, seen = DronesActor(shape, head, 8), boards()
    order = torch.tensor([4, 0, 5, 2, 1, 3])
    first, other = actor(seen), actor(seen[:, order])
    torch.testing.assert_close(other, first[:, order] if head == "drones" else first)


def test_cells_of_an_image_stand_where_a_command_has_them():
    actor = DronesActor((1, 4, 4), "image", 8)
    cells = actor.get_buffer("cells").reshape(4, 4, 2)
    torch.testing.assert_close(cells[0, :, 0], torch.tensor([-0.75, -0.25, 0.25, 0.75]))
    torch.testing.assert_close(cells[:, 0, 1], cells[0, :, 0])


def test_a_team_of_nobody_is_read_too():
    seen = boards()
    seen[..., 4] = -1.0
    assert torch.isfinite(DronesActor((3, 2), "vector", 8)(seen)).all()


@pytest.mark.parametrize(("shape", "width"), [((3, 2), 100_000), ((10_000, 2), 8), ((3, 2), 0)])
def test_a_card_that_asks_for_too_much_is_refused(shape, width):
    with pytest.raises(ConfigError, match="width must be from 1 to"):
        DronesActor(shape, "vector", width)
