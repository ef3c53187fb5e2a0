"""Leaders and followers: their commands in all forms."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.leader_follower import LeaderFollower

CONFIG = GameConfig(controllers="leader_follower")


def test_a_place_for_each_leader_may_be_written_by_number():
    expected = np.array([(0.1, 0.2), (0.3, 0.4)])
    for command in (expected, {1: (0.3, 0.4), 0: (0.1, 0.2)}, {"0": [0.1, 0.2], "1": [0.3, 0.4]}):
        np.testing.assert_array_equal(LeaderFollower().parse(command, CONFIG), expected)


HERE = (0.5, 0.5)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([HERE] * 3, "one for each leader"),
        ([HERE, (0.5, 1.5)], r"in \[0, 1\]"),
        ({0: HERE, 2: HERE}, "leaders 0 to 1, got one for 2"),
        ({1: HERE}, "got none for 0"),
    ],
)
def test_what_places_no_leaders_is_refused_and_says_why(command, said):
    with pytest.raises(CommandError, match=said):
        LeaderFollower().parse(command, CONFIG)


def test_named_commands_send_all_leaders_to_a_place_or_around_it():
    made = Format(CONFIG, CONFIG.observations[0], action="discrete")
    assert len(made.command_names) == 50
    at, around = (made.command_names.index(f"{way}_30_70") for way in ("at", "around"))
    np.testing.assert_allclose(made.read_one(at, "action"), [(0.3, 0.7), (0.3, 0.7)])
    np.testing.assert_allclose(made.read_one(around, "action"), [(0.55, 0.7), (0.05, 0.7)])
    assert len(LeaderFollower(leaders=1).named(CONFIG)) == 25


def test_watchers_see_where_leaders_are_sent():
    density = LeaderFollower().to_densities(np.array([[(0.25, 0.25), (0.75, 0.95)]]), CONFIG)[0]
    assert density.sum() == pytest.approx(2.0) and density[2, 2] == density[9, 7] == 1.0
