"""What clients ask for, made into commands: whose, for which side, and by which sender."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.server.orders import is_made_at_once, make
from swarm_pz.play.server.views import target_message
from swarm_pz.simulator.commands import make_target

EVEN = np.ones((10, 10)).tolist()
DOT = protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])
FORMS = [
    ("ergodic", {"strokes": [DOT]}, "density"),
    ("ergodic", {"density": EVEN}, "density"),
    ("potential_field", {"strokes": [DOT]}, "attraction"),
    ("potential_field", {"density": EVEN}, "density"),
    ("direct", {"command": [[0.5, 0.0]] * 4}, "accelerations"),
]


@pytest.mark.parametrize("sender", ["", "auto:saved"])
@pytest.mark.parametrize(("system", "form", "kind"), FORMS)
def test_a_command_is_its_senders_whatever_its_form(system, form, kind, sender):
    for team in range(2):
        other = "leader_follower"
        game = GameConfig(drones_per_team=2, controllers=(other, system) if team else (system, other))
        reader = CommandReader(game)
        made = make(protocol.CommandMessage(3, **form), reader, "firm", team, 3, sender)
        command = made.command
        assert (command.team, command.number, command.kind, command.sender) == (team, 3, kind, sender)
        _, coefficients = make_target(reader.picture(command), reader.modes)
        assert made.target == target_message(team, 3, coefficients)


def test_only_what_is_followed_as_it_came_is_made_at_once():
    reader = CommandReader(GameConfig(drones_per_team=2, controllers=("ergodic", "flocking")))
    density, drawn = protocol.CommandMessage(1, density=EVEN), protocol.CommandMessage(1, strokes=[DOT])
    assert is_made_at_once(density, reader, 0) and not is_made_at_once(drawn, reader, 0)
    assert not is_made_at_once(density, reader, 1), "another package may think about it for long"
