"""Tournaments: no game is lost or played twice, and a player that fails forfeits its own games alone."""

import contextlib
import dataclasses
import json
import os
import shlex
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation import ladder
from swarm_pz.evaluation.ledger import GAMES, SETTINGS, folder_lock
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig, play_block

SHORT = GameConfig(time_limit=4.0, drones_per_team=2)
CONFIG = TournamentConfig(games=4, game=SHORT)
FOUR = ("ring", "uniform", "noise", "halo")


class Faulty:
    """Covers evenly, until something goes wrong in some of its games."""

    observation = ObservationConfig(grid=10, channels=("time_left",))

    def __init__(self, fault):
        self.fault, self.steps = fault, 0

    def reset(self, seeds, rows):
        self.bad = [int(np.random.default_rng(seed).integers(2)) for seed in seeds]
        self.row_of = {row: place for place, row in enumerate(rows.tolist())}

    def act(self, observations, rows):
        self.steps += 1
        answer = np.ones((len(rows), 10, 10))
        fails = np.array([self.bad[self.row_of[row]] == 1 for row in rows.tolist()]) & (self.steps > 2)
        if fails.any():
            while self.fault == "slow":
                time.sleep(0.01)
            answer[fails] = np.nan
        return answer


def load(name, config):
    return Faulty(name.removeprefix("faulty_")) if name.startswith("faulty_") else policies.load(name, config)


def played(folder, players=FOUR, config=CONFIG, processes=1):
    tournament = Tournament(players, config, folder, load)
    tournament.play(processes)
    return tournament


def lines(folder):
    return (folder / GAMES).read_text().splitlines()


def without_times(folder):
    games = [json.loads(line) for line in lines(folder)]
    return sorted([{k: v for k, v in game.items() if k != "thinking_ms"} for game in games], key=str)


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    monkeypatch.setattr("swarm_pz.evaluation.ratings._RESAMPLES", 20)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A tournament of four that nobody interrupted."""
    return played(tmp_path_factory.mktemp("whole"))


# --- games and files ------------------------------------------------------------------------------


def test_everybody_plays_everybody_in_the_games_of_a_match(whole):
    assert len(lines(whole.folder)) == 6 * 4
    assert {path.name for path in whole.folder.iterdir()} - {".lock"} == {GAMES, SETTINGS}
    match = play_match("ring", "uniform", games=4, config=SHORT)
    games = whole.between("uniform", "ring")
    for field in ("outcome", "share", "seconds", "sent"):
        assert [getattr(game, field) for game in games] == [getattr(game, field) for game in match.games]
    assert [game.number for game in games] == [*range(4)]
    points, counts = whole.results().payoffs()
    np.testing.assert_allclose(points + points.T, counts)
    assert points[0, 1] == pytest.approx(match.score() * len(match.unique))


def test_an_interrupted_tournament_goes_on_without_losing_or_repeating_a_game(whole, tmp_path):
    folder = tmp_path / "broken"
    early = Tournament(FOUR, CONFIG, folder, load)
    assert not folder.exists(), "looking changes nothing"
    played(folder, config=CONFIG.replace(games=2))
    kept = lines(folder)
    with (folder / GAMES).open("a") as file:
        file.write(kept[0][:40])  # killed in the middle of a line
    (folder / ".holder").write_text("process 1")
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert len(Tournament(FOUR[:2], CONFIG, folder, load).games) == len(kept)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before, "looking changes nothing"
    with (
        folder_lock(folder),
        pytest.raises(ResultsError, match=f"played in by process {os.getpid()} on .* use another folder"),
    ):
        played(folder)
    progress = []
    Tournament(FOUR, CONFIG, folder, load).play(1, lambda *now: progress.append(now))
    assert progress == [(done, 12) for done in range(0, 13, 2)], "among all games that were missing"
    assert lines(folder)[: len(kept)] == kept
    assert without_times(folder) == without_times(whole.folder)
    before = (folder / GAMES).read_bytes()
    early.play()  # opened before these games were played
    assert (folder / GAMES).read_bytes() == before and early.results().payoffs()[1].sum() > 0


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
    assert enter("learned", "ring").sorts["learned"] == "learned"
    with pytest.raises(ResultsError, match="learned changed"):
        early.play()
    digest[0] = "c"
    with pytest.raises(ResultsError, match="learned changed"):
        enter("learned", "ring")
    assert len(enter("ring", "uniform").games) == 4


def test_a_folder_of_another_tournament_or_of_nonsense_is_refused(tmp_path):
    def enter(**changes):
        return Tournament(("ring", "uniform"), CONFIG.replace(**changes), tmp_path, load)

    enter(games=2).play()
    for other, name in (({"seed": 1}, "seed"), ({"budget_ms": 1.0}, "budget_ms"), ({"game": GameConfig()}, "rules")):
        with pytest.raises(ResultsError, match=f"other {name}"):
            enter(**other)
    (tmp_path / GAMES).write_text("{}\n" + (tmp_path / GAMES).read_text())
    with pytest.raises(ResultsError, match="line 1 of"):
        enter()
    settings = json.loads((tmp_path / SETTINGS).read_text())
    for torn in ("{", json.dumps(settings | {"config_hash": "0" * 16})):
        (tmp_path / SETTINGS).write_text(torn)
        with pytest.raises(ResultsError, match="corrupt or foreign"):
            enter()


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (b"[" * 100_000, "Recursion"),
        (b'{"outcome": "banana"}', "outcome must be 'win' or 'draw' or 'loss', got 'banana'"),
        (b'{"sent": [1, "2"]}', "sent must be"),
        (b"\xff", "UnicodeDecodeError"),
    ],
)
def test_a_line_that_is_no_game_is_named(line, reason, whole, tmp_path):
    first = json.loads(lines(whole.folder)[0])
    if line.startswith(b"{"):
        line = json.dumps(first | json.loads(line)).encode()
    (tmp_path / GAMES).write_bytes(json.dumps(first).encode() + b"\n" + line + b"\n")
    with pytest.raises(ResultsError, match=f"line 2 of .*{GAMES} is not a finished game: .*({reason})"):
        Tournament(FOUR, CONFIG, tmp_path, load)


# --- forfeits -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("fault", "reason"), [("nan", "must be numbers"), ("slow", "no command within")])
def test_a_player_that_fails_forfeits_that_game_and_the_tournament_goes_on(tmp_path, fault, reason):
    budget_ms = 200.0 if fault == "slow" else 1e6  # a busy machine makes nobody else late
    name, opponents = f"faulty_{fault}", ["corners", "ring"]  # before and after it by name
    opponents = opponents[fault == "slow" :]
    tournament = played(tmp_path, (name, *opponents), CONFIG.replace(games=6, budget_ms=budget_ms))
    forfeits = [game for opponent in opponents for game in tournament.between(name, opponent) if game.forfeit]
    assert 0 < len(forfeits) < 6 * len(opponents), "in some of its games it is well"
    for game in forfeits:
        assert (game.outcome, game.share) == (("loss", 0.0) if game.one == name else ("win", 1.0))
        assert game.outcome_of(name) == "loss" and game.fingerprint == f"forfeit {game.number}"
        assert game.forfeit.startswith(f"{name}: ") and reason in game.forfeit
    entries = {entry["player"]: entry["forfeits"] for entry in ladder.make_ladder(tournament)["players"]}
    assert entries == {name: len(forfeits)} | dict.fromkeys(opponents, 0)


class Thinking(Faulty):
    """Takes some milliseconds of a clock that only it moves: for each command, or only for number `about`."""

    now = 0.0

    def __init__(self, milliseconds, about=None):
        super().__init__("never")
        self.milliseconds, self.about = milliseconds, about

    def act(self, observations, rows):
        self.steps += 1
        if self.about in (None, self.steps):
            Thinking.now += 1e-3 * self.milliseconds * len(rows)
        return np.ones((len(rows), 10, 10))


@pytest.fixture
def clock(monkeypatch):
    """Let alarms ring by the clock of `Thinking`."""

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


@pytest.mark.parametrize(
    ("milliseconds", "about", "patience", "is_late"),
    [(15, None, 0.0, False), (16, None, 0.0, True), (1000, 1, 5.0, False), (1000, 2, 5.0, True)],
    ids=["in time", "too late", "getting ready", "late later on"],
)
def test_each_game_has_its_own_time_to_think_and_time_to_get_ready(clock, milliseconds, about, patience, is_late):
    clock(patience)
    made = []

    def load_thinking(name, config):
        made.append(name)
        return Thinking(milliseconds, about) if name == "slow" else policies.load(name, config)

    games = play_block(load_thinking, "slow", "uniform", [3, 4, 6], CONFIG.replace(budget_ms=15.0))
    assert [game.number for game in games] == [3, 4, 6]
    assert [game.forfeit.startswith("slow: ") for game in games] == [is_late] * 3
    assert made.count("slow") == (4 if is_late else 1), "only after a fault is each game played on its own"


def test_time_to_make_a_player_and_to_show_it_a_game_is_nobodys_thinking(clock, monkeypatch):
    clock(5.0)

    def late(work):
        def do(*given):
            Thinking.now += 8.0
            return work(*given)

        return do

    monkeypatch.setattr(BatchEnv, "observe", late(BatchEnv.observe))
    (game,) = play_block(late(policies.load), "ring", "uniform", [1], CONFIG)
    assert not game.forfeit


COMMAND = """
import sys
sys.argv = ["swarm-pz", *sys.argv[1:]]
from swarm_pz.cli import main
main()
"""


def test_ctrl_c_ends_a_tournament_with_the_line_that_goes_on(tmp_path):
    """Several processes play the same games as one process."""
    folder, count = tmp_path / "my ladder", "1000"  # more than anybody waits for
    options = ["--game.time-limit", "4", "--game.drones-per-team", "2", "--games", count]
    words = ["tournament", *FOUR, *options, "--out", str(folder)]
    code = [sys.executable, "-c", COMMAND, *words]
    with subprocess.Popen(code, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:  # noqa: S603
        while not (folder / GAMES).exists() or not lines(folder):
            assert process.poll() is None
            time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to all of them
        printed = process.communicate()[1]
    assert process.returncode == 130 and "Traceback" not in printed
    assert f"games are in {folder}" in printed
    assert f"go on with: swarm-pz {shlex.join(words)}\n" in printed
    game = Tournament(FOUR, CONFIG.replace(games=int(count)), folder, load).games["halo", "noise", 0]
    (again,) = play_block(load, "halo", "noise", [0], CONFIG)
    assert dataclasses.replace(game, thinking_ms=again.thinking_ms) == again
