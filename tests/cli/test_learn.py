"""Output of ``sweep``, ``league`` and the searches of ``evaluate``."""

from pathlib import Path

import pytest
import yaml

from swarm_pz.cli import model_card
from swarm_pz.config import GameConfig
from swarm_pz.policy import load

OUT = Path("runs/mine")


@pytest.mark.parametrize("name", ["champion", "finisher", "hunter"])
def test_the_readme_of_an_exported_policy_has_its_training_and_results_and_metadata_for_hubs(name, tmp_path):
    story = load(name, GameConfig()).card
    model_card.write(tmp_path, "mine", story)
    _, front, text = (tmp_path / "README.md").read_text().split("---\n", 2)
    assert yaml.safe_load(front)["library_name"] == "swarm-pz"
    found = story["results"]["against"]["ring"]
    assert f"| ring | {found['games']} | {found['wins']} | {found['draws']} | {found['losses']} |" in text
    assert story["command"] in text
    model_card.write(tmp_path, "bare", {})
    assert "Trained by `unknown`" in (tmp_path / "README.md").read_text()
