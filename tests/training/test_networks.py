from __future__ import annotations

import numpy as np
import pytest
import torch
from gymnasium import spaces

from swarm_pz.training.networks import GridPolicy

WIDTH = 16


@pytest.fixture
def network():
    torch.manual_seed(0)
    seen, acts = spaces.Box(0, 255, (3, 10, 10), np.uint8), spaces.Box(-1, 1, (5, 5), np.float32)
    return GridPolicy(seen, acts, lambda _: 0.125, width=WIDTH)


def boards(count=4):
    return torch.from_numpy(np.random.default_rng(0).integers(0, 256, (count, 3, 10, 10)).astype(np.uint8))


def test_every_way_to_ask_gives_the_same_value_and_the_actors_action(network):
    seen = boards()
    actions, values, chances = network(seen, deterministic=True)
    torch.testing.assert_close(network.predict_values(seen), values)
    torch.testing.assert_close(network.get_distribution(seen).mode().reshape(actions.shape), actions)
    torch.testing.assert_close(network.actor(seen.float() / 255), actions)
    again, chances_again, _ = network.evaluate_actions(seen, actions.flatten(1))
    torch.testing.assert_close(again, values)
    torch.testing.assert_close(chances_again, chances)
    assert float(values.detach().std()) > 0


def test_an_untrained_tactic_is_close_to_uniform_coverage(network):
    actions = network.actor(boards().float() / 255)
    assert 0 < float(actions.detach().abs().max()) < 0.1


def test_all_that_learns_is_in_the_optimizer_and_nothing_twice(network):
    (group,) = network.optimizer.param_groups
    assert group["lr"] == 0.125
    held = [id(values) for values in group["params"]]
    assert len(held) == len(set(held))
    assert {id(values) for values in network.parameters()} == set(held)
    for part in (network.actor, network.mlp_extractor.critic, network.value_net):
        assert {id(values) for values in part.parameters()} <= set(held)


def test_the_network_is_as_wide_as_asked_for(network):
    assert network.actor.head.in_channels == WIDTH // 8
