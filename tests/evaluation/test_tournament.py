from __future__ import annotations

import contextlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CommandError, ConfigError, PolicyError, ResultsError, Stopped
from swarm_pz.evaluation import ladder
from swarm_pz.evaluation.ledger import GAMES, SETTINGS
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig, play_block

SHORT = GameConfig(time_limit=8.0, drones_per_team=3)
CONFIG = TournamentConfig(games=6, game=SHORT)
FOUR = ("ring", "uniform", "noise", "halo")


class Faulty:
    """Covers evenly, until something goes wrong in some of its games."""

    observation = ObservationConfig(grid=10, channels=("time_left",))

    def __init__(self, config, fault):
        self.fault = fault
        self.steps = 0

    def reset(self, seeds, rows):
        self.bad = [int(np.random.default_rng(seed).integers(2)) for seed in seeds]
        self.row_of = {row: place for place, row in enumerate(rows.tolist())}

    def act(self, observations, rows):
        self.steps += 1
        answer = np.ones((len(rows), 10, 10))
        fails = np.array([self.bad[self.row_of[row]] == 1 for row in rows.tolist()]) & (self.steps > 2)
        if not fails.any():
            return answer
        if self.fault == "raises":
            raise ZeroDivisionError("no luck")
        if self.fault == "shape":
            return answer[:, :5]
        if self.fault == "exits":
            sys.exit(0)
        if self.fault == "swallows":
            with contextlib.suppress(TimeoutError):
                time.sleep(2.0)
            return answer
        if self.fault == "slow":
            while True:
                time.sleep(0.01)
        answer[fails] = np.nan
        return answer


def load(name, config):
    return Faulty(config, name.removeprefix("faulty_")) if name.startswith("faulty_") else policies.load(name, config)


def played(folder, players=("ring", "uniform", "noise"), config=CONFIG, processes=1):
    tournament = Tournament(players, config, folder, load)
    tournament.play(processes)
    return tournament


def lines(folder):
    return (folder / GAMES).read_text().splitlines()


def without_times(folder):
    games = [json.loads(line) for line in lines(folder)]
    return sorted([{k: v for k, v in game.items() if k != "thinking_ms"} for game in games], key=str)


def test_everybody_plays_everybody_from_both_sides_on_the_same_starts(tmp_path):
    tournament = played(tmp_path, config=CONFIG.replace(seed=4))
    assert len(lines(tmp_path)) == 3 * 6
    match = play_match("ring", "uniform", games=6, seed=4, config=SHORT)
    games = tournament.between("uniform", "ring")
    assert [game.seconds for game in games] == [game.seconds for game in match.games]
    assert [game.outcome for game in games] == [game.outcome for game in match.games]
    assert [game.share for game in games] == [game.share for game in match.games]
    points, counts = tournament.results().payoffs()
    np.testing.assert_allclose(points + points.T, counts)
    i, j = tournament.players.index("ring"), tournament.players.index("uniform")
    expected = sum({"win": 1.0, "draw": 0.5, "loss": 0.0}[game.outcome] for game in match.unique)
    assert points[i, j] == pytest.approx(expected)


def test_processes_and_the_order_of_players_change_nothing(tmp_path):
    played(tmp_path / "one")
    played(tmp_path / "two", players=("noise", "uniform", "ring"), processes=2)
    assert without_times(tmp_path / "one") == without_times(tmp_path / "two")


def test_the_same_game_twice_counts_once(tmp_path):
    tournament = played(tmp_path, players=("uniform", "faulty_never"), config=CONFIG.replace(games=4))
    np.testing.assert_array_equal(tournament.results().points[0, 1], [[0.5, 1.0], [0.5, 1.0]])


def load_clone(name, config):
    return load(name.removeprefix("clone_of_"), config)


def test_a_pair_that_is_the_same_game_twice_is_one_game_in_every_column(tmp_path):
    config = CONFIG.replace(games=10, game=GameConfig(time_limit=60.0))
    tournament = Tournament(("ring", "clone_of_ring", "uniform"), config, tmp_path, load_clone)
    tournament.play()
    assert all(len(alike) == 2 for alike in tournament.counting("ring", "clone_of_ring"))
    assert {game.outcome for game in tournament.between("ring", "clone_of_ring")} >= {"win", "loss"}
    figures = ladder.make_ladder(tournament)
    entries = {entry["player"]: entry for entry in figures["players"]}
    shares = dict(zip(entries, figures["payoffs"], strict=True))
    points, games = tournament.results().payoffs()
    for place, name in enumerate(tournament.players):
        entry = entries[name]
        assert entry["wins"] + entry["draws"] + entry["losses"] == entry["games"] == games[place].sum()
        assert entry["wins"] + entry["draws"] / 2 == points[place].sum()
        counted = [tournament.counting(name, other) for other in tournament.players if other != name]
        assert entry["median_seconds"] == np.median([alike[0].seconds for games in counted for alike in games])
    ring, clone = entries["ring"], entries["clone_of_ring"]
    assert {**ring, "player": "", "thinking_ms": 0, "rating_ci95": 0} == {
        **clone, "player": "", "thinking_ms": 0, "rating_ci95": 0
    }  # fmt: skip
    assert ring["games"] == 5 + len(tournament.counting("ring", "uniform"))
    assert shares["ring"][list(entries).index("clone_of_ring")] == 0.5
    assert f"| {ring['wins']} | {ring['draws']} | {ring['losses']} |" in ladder.to_markdown(figures, "ladder.png")


def test_a_tournament_taken_up_before_another_played_it_plays_nothing_twice(tmp_path):
    early = Tournament(("ring", "uniform", "noise"), CONFIG, tmp_path, load)
    played(tmp_path)
    before = (tmp_path / GAMES).read_bytes()
    early.play()
    assert (tmp_path / GAMES).read_bytes() == before
    assert early.results().payoffs()[1].sum() > 0


def test_looking_at_a_tournament_changes_nothing_in_its_folder(tmp_path):
    Tournament(("ring", "uniform"), CONFIG, tmp_path / "none", load)
    assert not (tmp_path / "none").exists()
    played(tmp_path, players=("ring", "uniform"))
    with (tmp_path / GAMES).open("a") as file:
        file.write("a line that somebody is writi")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()}
    assert len(Tournament(("ring", "uniform"), CONFIG, tmp_path, load).games) == 6
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir() if path.is_file()} == before


def test_an_interrupted_tournament_goes_on_without_losing_or_repeating_a_game(tmp_path):
    played(tmp_path / "whole")
    folder = tmp_path / "broken"
    played(folder, config=CONFIG.replace(games=2))
    with (folder / GAMES).open("a") as file:
        file.write(lines(folder)[0][:40])  # killed in the middle of a line
    kept = lines(folder)[:-1]
    played(folder)
    assert lines(folder)[: len(kept)] == kept
    assert without_times(folder) == without_times(tmp_path / "whole")
    before = (folder / GAMES).read_bytes()
    played(folder)
    assert (folder / GAMES).read_bytes() == before


@pytest.mark.skipif(os.name != "posix", reason="needs kill")
def test_one_process_plays_in_a_folder_and_a_killed_one_loses_no_finished_game(tmp_path):
    code = (
        "from tests.evaluation.test_tournament import *; from pathlib import Path\n"
        f"Tournament({FOUR}, CONFIG.replace(games=40), Path({str(tmp_path)!r}), load).play(1)"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[2]) as process:  # noqa: S603
        try:
            deadline = time.monotonic() + 100
            while not ((tmp_path / GAMES).exists() and lines(tmp_path)) and time.monotonic() < deadline:
                time.sleep(0.02)
            with pytest.raises(ResultsError, match=f"played in by process {process.pid} on .* use another folder"):
                played(tmp_path, players=FOUR, config=CONFIG.replace(games=40))
        finally:
            process.send_signal(signal.SIGKILL)
    kept = lines(tmp_path)
    assert kept
    played(tmp_path, players=FOUR, config=CONFIG.replace(games=40))
    assert lines(tmp_path)[: len(kept)] == kept
    assert (
        len(lines(tmp_path))
        == len({tuple(json.loads(line)[k] for k in ("one", "other", "number")) for line in lines(tmp_path)})
        == 240
    )


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("nan", "must be numbers"),
        ("raises", "no luck"),
        ("shape", r"shape \(1, 5"),
        ("exits", "SystemExit"),
        ("slow", "no command within"),
        ("swallows", "no command within"),
    ],
)
def test_who_fails_forfeits_that_game_and_the_tournament_goes_on(tmp_path, monkeypatch, fault, reason):
    is_late = fault in ("slow", "swallows")
    patience, budget_ms = (5.0, 200.0) if is_late else (1000.0, 1e6)  # a busy machine makes nobody else late
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", patience)
    name = f"faulty_{fault}"
    config = CONFIG.replace(games=8, budget_ms=budget_ms)
    tournament = played(tmp_path, players=(name, "ring"), config=config)
    games = tournament.between(name, "ring")
    assert len(games) == 8
    forfeits = [game for game in games if game.forfeit]
    assert 0 < len(forfeits) < 8
    for game in forfeits:
        assert game.outcome == "loss"
        assert game.forfeit.startswith(name)
        assert re.search(reason, game.forfeit)
    entry = next(e for e in ladder.make_ladder(tournament)["players"] if e["player"] == name)
    assert entry["forfeits"] == len(forfeits)


@pytest.mark.parametrize("opponent", ["corners", "ring"])
def test_a_forfeit_is_the_loss_of_who_failed_whichever_name_comes_first(tmp_path, opponent):
    name = "faulty_raises"
    tournament = played(tmp_path, players=("uniform", opponent, name), config=CONFIG.replace(games=8))
    forfeits = [game for game in tournament.between(name, opponent) if game.forfeit]
    assert {game.number % 2 for game in forfeits} == {0, 1}
    for game in forfeits:
        assert (game.one == name) == (opponent > name)
        assert (game.outcome, game.share) == (("loss", 0.0) if game.one == name else ("win", 1.0))
        assert (game.outcome_of(name), game.outcome_of(opponent)) == ("loss", "win")
        assert game.forfeit.startswith(f"{name}: ")
    entries = {entry["player"]: entry for entry in ladder.make_ladder(tournament)["players"]}
    assert entries[name]["forfeits"] == sum(bool(game.forfeit) for game in tournament.games.values())
    assert entries[opponent]["forfeits"] == entries["uniform"]["forfeits"] == 0


def test_of_more_games_than_are_asked_for_the_first_count(tmp_path):
    games = played(tmp_path, players=("ring", "uniform")).between("ring", "uniform")
    tournament = Tournament(("uniform", "ring"), CONFIG.replace(games=2), tmp_path, load)
    assert tournament.missing() == [] and len(tournament.games) == 6
    assert tournament.between("uniform", "ring") == games[:2] and [game.number for game in games] == [*range(6)]
    assert tournament.results().payoffs()[1].sum() == 2 * len({game.fingerprint for game in games[:2]})
    assert {entry["games"] for entry in ladder.make_ladder(tournament)["players"]} == {
        len({game.fingerprint for game in games[:2]})
    }


def test_who_learned_on_is_refused_even_after_others_played_in_the_folder(tmp_path):
    digest = {"learned": "a"}

    def load_learned(name, config):
        player = load(name if name != "learned" else "noise", config)
        if name == "learned":
            player.digest = digest[name]
        return player

    def enter(*players):
        return Tournament(players, CONFIG.replace(games=2), tmp_path, load_learned)

    early = enter("learned", "halo")
    digest["learned"] = "b"
    enter("learned", "ring").play()
    enter("ring", "uniform").play()
    assert enter("learned", "ring").kind("learned") == "learned"
    with pytest.raises(ResultsError, match="learned changed since its games"):
        early.play()
    digest["learned"] = "c"
    with pytest.raises(ResultsError, match="learned changed since its games"):
        enter("learned", "ring")
    assert len(enter("ring", "uniform").games) == 4


class Thinking(Faulty):
    """Thinks for some milliseconds of a clock that only it moves."""

    now = 0.0

    def act(self, observations, rows):
        Thinking.now += 1e-3 * float(self.fault) * len(rows)
        return np.ones((len(rows), 10, 10))


def test_the_ladder_shows_everybodys_own_thinking(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.rollout.time.perf_counter", lambda: Thinking.now)
    tournament = Tournament(
        ("10", "2", "5"), CONFIG.replace(games=4, game=SHORT), tmp_path, lambda name, config: Thinking(config, name)
    )
    tournament.play()
    assert {game.one: game.thinking_ms for game in tournament.between("2", "10")} == {"10": (10.0, 2.0)}
    shown = {entry["player"]: entry["thinking_ms"] for entry in ladder.make_ladder(tournament)["players"]}
    assert shown == {"2": 2.0, "5": 5.0, "10": 10.0}


@contextlib.contextmanager
def alarm_of_that_clock(seconds):
    began = Thinking.now
    yield
    if Thinking.now - began > seconds + 1e-9:
        raise TimeoutError(f"no command within {seconds:g} s")


@pytest.mark.parametrize(("thinks_ms", "is_late"), [(14, False), (15, False), (16, True)])
def test_each_game_has_its_own_time_to_think_among_games_that_are_played_side_by_side(monkeypatch, thinks_ms, is_late):
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", 0.0)
    monkeypatch.setattr("swarm_pz.evaluation.tournament.alarm", alarm_of_that_clock)
    made = []

    def load_thinking(name, config):
        made.append(name)
        return Thinking(config, name) if name.isdigit() else policies.load(name, config)

    numbers, slow = [3, 4, 6, 9], str(thinks_ms)
    games = play_block(load_thinking, slow, "uniform", numbers, CONFIG.replace(budget_ms=15.0))
    assert [game.number for game in games] == numbers
    assert [bool(game.forfeit) for game in games] == [is_late] * 4
    assert all(game.forfeit.startswith(f"{slow}: ") for game in games if is_late)
    assert made.count(slow) == (5 if is_late else 1), "only after a fault is each game played on its own"


class ThinkingFirst(Thinking):
    """Thinks for long about the first commands of its games, or about the second."""

    def act(self, observations, rows):
        self.steps += 1
        Thinking.now += 1.0 if self.steps == int(self.fault) else 0.0
        return np.ones((len(rows), 10, 10))


@pytest.mark.parametrize(("slow_at", "is_late"), [("1", False), ("2", True)])
def test_the_first_command_alone_may_take_as_long_as_it_takes_to_get_ready(monkeypatch, slow_at, is_late):
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", 5.0)
    monkeypatch.setattr("swarm_pz.evaluation.tournament.alarm", alarm_of_that_clock)

    def load_slow(name, config):
        return policies.load(name, config) if name == "uniform" else ThinkingFirst(config, slow_at)

    (game,) = play_block(load_slow, "slow", "uniform", [0], CONFIG.replace(budget_ms=15.0))
    assert bool(game.forfeit) == is_late


def test_the_time_to_make_a_player_is_nobodys_thinking(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", 5.0)
    monkeypatch.setattr("swarm_pz.evaluation.tournament.alarm", alarm_of_that_clock)

    def load_late(name, config):
        Thinking.now += 8.0
        return policies.load(name, config)

    (game,) = play_block(load_late, "ring", "uniform", [1], CONFIG)
    assert not game.forfeit


def test_what_is_compiled_to_show_a_game_is_nobodys_thinking(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", 5.0)
    monkeypatch.setattr("swarm_pz.evaluation.tournament.alarm", alarm_of_that_clock)
    observe = BatchEnv.observe

    def observe_late(*arguments):
        Thinking.now += 8.0
        return observe(*arguments)

    monkeypatch.setattr(BatchEnv, "observe", observe_late)
    (game,) = play_block(policies.load, "ring", "uniform", [1], CONFIG)
    assert not game.forfeit


MADE_LATE = """
import time
for _ in range(30):
    time.sleep(0.02)

from swarm_pz.policies.scripted import uniform

def make(config):
    return uniform(config)
"""


def test_a_player_whose_module_takes_longer_to_import_than_it_may_think_plays(tmp_path, monkeypatch):
    (tmp_path / "made_late.py").write_text(MADE_LATE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", 0.1)

    def load_late(name, config):
        return __import__("made_late").make(config) if name == "late" else policies.load(name, config)

    monkeypatch.delitem(sys.modules, "made_late", raising=False)
    (game,) = play_block(load_late, "late", "ring", [0], CONFIG.replace(budget_ms=200.0))
    assert not game.forfeit and "made_late" in sys.modules


def test_who_cannot_be_made_has_lost_nothing(tmp_path):
    made = []

    def load_once(name, config):
        made.append(name)
        if name == "ring" and made.count(name) > 1:
            raise AttributeError("partially initialized module")
        return policies.load(name, config)

    tournament = Tournament(("ring", "uniform"), CONFIG, tmp_path, load_once)
    with pytest.raises(PolicyError, match="ring cannot be made: AttributeError"):
        tournament.play()
    assert not (tmp_path / GAMES).exists()


def test_the_ladder_orders_plots_and_tells(tmp_path):
    config = CONFIG.replace(games=20, game=GameConfig(time_limit=60.0))
    tournament = played(tmp_path, players=("corners", "uniform", "halo"), config=config)
    figures = ladder.make_ladder(tournament)
    assert [entry["player"] for entry in figures["players"]] == ["halo", "uniform", "corners"]
    assert figures["players"][1]["rating"] == 1000.0
    assert figures["players"][0]["kind"] == "scripted"
    payoffs = np.array(figures["payoffs"], float)
    np.testing.assert_allclose(payoffs + payoffs.T, np.where(np.eye(3) == 1, np.nan, 1.0), atol=2e-4)
    points, games = tournament.results().payoffs()
    for (i, one), (j, other) in itertools.permutations(enumerate(["halo", "uniform", "corners"]), 2):
        at = tournament.players.index(one), tournament.players.index(other)
        assert payoffs[i, j] == pytest.approx(points[at] / games[at], abs=1e-4)
    json.dumps(figures)
    text = ladder.to_markdown(figures, "ladder.png")
    assert "| 1 | `halo` | scripted |" in text
    ladder.plot(figures, tmp_path / "ladder.png")
    assert (tmp_path / "ladder.png").stat().st_size > 10_000


def test_a_folder_of_another_tournament_is_refused(tmp_path):
    played(tmp_path, players=("ring", "uniform"), config=CONFIG.replace(games=2))
    with pytest.raises(ResultsError, match="other seed"):
        Tournament(("ring", "uniform"), CONFIG.replace(seed=1), tmp_path, load)
    with pytest.raises(ResultsError, match="other budget_ms"):
        Tournament(("ring", "uniform"), CONFIG.replace(budget_ms=1.0), tmp_path, load)
    with pytest.raises(ResultsError, match="other rules"):
        Tournament(("ring", "uniform"), CONFIG.replace(game=GameConfig()), tmp_path, load)
    settings = json.loads((tmp_path / SETTINGS).read_text())
    for torn in ("{", json.dumps(settings | {"config_hash": "0" * 16})):
        (tmp_path / SETTINGS).write_text(torn)
        with pytest.raises(ResultsError, match="corrupt or foreign"):
            Tournament(("ring", "uniform"), CONFIG, tmp_path, load)


def test_a_corrupt_line_is_named(tmp_path):
    played(tmp_path, players=("ring", "uniform"), config=CONFIG.replace(games=2))
    text = (tmp_path / GAMES).read_text()
    (tmp_path / GAMES).write_text("{}\n" + text)
    with pytest.raises(ResultsError, match="line 1 of"):
        Tournament(("ring", "uniform"), CONFIG, tmp_path, load)


def test_bad_fields_are_refused(tmp_path):
    for players in ((), ("ring",), ("ring", "uniform", "ring")):
        with pytest.raises(CommandError, match="two or more players, each named once, got"):
            Tournament(players, CONFIG, tmp_path, load)
    with pytest.raises(PolicyError, match="no policy 'rign'"):
        Tournament(("rign", "uniform"), CONFIG, tmp_path, load)
    for wrong in ({"games": 3}, {"games": 0}, {"seed": -1}, {"budget_ms": 0.0}, {"budget_ms": 2e7}, {"game": None}):
        with pytest.raises(ConfigError, match=next(iter(wrong))):
            TournamentConfig(**wrong)
    with pytest.raises(ConfigError, match="processes must be"):
        Tournament(("ring", "uniform"), CONFIG, tmp_path, load).play(0)
    assert not (tmp_path / GAMES).exists()


def test_planned_games_are_dealt_out_first_and_a_few_at_a_time(tmp_path):
    tournament = Tournament(("ring", "planner", "uniform"), CONFIG.replace(games=46), tmp_path, load)
    assert tournament.privileged == {"planner"} and tournament.kind("planner") == "planned"
    assert tournament.kind("ring") == "scripted"
    blocks = tournament.missing()
    planned = [block for block in blocks if "planner" in block]
    assert blocks[: len(planned)] == planned
    assert [len(numbers) for *_, numbers in planned] == [2] * 46
    assert [len(numbers) for *_, numbers in blocks[len(planned) :]] == [20, 20, 6]


def test_the_games_that_are_done_are_told_among_all_that_were_missing(tmp_path):
    players, told = ("halo", "uniform", "centre"), []
    config = CONFIG.replace(games=2, game=GameConfig(drones_per_team=1, time_limit=1.0))
    played(tmp_path, players[:2], config)
    Tournament(players, config, tmp_path, load).play(1, lambda *now: told.append(now))
    assert told == [(0, 4), (2, 4), (4, 4)]
    assert {path.name for path in tmp_path.iterdir()} - {".lock"} == {GAMES, SETTINGS}


class Crashing(Faulty):
    def act(self, observations, rows):
        os._exit(3)


def load_crashing(name, config):
    return Crashing(config, "") if name == "crashing" else policies.load(name, config)


def test_a_crashed_process_is_named(tmp_path):
    tournament = Tournament(("crashing", "ring"), CONFIG, tmp_path, load_crashing)
    with pytest.raises(ResultsError, match="died while these were played: crashing against ring"):
        tournament.play(2)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_tournament_that_is_asked_to_stop_keeps_its_games_and_says_what_is_missing(tmp_path, processes):
    finished = []
    tournament = Tournament(("ring", "uniform", "noise", "halo"), CONFIG, tmp_path, load)
    with pytest.raises(Stopped) as stop:
        tournament.play(processes, lambda done, _: finished.append(done), lambda: finished[-1:] > [0])
    kept, all_games = len(lines(tmp_path)), 6 * CONFIG.games
    assert finished[-1] == kept and 0 < kept < all_games
    assert str(stop.value) == f"{kept} games are in {tmp_path}, {all_games - kept} are missing"
    again = played(tmp_path, ("ring", "uniform", "noise", "halo"))
    assert len(lines(tmp_path)) == len(again.games) == all_games


COMMAND = """
import sys, threading, _thread
sys.argv = ["swarm-pz", "tournament", "ring", "uniform", "noise", "halo", "--games", "40", "--out", sys.argv[1]]
from swarm_pz.cli import main
main()
"""


def test_ctrl_c_ends_a_tournament_with_the_line_that_goes_on(tmp_path):
    folder = tmp_path / "my ladder"
    code = [sys.executable, "-c", COMMAND, str(folder)]
    with subprocess.Popen(code, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:  # noqa: S603
        began = time.monotonic()
        while not (folder / GAMES).exists() or not lines(folder):
            assert process.poll() is None and time.monotonic() - began < 300
            time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
        said = process.communicate(timeout=300)[1]
    assert process.returncode == 130
    assert f"games are in {folder}" in said
    assert f"go on with: swarm-pz tournament ring uniform noise halo --games 40 --out '{folder}'" in said
    assert "Traceback" not in said
