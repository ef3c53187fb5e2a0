"""A command that a player and a policy make together."""

import numpy as np

from swarm_pz.play.commands import Command
from swarm_pz.play.server.incoming_commands import SharedCommand, mixture

LEFT, RIGHT = np.zeros((2, 2)), np.zeros((2, 2))
LEFT[:, 0], RIGHT[0, 1] = 1.0, 1.0


def test_each_counts_by_its_shape_and_its_share():
    np.testing.assert_array_equal(mixture(LEFT, RIGHT, 0.0), LEFT)
    np.testing.assert_array_equal(mixture(LEFT, RIGHT, 1.0), RIGHT)
    mixed = mixture(0.01 * LEFT, 7.0 * RIGHT, 0.2)  # 0.4 of each left cell, 0.2 of the right one
    np.testing.assert_array_equal(mixed, [[1.0, 0.5], [1.0, 0.0]])
    np.testing.assert_array_equal(mixture(np.zeros((2, 2)), RIGHT, 0.5), [[0.2, 1.0], [0.2, 0.2]])


def test_whoever_speaks_changes_what_both_ask_for():
    before = SharedCommand(1, 2, 0.25, "ring").be_helped(RIGHT)
    np.testing.assert_array_equal(
        before.values, mixture(np.ones((2, 2)), RIGHT, 0.25), "the player's is uniform at first"
    )
    assert before.number == 0
    shared = SharedCommand(0, 2, 0.5, "ring")
    assert shared.take(Command(0, 1, LEFT)) is None, "alone as long as nobody helps"
    helped = shared.be_helped(RIGHT)
    assert (helped.number, helped.sender, helped.kind) == (1, "shared:ring", "density")
    np.testing.assert_array_equal(helped.values, mixture(LEFT, RIGHT, 0.5))
    assert shared.be_helped(2.0 * RIGHT) is None, "nothing new"
    again = shared.take(Command(0, 2, LEFT))
    assert again.number == 2, "a player who sends the same again sends"
    np.testing.assert_array_equal(again.values, helped.values)
