"""Commands rendered from what clients send: their sides and numbers."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.server.rendered_command import is_rendered_at_once, render
from swarm_pz.play.server.views import target_message
from swarm_pz.simulator.commands import make_target

EVEN = np.ones((10, 10)).tolist()
DOT = protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])
FIRM = "firm"


@pytest.mark.parametrize(
    ("team", "system", "form", "kind"),
    [
        (0, "ergodic", {"strokes": [DOT]}, "density"),
        (1, "ergodic", {"density": EVEN}, "density"),
        (1, "potential_field", {"strokes": [DOT]}, "attraction"),
        (0, "potential_field", {"density": EVEN}, "density"),
        (1, "direct", {"command": [[0.5, 0.0]] * 4}, "accelerations"),
    ],
)
def test_a_command_is_its_sides_whatever_its_form(team, system, form, kind):
    other = "leader_follower"
    reader = CommandReader(GameConfig(drones_per_team=2, controllers=(other, system) if team else (system, other)))
    rendered = render(protocol.CommandMessage(3, **form), reader, FIRM, team)
    command = rendered.command
    assert (command.team, command.number, command.kind) == (team, 3, kind)
    _, coefficients = make_target(reader.picture(command), reader.modes)
    assert rendered.target == target_message(team, 3, coefficients)
    if kind == "attraction":
        attracts, repels = command.values
        assert attracts.argmax() in (44, 45, 54, 55) and not repels.any()


def test_only_what_is_followed_as_it_came_is_rendered_where_games_run():
    reader = CommandReader(GameConfig(drones_per_team=2, controllers=("ergodic", "flocking")))
    density, drawn = protocol.CommandMessage(1, density=EVEN), protocol.CommandMessage(1, strokes=[DOT])
    assert is_rendered_at_once(density, reader, 0) and not is_rendered_at_once(drawn, reader, 0)
    assert not is_rendered_at_once(density, reader, 1), "another package may think about it for long"
