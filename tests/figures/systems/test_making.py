from __future__ import annotations

import json

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, ResultsError, Stopped
from swarm_pz.figures.systems import making
from swarm_pz.figures.systems.making import SystemsConfig, make
from swarm_pz.figures.systems.page import to_markdown

TINY = SystemsConfig(
    systems=("direct",), pilot_games=2, games=2, starts=2, seconds=1, game=GameConfig(drones_per_team=2, time_limit=2.0)
)


@pytest.fixture
def quick_traits(monkeypatch):
    """Traits that take no time, and a list of whose were asked for."""
    asked = []
    number = {"mean": 1.0, "ci95": [0.5, 2.0]}

    def measure(system, game, **_):
        asked.append(system)
        changes = dict.fromkeys(("size", "permutation", "captured", "leader", "talk", "loss"), number)
        sizes = {str(size): number for size in (5, 10, 20, 40)}
        return {"system": system, "takes": "any", "coverage": sizes, **changes, "bimodal": None}

    monkeypatch.setattr(making, "measure_traits", measure)
    return asked


def test_a_ladder_is_a_page_with_pictures_and_its_numbers(tmp_path, quick_traits):
    results = make(TINY, tmp_path / "kept", tmp_path / "docs", processes=1, command="swarm-pz systems")
    assert json.loads((tmp_path / "kept" / "systems.json").read_text()) == json.loads(json.dumps(results))
    page = (tmp_path / "docs" / "systems.md").read_text()
    for name in ("time_to_win", "field"):
        assert f"(images/systems/{name}.png)" in page
        assert (tmp_path / "docs" / "images" / "systems" / f"{name}.png").stat().st_size > 1000
    assert [row["entrant"].split("/")[0] for row in results["standings"]] == ["direct"]
    assert len(results["pilot"]) == 4
    assert results["command"] == "swarm-pz systems" and "swarm-pz systems" in page


def test_a_ladder_that_was_stopped_goes_on_where_it_was(tmp_path, quick_traits):
    folder = tmp_path / "kept"
    answers = iter([False, False, True])
    with pytest.raises(Stopped, match="games are in"):
        make(TINY, folder, tmp_path, processes=1, asked=lambda: next(answers))
    before = (folder / "pilot" / "games.jsonl").read_text()
    assert before and quick_traits == []
    make(TINY, folder, tmp_path, processes=1)
    whole = (folder / "pilot" / "games.jsonl").read_text()
    assert whole.startswith(before) and whole != before
    make(TINY, folder, tmp_path, processes=1)
    assert (folder / "pilot" / "games.jsonl").read_text() == whole
    assert quick_traits == ["direct"]


def test_traits_of_other_settings_are_not_taken_for_these(tmp_path, quick_traits):
    make(TINY, tmp_path, tmp_path, processes=1)
    with pytest.raises(ResultsError, match=r"direct.json was measured with .*; delete it, or use another folder"):
        make(TINY.replace(starts=3), tmp_path, tmp_path, processes=1)


def test_the_quick_ladder_is_short_and_settings_are_checked():
    quick = SystemsConfig().quick
    assert (quick.games, quick.pilot_games, quick.starts, quick.game.time_limit) == (2, 2, 2, 10.0)
    with pytest.raises(ConfigError, match="games must be even"):
        SystemsConfig(games=3)


def test_the_page_says_where_a_trained_policy_does_not_beat_the_best_script(tmp_path, quick_traits):
    results = make(TINY, tmp_path, tmp_path, processes=1)
    number = {"mean": 0.0, "ci95": [0.0, 0.0]}

    def row(system, low, high):
        often = {"mean": (low + high) / 2, "ci95": [low, high]}
        return {"one": f"{system}/trained", "other": f"{system}/hold", "more_often": often, "sooner": number}

    compared = [row("better", 0.1, 0.3), row("alike", -0.1, 0.1), row("worse", -0.3, -0.1)]
    page = to_markdown(results | {"trained_and_script": compared}, "images")
    assert "The policy trained for `better` wins more often than the best script." in page
    assert "The policy trained for `alike` cannot be told from the best script by the games won." in page
    assert "The policy trained for `worse` wins **less** often than the best script." in page
    assert "No policy has been trained for `direct`." in page
