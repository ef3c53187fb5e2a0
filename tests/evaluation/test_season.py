"""Seasons: an entry plays or is left out with a reason, and only missing games are played."""

import json
import pickle
import shutil
import sys
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.season import Entries, upsets
from swarm_pz.policies import zoo

SHORT = "--games 2 --processes 1 --game.drones-per-team 2 --game.time-limit 3 --no-field"
BOTS = Path(__file__).parents[2] / "examples" / "bots"


def send(season, name, *, policy=None, **card):
    """Put an entry into a season."""
    folder = season / "entries" / name
    if policy is not None:
        shutil.copytree(zoo.champion.folder.parent / policy, folder)
    else:
        folder.mkdir(parents=True)
        shutil.copy(BOTS / "ring.py", folder)
    lines = [f"{key} = {json.dumps(value)}" for key, value in card.items()]
    (folder / "entry.toml").write_text("\n".join(lines))
    return folder


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 20)


def games_of(season):
    return [json.loads(line) for line in (season / "games.jsonl").read_text().splitlines()]


def test_a_season_plays_what_is_new_alone(tmp_path, capsys):
    season, python = tmp_path / "season", sys.executable
    send(season, "first", policy="hunter", by="<b>Ann</b>", link="https://example.org/?a=1&b=2")
    send(season, "second", policy="champion")
    send(season, "robot", exec=f"{python} ring.py")
    send(season, "Misnamed")
    main(f"season {season} --allow-programs {SHORT}".split())
    early = games_of(season)
    assert {(game["one"], game["other"]) for game in early} == {
        ("first", "robot"), ("first", "second"), ("robot", "second"),
    }  # fmt: skip
    assert len(early) == 6 and not any(game["forfeit"] for game in early)
    page = (season / "index.html").read_text()
    assert "&lt;b&gt;Ann" in page and "<b>Ann" not in page and 'href="https://example.org/?a=1&amp;b=2"' in page
    assert "<li>Misnamed: an entry is a folder" in page
    send(season, "late", exec=f"{python} -c 0")
    main(f"season {season} --allow-programs {SHORT}".split())
    games = games_of(season)
    assert games[: len(early)] == early and len(games) == 12
    assert all(game["forfeit"].startswith("late: exec:") for game in games[len(early) :])
    rows = json.loads((season / "ladder.json").read_text())["players"]
    assert {row["player"]: row["forfeits"] for row in rows} == {"late": 6, "first": 0, "second": 0, "robot": 0}
    page = (season / "index.html").read_text()
    assert "<li>late, 6 games: exec:" in page and "must answer the greeting, but ended with status 0" in page
    with (season / "entries" / "robot" / "ring.py").open("a") as file:
        file.write("# better")
    entries = Entries.read(season, GameConfig(), allow_programs=True)
    assert list(entries.folders) == ["first", "late", "second"], "the others go on"
    assert entries.left_out["robot"].startswith("it changed since its games were played")


@pytest.mark.parametrize(
    ("name", "card", "said"),
    [
        ("robot", {"exec": "python3 ring.py"}, "--allow-programs"),
        ("ring", {"exec": "python3 ring.py"}, "installed player"),
        ("Robot", {}, "a to z"),
        ("robot", {"exec": "./none"}, "no program './none'"),
        ("robot", {"exec": "python3 ring.py", "digest": "0" * 32}, "must have the digest"),
        ("robot", {"exec": "python3 ring.py", "link": "javascript:alert(1)"}, "https://"),
        ("robot", {"by": "a" * 61}, "by 60"),
        ("robot", {"exe": "python3 ring.py"}, "got exe"),
        ("robot", {}, "holds no policy"),
    ],
)
def test_what_cannot_play_is_left_out_with_the_reason(name, card, said, tmp_path):
    send(tmp_path, name, **card)
    send(tmp_path, "good", policy="hunter")
    entries = Entries.read(tmp_path, GameConfig(), allow_programs="--allow" not in said)
    assert list(entries.folders) == ["good"] and said in entries.left_out[name]
    assert pickle.loads(pickle.dumps(entries)).folders == entries.folders  # noqa: S301  (for other processes)


def test_links_are_no_entries_and_a_season_needs_its_folder(tmp_path):
    with pytest.raises(ResultsError, match="folder entries"):
        Entries.read(tmp_path, GameConfig(), allow_programs=False)
    (tmp_path / "entries").mkdir()
    (tmp_path / "entries" / "link").symlink_to(zoo.champion.folder)
    assert "no link" in Entries.read(tmp_path, GameConfig(), allow_programs=False).left_out["link"]


def test_games_to_watch_are_upsets_with_commands_that_play_them():
    ladder = {"seed": 7, "players": [{"player": name, "rating": rating} for name, rating in (("a", 900), ("b", 1000))]}
    won = {"share": 0.0, "outcome": "loss", "fingerprint": ""}  # b wins
    lost = {"share": 1.0, "outcome": "win", "fingerprint": ""}  # a, the lower rated, wins
    games = [
        PlayedGame(one="a", other="b", number=0, seconds=1.0, **won),
        PlayedGame(one="a", other="b", number=2, seconds=9.0, **lost),
        PlayedGame(one="a", other="b", number=5, seconds=8.0, **lost),
        PlayedGame(one="a", other="b", number=6, seconds=2.0, forfeit="b: late", **lost),
    ]
    entries = Entries({"b": Path("entries/b")}, {"b": {}})
    command = "swarm-pz render a entries/b --seed 7 --pair 2 --side blue --out game.mp4"
    assert upsets(ladder, entries, games) == [("a", "b", command, games[2])]
    entries.cards["b"]["exec"] = "python b.py"
    assert not upsets(ladder, entries, games), "render could not run the program in its folder"
