"""The ladder of systems is made, goes on where it was stopped, and tells what was played."""

from __future__ import annotations

import copy
import json
import sys

import pytest

from benchmarks.systems_ladder import making
from benchmarks.systems_ladder.__main__ import main
from benchmarks.systems_ladder.contest import ADVERSARY, TRACKS
from benchmarks.systems_ladder.making import SystemsConfig, make
from benchmarks.systems_ladder.page import tables, to_markdown
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, ResultsError, Stopped
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
        names = ("own", "size", "permutation", "captured", "leader", "talk", "loss")
        even = dict.fromkeys(TRACKS, number)
        shown = {"system": system, "takes": "any", "target": "middle", "even": even, "bimodal": None}
        return shown | dict.fromkeys(names, number)

    monkeypatch.setattr(making, "measure_traits", measure)
    return asked


def test_a_ladder_that_was_stopped_goes_on_where_it_was_and_is_a_page_with_its_numbers(tmp_path, measured):
    folder, docs, answers = tmp_path / "kept", tmp_path / "docs", iter([False, False, True])
    with pytest.raises(Stopped, match="games are in"):
        make(TINY, folder, docs, processes=1, should_stop=lambda: next(answers))
    before = (folder / "hovering" / "pilot" / "games.jsonl").read_text()
    assert before and measured == []
    results = make(TINY, folder, docs, processes=1, command="this")
    whole = (folder / "hovering" / "pilot" / "games.jsonl").read_text()
    assert whole.startswith(before) and whole != before
    make(TINY, folder, docs, processes=1, command="this")
    assert (folder / "hovering" / "pilot" / "games.jsonl").read_text() == whole and measured == ["direct"]
    assert json.loads((folder / "systems.json").read_text()) == json.loads(json.dumps(results))
    page = (docs / "systems.md").read_text()
    with pytest.raises(ConfigError, match="tracks must be of hovering, fixed_wing"):
        TINY.replace(tracks=("gliding",))
    assert "\nthis\n" in page and len(results["tracks"]["fixed_wing"]["pilot"]) == 4
    for name in ("time_to_win", *TRACKS):
        assert f"(images/systems/{name}.png)" in page
        assert (docs / "images" / "systems" / f"{name}.png").stat().st_size > 1000
    for name in tables(results):
        assert f"(tables/{name}.csv)" in page and (docs / "tables" / f"{name}.csv").is_file()


def test_the_page_says_who_wins_and_what_the_game_is_worth(tmp_path, measured):
    said = copy.deepcopy(make(TINY, tmp_path, tmp_path, processes=1))
    told = said["tracks"]["fixed_wing"]
    row = told["standings"][0] | {"draws": 5, "losses": 7, "forfeits": 2}
    rows = [
        row
        | {"time_to_win": {"mean": 77.0, "ci95": [70.0, 80.0]}}
        | {"system": system, "player": player, "wins": wins, "against_all": share, "mixture": mixed}
        for system, player, wins, share, mixed in (
            ("better", "trained", 33, 0.666, 0.75),
            ("worse", "some", 3, 0.2, 0.0),
        )
    ]
    order = ["better/trained", "better/halo", "ergodic/uniform"]
    game = {"mixture": [0.25, 0.748, 0.002], "guaranteed": 0.41, "wins": 0.123, "safest": [1.0, 0.0, 0.0]}
    told |= {"standings": rows, "order": order, "game": game}
    told["pilot"] = [{"entrant": "direct/hem_in", "wins": 11, "draws": 13, "losses": 17}]
    even = {"hovering": {"mean": 2.0}, "fixed_wing": {"mean": 1.0}}
    said["traits"] = [said["traits"][0] | {"system": "worse", "target": "even", "even": even}]
    said["tracks"] = {"hovering": told, "fixed_wing": told}
    page = to_markdown(said, "images")
    assert "**Fixed wing**: `better` wins most, commanded by a trained policy: 67 % of the games" in page
    assert "| `better` | a trained policy | 67 | 77 | 75 |" in page and "| `worse` | `some` | 20 | 77 | 0 |" in page
    assert "guaranteed share of wins is **41 %**. The mixture is `better/halo` 75 %, `better/trained` 25 %;" in page
    assert "Fixed wing: `worse` covers most evenly, and is number 2 of 2." in page
    assert tables(said)["systems"][3][6:10] == (33, 5, 7, 2)
    assert tables(said)["systems_scripts"][1] == ("hovering", "direct", "hem_in", 11, 13, 17)


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
    monkeypatch.setattr(making, "best_players", lambda trial: ["direct/hold", "direct/scatter"])
    options = "--only direct --games 4 --pilot-games 2 --starts 2 --seconds 1 --processes 1 --game.drones-per-team 2"
    words = [*options.split(), "--game.time-limit", "2", "--folder", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["systems_ladder", *words])
    main()
    assert f"systems: {tmp_path / 'systems.md'}\n" in capsys.readouterr().out
    results = json.loads((tmp_path / "systems.json").read_text())
    assert results["config"] == json.loads(json.dumps(TINY.replace(games=4).to_dict()))
    for track in TRACKS:
        parts = (tmp_path / track / part / "games.jsonl" for part in ("pilot", "contest"))
        pilot, contest = (len(part.read_text().splitlines()) for part in parts)
        assert (pilot, contest) == (4 * 2, 6 * 4), "four scripts play the adversary, and three entrants all"
        assert set(results["tracks"][track]["order"]) == {"direct/scatter", "direct/hold", ADVERSARY}
    monkeypatch.setattr(sys, "argv", ["systems_ladder", "--game.controllers", "direct"])
    with pytest.raises(SystemExit, match=r"game.controllers must be left"):
        main()
    monkeypatch.setattr(sys, "argv", ["systems_ladder", "--game.dynamics.min-speed", "0.2"])
    with pytest.raises(SystemExit, match=r"game.dynamics.min_speed must be left at 0: the tracks are hovering"):
        main()
