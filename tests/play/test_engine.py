"""The page's engine computes each tick as the simulator does, from the simulator's state."""

import re

from tests.play.engine_cases import compare_in_node, write_cases

SEEDS = (11, 39)
"""Games of 6 and 40 red drones against 6 and 21 blue ones."""


def test_the_page_plays_as_the_simulator_does(node, tmp_path):
    write_cases(tmp_path, SEEDS, seconds=12, every=10)
    ran = compare_in_node(node, tmp_path)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert sum(map(int, re.findall(r'"captures":(\d+)', ran.stdout))) > 20
