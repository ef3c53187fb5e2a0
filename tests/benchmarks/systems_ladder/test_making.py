from __future__ import annotations

import copy
import json
import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest

from benchmarks.systems_ladder import making
from benchmarks.systems_ladder.making import SystemsConfig, make
from benchmarks.systems_ladder.page import tables, to_markdown
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, ResultsError, Stopped
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.workers import SerialExecutor

TINY = SystemsConfig(
    systems=("direct",), pilot_games=2, games=2, starts=2, seconds=1, game=GameConfig(drones_per_team=2, time_limit=2.0)
)


def measure_quickly(monkeypatch):
    """Give traits that take no time, and a list of whose were asked for."""
    asked = []
    number = {"mean": 1.0, "ci95": [0.5, 2.0]}

    def measure(system, game, **_):
        asked.append(system)
        changes = dict.fromkeys(("size", "permutation", "captured", "leader", "talk", "loss"), number)
        sizes = {str(size): number for size in (5, 10, 20, 40)}
        return {"system": system, "takes": "any", "coverage": sizes, **changes, "bimodal": None}

    monkeypatch.setattr(making, "measure_traits", measure)
    return asked


@pytest.fixture
def quick_traits(monkeypatch):
    return measure_quickly(monkeypatch)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A ladder that is made once, to be read: its folder and its results."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as monkeypatch:
        measure_quickly(monkeypatch)
        results = make(
            TINY, folder / "kept", folder / "docs", processes=1, command="python -m benchmarks.systems_ladder"
        )
    return folder, results


@pytest.fixture
def results(made):
    return copy.deepcopy(made[1])


def test_a_ladder_is_a_page_with_pictures_and_its_numbers(made):
    folder, results = made
    assert json.loads((folder / "kept" / "systems.json").read_text()) == json.loads(json.dumps(results))
    page = (folder / "docs" / "systems.md").read_text()
    for name in ("time_to_win", "field"):
        assert f"(images/systems/{name}.png)" in page
        assert (folder / "docs" / "images" / "systems" / f"{name}.png").stat().st_size > 1000
    for name in tables(results):
        assert f"(tables/{name}.csv)" in page and (folder / "docs" / "tables" / f"{name}.csv").is_file()
    assert [row["entrant"].split("/")[0] for row in results["standings"]] == ["direct"]
    assert len(results["pilot"]) == 4
    assert results["command"] == "python -m benchmarks.systems_ladder" and "benchmarks.systems_ladder" in page


def test_a_ladder_that_was_stopped_goes_on_where_it_was(tmp_path, quick_traits):
    folder = tmp_path / "kept"
    answers = iter([False, False, True])
    with pytest.raises(Stopped, match="games are in"):
        make(TINY, folder, tmp_path, processes=1, should_stop=lambda: next(answers))
    before = (folder / "pilot" / "games.jsonl").read_text()
    assert before and quick_traits == []
    make(TINY, folder, tmp_path, processes=1)
    whole = (folder / "pilot" / "games.jsonl").read_text()
    assert whole.startswith(before) and whole != before
    make(TINY, folder, tmp_path, processes=1)
    assert (folder / "pilot" / "games.jsonl").read_text() == whole
    assert quick_traits == ["direct"]


def test_traits_of_other_settings_are_not_taken_for_these(tmp_path, quick_traits, made):
    shutil.copytree(made[0] / "kept", tmp_path, dirs_exist_ok=True)
    with pytest.raises(ResultsError, match=r"direct.json was measured with .*; delete it, or use another folder"):
        make(TINY.replace(starts=3), tmp_path, tmp_path, processes=1)


def test_traits_of_another_seed_are_not_taken_for_these(tmp_path, quick_traits):
    measured = making._measure_all(["direct"], TINY, tmp_path, SerialExecutor(), None, lambda: False)
    assert making._measure_all(["direct"], TINY, tmp_path, SerialExecutor(), None, lambda: False) == measured
    with pytest.raises(ResultsError, match="was measured with"):
        making._measure_all(["direct"], TINY.replace(seed=1), tmp_path, SerialExecutor(), None, lambda: False)


def test_traits_that_are_measured_side_by_side_are_kept_as_those_of_their_systems(tmp_path, quick_traits):
    names = ["direct", "ergodic", "flocking"]
    with ThreadPoolExecutor(2) as pool:
        found = making._measure_all(names, TINY, tmp_path, pool, None, lambda: False)
        assert [one["system"] for one in found] == names
        assert making._measure_all(names, TINY, tmp_path, pool, None, lambda: False) == found
    assert sorted(quick_traits) == names, "the second time they are read"


@pytest.mark.parametrize("kept", ["{", "[]", '{"settings": {}}', '{"settings": {}, "traits": {}}', "[" * 100_000])
def test_corrupt_traits_are_refused_by_name(kept, tmp_path, quick_traits):
    making._measure_all(["direct"], TINY, tmp_path, SerialExecutor(), None, lambda: False)
    (tmp_path / "direct.json").write_text(kept)
    with pytest.raises(ResultsError, match=r"direct.json is corrupt or foreign .*; delete it, or use another folder"):
        making._measure_all(["direct"], TINY, tmp_path, SerialExecutor(), None, lambda: False)


def test_two_ladders_are_not_made_in_one_folder(tmp_path, quick_traits):
    with folder_lock(tmp_path), pytest.raises(ResultsError, match="is being played in by process"):
        make(TINY, tmp_path, tmp_path, processes=1)


def test_the_page_of_few_games_says_so(made, results):
    assert "only shows that everything works" in (made[0] / "docs" / "systems.md").read_text()
    results["config"]["games"] = 40
    assert "everything works" not in to_markdown(results, "images")


def test_the_quick_ladder_is_short_and_settings_are_checked():
    quick = SystemsConfig().quick
    assert (quick.games, quick.pilot_games, quick.starts, quick.game.time_limit) == (2, 2, 2, 10.0)
    with pytest.raises(ConfigError, match="games must be even"):
        SystemsConfig(games=3)


def test_the_pilot_and_the_contest_play_as_many_games_as_each_is_to(tmp_path, monkeypatch, quick_traits):
    monkeypatch.setattr(making, "best_scripts", lambda trial: {"direct": "direct/hold"})
    monkeypatch.setattr(making, "trained_for", lambda system, game: "direct/scatter")
    results = make(TINY.replace(games=4), tmp_path, tmp_path, processes=1)
    pilot, contest = (
        len((tmp_path / part / "games.jsonl").read_text().splitlines()) for part in (making.PILOT, making.CONTEST)
    )
    assert (pilot, contest) == (4 * 2, 3 * 4), "four scripts play the adversary, and three entrants each other"
    (compared,) = results["trained_and_script"]
    assert (compared["one"], compared["other"]) == ("direct/scatter", "direct/hold")


def test_the_page_tells_wins_draws_losses_and_forfeits_in_this_order(results):
    row = results["standings"][0] | {"wins": 3, "draws": 5, "losses": 7, "forfeits": 2}
    trial = {"entrant": "direct/hem_in", "wins": 11, "draws": 13, "losses": 17}
    told = results | {"standings": [row], "pilot": [trial]}
    assert "| 3 | 5 | 7 (2 forfeited) |" in to_markdown(told, "images")
    assert tables(told)["systems"][1][3:7] == (3, 5, 7, 2)
    assert tables(told)["systems_scripts"][1] == ("direct", "hem_in", 11, 13, 17)


def test_the_page_says_where_a_trained_policy_does_not_beat_the_best_script(results):
    number = {"mean": 0.0, "ci95": [0.0, 0.0]}

    def row(system, low, high):
        often = {"mean": (low + high) / 2, "ci95": [low, high]}
        return {"one": f"{system}/trained", "other": f"{system}/hold", "more_often": often, "sooner": number}

    compared = [row("better", 0.1, 0.3), row("alike", -0.1, 0.1), row("worse", -0.3, -0.1)]
    page = to_markdown(results | {"trained_and_script": compared}, "images")
    assert "The policy trained for `better` wins more often than the best script." in page
    assert "The policy trained for `alike` shows no clear difference from the best script in games won." in page
    assert "The policy trained for `worse` wins **less** often than the best script." in page
    assert "No policy has been trained for `direct`." in page
