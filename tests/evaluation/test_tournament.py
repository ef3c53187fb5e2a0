"""Tournaments: no game is lost or played twice, and a player that fails forfeits its own games alone."""

import contextlib
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
        self.fault, self.steps = fault, 0

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
        if self.fault == "crashes":
            os._exit(3)
        if self.fault == "swallows":
            with contextlib.suppress(TimeoutError):
                time.sleep(2.0)
            return answer
        while self.fault == "slow":
            time.sleep(0.01)
        answer[fails] = np.nan
        return answer


def load(name, config):
    name = name.removeprefix("clone_of_")
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


# --- games and files ------------------------------------------------------------------------------


def test_everybody_plays_everybody_in_the_games_of_a_match(tmp_path):
    tournament = played(tmp_path, config=CONFIG.replace(seed=4))
    assert len(lines(tmp_path)) == 3 * 6
    match = play_match("ring", "uniform", games=6, seed=4, config=SHORT)
    games = tournament.between("uniform", "ring")
    for field in ("outcome", "share", "seconds"):
        assert [getattr(game, field) for game in games] == [getattr(game, field) for game in match.games]
    points, counts = tournament.results().payoffs()
    np.testing.assert_allclose(points + points.T, counts)
    i, j = tournament.players.index("ring"), tournament.players.index("uniform")
    assert points[i, j] == pytest.approx(match.score() * len(match.unique))


def test_processes_and_the_order_of_players_change_nothing(tmp_path):
    played(tmp_path / "one")
    played(tmp_path / "two", players=("noise", "uniform", "ring"), processes=2)
    assert without_times(tmp_path / "one") == without_times(tmp_path / "two")


def test_a_pair_that_is_the_same_game_twice_is_one_game_in_every_column(tmp_path):
    config = CONFIG.replace(games=10, game=GameConfig(time_limit=60.0))
    tournament = played(tmp_path, ("ring", "clone_of_ring", "uniform"), config)
    assert all(len(alike) == 2 for alike in tournament.counting("ring", "clone_of_ring"))
    assert {game.outcome for game in tournament.between("ring", "clone_of_ring")} >= {"win", "loss"}
    figures = ladder.make_ladder(tournament)
    entries = {entry["player"]: entry for entry in figures["players"]}
    points, games = tournament.results().payoffs()
    for place, name in enumerate(tournament.players):
        entry = entries[name]
        assert entry["wins"] + entry["draws"] + entry["losses"] == entry["games"] == games[place].sum()
        assert entry["wins"] + entry["draws"] / 2 == points[place].sum()
    counts = ("rating", "games", "wins", "draws", "losses", "median_seconds")
    assert [entries["ring"][name] for name in counts] == [entries["clone_of_ring"][name] for name in counts]
    assert entries["ring"]["games"] == 5 + len(tournament.counting("ring", "uniform"))


def test_an_interrupted_tournament_goes_on_without_losing_or_repeating_a_game(tmp_path):
    played(tmp_path / "whole")
    folder = tmp_path / "broken"
    early = Tournament(("ring", "uniform", "noise"), CONFIG, folder, load)
    assert not folder.exists(), "looking changes nothing"
    played(folder, config=CONFIG.replace(games=2))
    kept = lines(folder)
    with (folder / GAMES).open("a") as file:
        file.write(kept[0][:40])  # killed in the middle of a line
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert len(Tournament(("ring", "uniform"), CONFIG, folder, load).games) == len(kept)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before, "looking changes nothing"
    played(folder)
    assert lines(folder)[: len(kept)] == kept
    assert without_times(folder) == without_times(tmp_path / "whole")
    before = (folder / GAMES).read_bytes()
    early.play()  # which had seen none of these games
    assert (folder / GAMES).read_bytes() == before and early.results().payoffs()[1].sum() > 0


@pytest.mark.skipif(os.name != "posix", reason="needs kill")
def test_one_process_plays_in_a_folder_and_a_killed_one_loses_no_finished_game(tmp_path):
    config = CONFIG.replace(games=40)
    code = (
        "from tests.evaluation.test_tournament import *; from pathlib import Path\n"
        f"Tournament({FOUR}, CONFIG.replace(games=40), Path({str(tmp_path)!r}), load).play(1)"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[2]) as process:  # noqa: S603
        try:
            while not ((tmp_path / GAMES).exists() and lines(tmp_path)):
                assert process.poll() is None
                time.sleep(0.02)
            with pytest.raises(ResultsError, match=f"played in by process {process.pid} on .* use another folder"):
                played(tmp_path, FOUR, config)
        finally:
            process.send_signal(signal.SIGKILL)
    kept = lines(tmp_path)
    played(tmp_path, FOUR, config)
    assert kept and lines(tmp_path)[: len(kept)] == kept
    keys = {tuple(json.loads(line)[key] for key in ("one", "other", "number")) for line in lines(tmp_path)}
    assert len(lines(tmp_path)) == len(keys) == 240


def test_of_more_games_than_are_asked_for_the_first_count(tmp_path):
    games = played(tmp_path, players=("ring", "uniform")).between("ring", "uniform")
    tournament = Tournament(("uniform", "ring"), CONFIG.replace(games=2), tmp_path, load)
    assert tournament.missing() == [] and len(tournament.games) == 6
    assert tournament.between("uniform", "ring") == games[:2] and [game.number for game in games] == [*range(6)]
    count = len({game.fingerprint for game in games[:2]})
    assert {entry["games"] for entry in ladder.make_ladder(tournament)["players"]} == {count}


def test_a_player_that_learned_on_is_refused_even_after_others_played_in_the_folder(tmp_path):
    digest = ["a"]

    def load_learned(name, config):
        player = load(name if name != "learned" else "noise", config)
        if name == "learned":
            player.digest = digest[0]
        return player

    def enter(*players):
        return Tournament(players, CONFIG.replace(games=2, game=SHORT.replace(time_limit=1.0)), tmp_path, load_learned)

    early = enter("learned", "halo")
    digest[0] = "b"
    enter("learned", "ring").play()
    enter("ring", "uniform").play()
    assert enter("learned", "ring").kind("learned") == "learned"
    with pytest.raises(ResultsError, match="learned changed since its games"):
        early.play()
    digest[0] = "c"
    with pytest.raises(ResultsError, match="learned changed since its games"):
        enter("learned", "ring")
    assert len(enter("ring", "uniform").games) == 4


def test_a_folder_of_another_tournament_or_of_nonsense_is_refused(tmp_path):
    def enter(**changes):
        return Tournament(("ring", "uniform"), CONFIG.replace(**changes), tmp_path, load)

    played(tmp_path, ("ring", "uniform"), CONFIG.replace(games=2, game=SHORT.replace(time_limit=1.0)))
    short = {"game": SHORT.replace(time_limit=1.0)}
    for other, name in (({"seed": 1} | short, "seed"), ({"budget_ms": 1.0} | short, "budget_ms"), ({}, "rules")):
        with pytest.raises(ResultsError, match=f"other {name}"):
            enter(**other)
    text = (tmp_path / GAMES).read_text()
    (tmp_path / GAMES).write_text("{}\n" + text)
    with pytest.raises(ResultsError, match="line 1 of"):
        enter(**short)
    settings = json.loads((tmp_path / SETTINGS).read_text())
    for torn in ("{", json.dumps(settings | {"config_hash": "0" * 16})):
        (tmp_path / SETTINGS).write_text(torn)
        with pytest.raises(ResultsError, match="corrupt or foreign"):
            enter(**short)


def test_players_and_numbers_that_cannot_be_are_refused(tmp_path):
    for players in ((), ("ring",), ("ring", "uniform", "ring")):
        with pytest.raises(CommandError, match="two or more players, each named once, got"):
            Tournament(players, CONFIG, tmp_path, load)
    for wrong in ({"games": 3}, {"games": 0}, {"seed": -1}, {"budget_ms": 0.0}, {"budget_ms": 2e7}, {"game": None}):
        with pytest.raises(ConfigError, match=next(iter(wrong))):
            TournamentConfig(**wrong)
    with pytest.raises(ConfigError, match="processes must be"):
        Tournament(("ring", "uniform"), CONFIG, tmp_path, load).play(0)
    assert not (tmp_path / GAMES).exists()


def test_planned_games_are_dealt_out_first_and_a_few_at_a_time(tmp_path):
    tournament = Tournament(("ring", "planner", "uniform"), CONFIG.replace(games=46), tmp_path, load)
    assert (tournament.kind("planner"), tournament.kind("ring")) == ("planned", "scripted")
    blocks = tournament.missing()
    assert all("planner" in block for block in blocks[:46])
    assert [len(numbers) for *_, numbers in blocks] == [2] * 46 + [20, 20, 6]


def test_progress_is_told_among_all_games_that_were_missing(tmp_path):
    players, told = ("halo", "uniform", "centre"), []
    config = CONFIG.replace(games=2, game=GameConfig(drones_per_team=1, time_limit=1.0))
    played(tmp_path, players[:2], config)
    Tournament(players, config, tmp_path, load).play(1, lambda *now: told.append(now))
    assert told == [(0, 4), (2, 4), (4, 4)]
    assert {path.name for path in tmp_path.iterdir()} - {".lock"} == {GAMES, SETTINGS}


# --- forfeits -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ("nan", "must be numbers"), ("raises", "no luck"), ("shape", r"shape \(1, 5"), ("exits", "SystemExit"),
        ("slow", "no command within"), ("swallows", "no command within"),
    ],
)  # fmt: skip
def test_a_player_that_fails_forfeits_that_game_and_the_tournament_goes_on(tmp_path, monkeypatch, fault, reason):
    is_late = fault in ("slow", "swallows")
    patience, budget_ms = (5.0, 200.0) if is_late else (1000.0, 1e6)  # a busy machine makes nobody else late
    monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", patience)
    name = f"faulty_{fault}"
    opponents = ["ring"] if is_late else ["corners", "ring"]  # the first and the second by name
    tournament = played(tmp_path, (name, *opponents), CONFIG.replace(games=8, budget_ms=budget_ms))
    for opponent in opponents:
        games = tournament.between(name, opponent)
        forfeits = [game for game in games if game.forfeit]
        assert len(games) == 8 and 0 < len(forfeits) < (9 if opponent == "corners" else 8)
        for game in forfeits:
            assert (game.outcome, game.share) == (("loss", 0.0) if game.one == name else ("win", 1.0))
            assert (game.outcome_of(name), game.outcome_of(opponent)) == ("loss", "win")
            assert re.match(f"{name}: .*{reason}", game.forfeit) and game.fingerprint == f"forfeit {game.number}"
    entries = {entry["player"]: entry for entry in ladder.make_ladder(tournament)["players"]}
    assert entries[name]["forfeits"] == sum(bool(game.forfeit) for game in tournament.games.values())
    assert all(entries[opponent]["forfeits"] == 0 for opponent in opponents)


class Thinking(Faulty):
    """Thinks for some milliseconds of a clock that only it moves; about one of its commands alone, if that is said."""

    now = 0.0

    def __init__(self, config, milliseconds, about=None):
        super().__init__(config, "never")
        self.milliseconds, self.about = milliseconds, about

    def act(self, observations, rows):
        self.steps += 1
        if self.about in (None, self.steps):
            Thinking.now += 1e-3 * self.milliseconds * len(rows)
        return np.ones((len(rows), 10, 10))


@pytest.fixture
def clock(monkeypatch):
    """Let alarms ring by that clock."""

    @contextlib.contextmanager
    def alarm(seconds):
        began = Thinking.now
        yield
        if Thinking.now - began > seconds + 1e-9:
            raise TimeoutError(f"no command within {seconds:g} s")

    def patient(seconds):
        monkeypatch.setattr("swarm_pz.evaluation.tournament._PATIENCE", seconds)

    monkeypatch.setattr("swarm_pz.evaluation.tournament.alarm", alarm)
    return patient


def test_the_ladder_shows_everybodys_own_thinking(tmp_path, monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.rollout.time.perf_counter", lambda: Thinking.now)
    config = CONFIG.replace(games=4)
    tournament = Tournament(("10", "2", "5"), config, tmp_path, lambda name, config: Thinking(config, int(name)))
    tournament.play()
    assert {game.one: game.thinking_ms for game in tournament.between("2", "10")} == {"10": (10.0, 2.0)}
    shown = {entry["player"]: entry["thinking_ms"] for entry in ladder.make_ladder(tournament)["players"]}
    assert shown == {"2": 2.0, "5": 5.0, "10": 10.0}


@pytest.mark.parametrize(("thinks_ms", "is_late"), [(15, False), (16, True)])
def test_each_game_has_its_own_time_to_think_among_games_that_are_played_side_by_side(clock, thinks_ms, is_late):
    clock(0.0)
    made = []

    def load_thinking(name, config):
        made.append(name)
        return Thinking(config, thinks_ms) if name == "slow" else policies.load(name, config)

    games = play_block(load_thinking, "slow", "uniform", [3, 4, 6, 9], CONFIG.replace(budget_ms=15.0))
    assert [game.number for game in games] == [3, 4, 6, 9]
    assert [game.forfeit.startswith("slow: ") for game in games] == [is_late] * 4
    assert made.count("slow") == (5 if is_late else 1), "only after a fault is each game played on its own"


@pytest.mark.parametrize(("slow_at", "is_late"), [(1, False), (2, True)])
def test_the_first_command_alone_may_take_as_long_as_it_takes_to_get_ready(clock, slow_at, is_late):
    clock(5.0)
    load_slow = lambda name, game: Thinking(game, 1000, slow_at) if name == "slow" else load(name, game)  # noqa: E731
    (game,) = play_block(load_slow, "slow", "uniform", [0], CONFIG.replace(budget_ms=15.0))
    assert bool(game.forfeit) == is_late


def test_time_to_make_a_player_and_to_show_it_a_game_is_nobodys_thinking(clock, monkeypatch):
    clock(5.0)
    observe = BatchEnv.observe

    def late(work):
        def do(*given):
            Thinking.now += 8.0
            return work(*given)

        return do

    monkeypatch.setattr(BatchEnv, "observe", late(observe))
    (game,) = play_block(late(policies.load), "ring", "uniform", [1], CONFIG)
    assert not game.forfeit


def test_a_player_that_cannot_be_made_has_lost_nothing(tmp_path):
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


def test_a_crashed_process_is_named(tmp_path):
    with pytest.raises(ResultsError, match="died while these were played: faulty_crashes against ring"):
        played(tmp_path, ("faulty_crashes", "ring"), processes=2)


# --- stopping -------------------------------------------------------------------------------------


@pytest.mark.parametrize("processes", [1, 2])
def test_a_tournament_that_should_stop_keeps_its_games_and_says_what_is_missing(tmp_path, processes):
    finished = []
    config = CONFIG.replace(game=SHORT.replace(time_limit=1.0))
    tournament = Tournament(FOUR, config, tmp_path, load)
    with pytest.raises(Stopped) as stop:
        tournament.play(processes, lambda done, _: finished.append(done), lambda: finished[-1:] > [0])
    kept, all_games = len(lines(tmp_path)), 6 * config.games
    assert finished[-1] == kept and 0 < kept < all_games
    assert str(stop.value) == f"{kept} games are in {tmp_path}, {all_games - kept} are missing"
    assert len(played(tmp_path, FOUR, config).games) == len(lines(tmp_path)) == all_games


COMMAND = """
import sys
sys.argv = ["swarm-pz", "tournament", "ring", "uniform", "noise", "halo", "--games", "40", "--out", sys.argv[1]]
from swarm_pz.cli import main
main()
"""


def test_ctrl_c_ends_a_tournament_with_the_line_that_goes_on(tmp_path):
    folder = tmp_path / "my ladder"
    code = [sys.executable, "-c", COMMAND, str(folder)]
    with subprocess.Popen(code, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:  # noqa: S603
        while not (folder / GAMES).exists() or not lines(folder):
            assert process.poll() is None
            time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
        said = process.communicate()[1]
    assert process.returncode == 130 and "Traceback" not in said
    assert f"games are in {folder}" in said
    assert f"go on with: swarm-pz tournament ring uniform noise halo --games 40 --out '{folder}'" in said
