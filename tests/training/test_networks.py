from __future__ import annotations

import numpy as np
import pytest
import torch
from gymnasium import spaces

from swarm_pz.training.networks import DronesPolicy, GridPolicy

IMAGES, DRONES = spaces.Box(0, 255, (3, 10, 10), np.uint8), spaces.Box(-1, 1, (6, 5), np.float32)
CASES = {
    "grid": (GridPolicy, IMAGES, (5, 5)),
    "drones": (DronesPolicy, DRONES, (6, 2)),
    "vector": (DronesPolicy, DRONES, (3,)),
    "image": (DronesPolicy, DRONES, (2, 4, 4)),
}


@pytest.fixture(params=CASES)
def network(request):
    make, space, shape = CASES[request.param]
    torch.manual_seed(0)
    return make(space, spaces.Box(-1, 1, shape, np.float32), lambda _: 0.125, width=16)


def boards(network, count=4):
    network.observation_space.seed(0)
    return torch.from_numpy(np.stack([network.observation_space.sample() for _ in range(count)]))


def shown(network, images):
    return images.float() / 255 if isinstance(network, GridPolicy) else images


def test_every_way_to_ask_gives_the_same_value_and_the_actors_action(network):
    batch = boards(network)
    actions, values, chances = network(batch, deterministic=True)
    torch.testing.assert_close(network.predict_values(batch), values)
    torch.testing.assert_close(network.get_distribution(batch).mode().reshape(actions.shape), actions)
    torch.testing.assert_close(network.actor(shown(network, batch)), actions)
    again, chances_again, _ = network.evaluate_actions(batch, actions.flatten(1))
    torch.testing.assert_close(again, values)
    torch.testing.assert_close(chances_again, chances)
    assert float(values.detach().std()) > 0


def test_all_that_learns_is_in_the_optimizer_once_and_as_wide_as_asked_for(network):
    (group,) = network.optimizer.param_groups
    assert group["lr"] == 0.125
    held = [id(values) for values in group["params"]]
    assert len(held) == len(set(held))
    assert {id(values) for values in network.parameters()} == set(held)
    for part in (network.actor, network.mlp_extractor.critic, network.value_net):
        assert {id(values) for values in part.parameters()} <= set(held)
    head = network.actor.head
    assert getattr(head, "in_features", None) == 16 or head.in_channels == 16 // 8
