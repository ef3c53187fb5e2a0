"""The ladder of systems is made, goes on where it was stopped, and tells what was played."""

from __future__ import annotations

import copy
import json
import sys

import pytest

from benchmarks.systems_ladder import making
from benchmarks.systems_ladder.__main__ import main
from benchmarks.systems_ladder.making import SystemsConfig, make
from benchmarks.systems_ladder.page import tables, to_markdown
from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError, Stopped
from swarm_pz.evaluation.workers import SerialExecutor

TINY = SystemsConfig(
    systems=("direct",), pilot_games=2, games=2, starts=2, seconds=1, game=GameConfig(drones_per_team=2, time_limit=2.0)
)


@pytest.fixture
def measured(monkeypatch):
    """Measure traits in no time; a list of whose were asked for."""
    asked, number = [], {"mean": 1.0, "ci95": [0.5, 2.0]}

    def measure(system, game, **_):
        asked.append(system)
        changes = dict.fromkeys(("size", "permutation", "captured", "leader", "talk", "loss"), number)
        sizes = {str(size): number for size in (5, 10, 20, 40)}
        return {"system": system, "takes": "any", "coverage": sizes, **changes, "bimodal": None}

    monkeypatch.setattr(making, "measure_traits", measure)
    return asked


def test_a_ladder_that_was_stopped_goes_on_where_it_was_and_is_a_page_with_its_numbers(tmp_path, measured):
    folder, docs, answers = tmp_path / "kept", tmp_path / "docs", iter([False, False, True])
    with pytest.raises(Stopped, match="games are in"):
        make(TINY, folder, docs, processes=1, should_stop=lambda: next(answers))
    before = (folder / "pilot" / "games.jsonl").read_text()
    assert before and measured == []
    results = make(TINY, folder, docs, processes=1, command="this")
    whole = (folder / "pilot" / "games.jsonl").read_text()
    assert whole.startswith(before) and whole != before
    make(TINY, folder, docs, processes=1, command="this")
    assert (folder / "pilot" / "games.jsonl").read_text() == whole and measured == ["direct"]
    assert json.loads((folder / "systems.json").read_text()) == json.loads(json.dumps(results))
    page = (docs / "systems.md").read_text()
    assert "\nthis\n" in page and len(results["pilot"]) == 4
    for name in ("time_to_win", "field"):
        assert f"(images/systems/{name}.png)" in page
        assert (docs / "images" / "systems" / f"{name}.png").stat().st_size > 1000
    for name in tables(results):
        assert f"(tables/{name}.csv)" in page and (docs / "tables" / f"{name}.csv").is_file()
    said = copy.deepcopy(results)
    said["standings"][0] |= {"wins": 3, "draws": 5, "losses": 7, "forfeits": 2}
    said["pilot"] = [{"entrant": "direct/hem_in", "wins": 11, "draws": 13, "losses": 17}]
    said["trained_and_script"] = [
        {"one": f"{name}/trained", "other": f"{name}/hold", "more_often": {"mean": low + 0.1, "ci95": [low, low + 0.2]}}
        for name, low in (("better", 0.1), ("alike", -0.1), ("worse", -0.3))
    ]
    page = to_markdown(said, "images")
    assert "| 3 | 5 | 7 (2 forfeited) |" in page and tables(said)["systems"][1][3:7] == (3, 5, 7, 2)
    assert tables(said)["systems_scripts"][1] == ("direct", "hem_in", 11, 13, 17)
    for name, words in (("better", "wins more"), ("alike", "shows no clear"), ("worse", "wins **less**")):
        assert f"The policy trained for `{name}` {words}" in page
    assert "No policy has been trained for `direct`." in page


@pytest.mark.parametrize("kept", ["{", "[]", '{"settings": {}}', '{"settings": {}, "traits": {}}', "[" * 100_000])
def test_traits_that_are_corrupt_or_of_another_seed_are_refused_by_name(kept, tmp_path, measured):
    def measure_all(config=TINY):
        return making._measure_all(["direct"], config, tmp_path, SerialExecutor(), None, lambda: False)

    assert measure_all() == measure_all()
    with pytest.raises(ResultsError, match="was measured with"):
        measure_all(TINY.replace(seed=1))
    (tmp_path / "direct.json").write_text(kept)
    with pytest.raises(ResultsError, match=r"direct.json is corrupt or foreign .*; delete it"):
        measure_all()


def test_the_command_makes_the_ladder_that_it_was_asked_for(tmp_path, monkeypatch, capsys, measured):
    monkeypatch.setattr(making, "best_scripts", lambda trial: {"direct": "direct/hold"})
    monkeypatch.setattr(making, "trained_for", lambda system, game: "direct/scatter")
    options = "--only direct --games 4 --pilot-games 2 --starts 2 --seconds 1 --processes 1 --game.drones-per-team 2"
    words = [*options.split(), "--game.time-limit", "2", "--folder", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["systems_ladder", *words])
    main()
    assert f"systems: {tmp_path / 'systems.md'}\n" in capsys.readouterr().out
    results = json.loads((tmp_path / "systems.json").read_text())
    assert results["config"] == json.loads(json.dumps(TINY.replace(games=4).to_dict()))
    pilot, contest = (len((tmp_path / part / "games.jsonl").read_text().splitlines()) for part in ("pilot", "contest"))
    assert (pilot, contest) == (4 * 2, 3 * 4), "four scripts play the adversary, and three entrants each other"
    (compared,) = results["trained_and_script"]
    assert (compared["one"], compared["other"]) == ("direct/scatter", "direct/hold")
    monkeypatch.setattr(sys, "argv", ["systems_ladder", "--game.controllers", "direct"])
    with pytest.raises(SystemExit, match=r"game.controllers must be left"):
        main()
