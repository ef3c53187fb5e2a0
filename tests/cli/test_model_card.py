from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from swarm_pz.cli import model_card
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, ResultsError
from swarm_pz.policies import exporting
from swarm_pz.policies.onnx_policy import OnnxCard, write_files
from swarm_pz.policy import load
from tests.cli.conftest import run

ENTRY = Path(__file__).parents[2] / "docs" / "board" / "entries" / "finisher"


def exported(*given):
    write_files(given[-1], OnnxCard(name="mine", origin="me"), b"model")


def card_of(folder=Path("mine"), story=None, digest="", report=None, terms=""):
    """Return a card's metadata, and its text."""
    exported(folder)
    model_card.write(folder, story or {}, digest, report, terms)
    _, front, text = (folder / "README.md").read_text().split("---\n", 2)
    return yaml.safe_load(front), text


def test_hubs_can_read_the_results_that_a_policys_card_records_and_the_reader_the_same(tmp_path):
    """Numbers in words, or metadata cut short by what somebody wrote, would be shown on no hub."""
    match = {"opponent": "uniform", "games": 40, "wins": 38, "win_rate_ci95": [0.835, 0.986]}
    story = {"about": "a: b\n---\n# c", "command": "swarm-pz train", "steps": 64, "seconds": 1.5, "results": match}
    told, text = card_of(story=story, terms="mit")
    (model,) = told["model-index"]
    assert (told["license"], told["library_name"], model["name"]) == ("mit", "swarm-pz", "mine")
    assert {"reinforcement-learning", "pettingzoo", "swarm-pz"} <= {*told["tags"]}
    (found,) = model["results"]
    assert found["dataset"]["config"] == "against uniform" and found["task"]["type"] == "reinforcement-learning"
    (metric,) = found["metrics"]
    assert metric == {
        "type": "games_won", "value": 0.95, "name": "games won, 95 % interval 0.835 to 0.986, 40 games"
    }  # fmt: skip
    assert "| against uniform | 40 | games won | 0.950 | 0.835 to 0.986 |" in text and "a: b --- # c" in text
    assert "```bash\nswarm-pz train\n```" in text and "64 steps in 1.5 s" in text
    for wrong in ({**match, "games": 0}, ["won"]):
        with pytest.raises(CheckpointError, match="are none of matches"):
            card_of(tmp_path / f"of-{type(wrong).__name__}", {"results": wrong})


def test_a_policy_without_results_and_story_claims_none_and_says_how_to_make_them():
    told, text = card_of()
    assert "model-index" not in told and "license" not in told
    assert "None are recorded. `swarm-pz benchmark` makes" in text and "No command is recorded." in text


def test_the_results_of_a_report_are_only_those_of_its_own_policies(tmp_path):
    """A card must not boast with another policy's figures, nor with those of a try."""
    report = json.loads((ENTRY / "report.json").read_text())
    (policy,), figures = report["policies"], report["figures"]
    told, text = card_of(tmp_path / "own", digest=policy["digest"], report=ENTRY)
    scores = {one["dataset"]["config"]: one["metrics"][0]["value"] for one in told["model-index"][0]["results"]}
    expected = {f"track {name}": track["score"] for name, track in figures["tracks"].items()}
    assert scores == pytest.approx(expected | {"all tracks": figures["score"]}, abs=1e-4)
    assert report["signature"] in text and "| track uniform | 200 | score | 1.000 | none |" in text
    with pytest.raises(ResultsError, match=f"digests {policy['digest']}, and this one has .* or other: give"):
        card_of(tmp_path / "another", digest="other", report=ENTRY)


def test_export_writes_the_card_of_the_policy_that_it_exported(monkeypatch, refused):
    monkeypatch.setattr(exporting, "export_learned", exported)
    run("export champion out --card")
    text = Path("out/README.md").read_text()
    card = load("champion", GameConfig()).card
    assert card["command"] in text and all(f"against {name} " in text for name in card["results"]["against"])
    run("export champion bare")
    assert not Path("bare/README.md").exists()
    assert "give the report of this policy" in refused(f"export champion again --card --results {ENTRY}")
    assert not Path("again").exists()
