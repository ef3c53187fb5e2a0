"""The ladder at a table: who is met, what is counted, and what becomes of games that nobody finishes."""

import asyncio
import csv

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.play import protocol
from swarm_pz.play.climbers import TABLE, Climber
from swarm_pz.play.game import TableConfig
from swarm_pz.play.levels import RUNGS
from swarm_pz.play.server.climbing import Climbing, check_rules
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.server_context import ServerContext
from tests.play.server.test_client_handler import Guest
from tests.play.server.test_room import Workers, until

NAMES = [rung.name for rung in RUNGS]


class Hall(Lobby):
    """A lobby with a ladder, in which nobody thinks."""

    def __init__(self, folder, names=NAMES):
        workers = Workers()
        workers.close = lambda: None
        context = ServerContext(folder=folder, workers=workers, countdown_s=0.0)
        climbing = Climbing(folder / "levels", context.table, names)
        super().__init__(context, dict.fromkeys(names, ""), climbing=climbing)

    @property
    def levels(self):
        return self.context.folder / "levels"


def visiting(folder, script, **how):
    """Run a script in such a lobby, and close it."""

    async def play():
        hall = Hall(folder, **how)
        try:
            await script(hall)
        finally:
            hall.close()

    asyncio.run(play())


async def ask(guest, message):
    """Say something, and return the answer: a level, a seat, or a refusal."""
    kinds = (protocol.Level, protocol.Seated, protocol.Refused)
    before = len(guest.heard(kinds))
    guest.say(message)
    await until(lambda: len(guest.heard(kinds)) > before)
    return guest.heard(kinds)[before]


async def begin(hall, guest, code="P01", system=None):
    """Climb, and return the room when its game has begun."""
    seated = await ask(guest, protocol.Climb(code, system))
    assert isinstance(seated, protocol.Seated)
    guest.say(protocol.Ready())
    room = hall.rooms[seated.room]
    await until(lambda: room.phase == "playing")
    return room


async def finish(guest, room, outcome):
    """End a room's game, and return the new level."""
    before = len(guest.heard(protocol.Level))
    room.session.stop(outcome, "time" if outcome == "draw" else "capture")
    await until(lambda: len(guest.heard(protocol.Level)) > before)
    return guest.heard(protocol.Level)[-1]


def test_somebody_climbs_game_by_game_on_both_sides(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        assert guest.heard(protocol.Welcome)[0].ladder
        first = await ask(guest, protocol.AskLevel("P01"))
        assert (first.games, first.opponent, first.side, first.last) == (0, "uniform", "red", None)
        assert [rung.name for rung in first.rungs] == NAMES
        room = await begin(hall, guest)
        assert room.seats[0].kind == "person" and room.seats[1].policy == "uniform"
        level = await finish(guest, room, "red")
        assert (level.games, level.last, level.side) == (1, "win", "blue")
        assert first.level < level.level < level.high
        room = await begin(hall, guest)
        assert room.seats[0].policy == level.opponent and room.seats[1].kind == "person"
        lower = await finish(guest, room, "red")
        assert lower.last == "loss" and lower.level < level.level

    visiting(tmp_path, script)
    games = Climber(tmp_path / "levels", "P01").games
    assert [(game.side, game.outcome) for game in games] == [("red", "win"), ("blue", "loss")]
    assert all((tmp_path / game.recording).is_file() for game in games)
    assert games[0].seed != games[1].seed
    assert [game.rating for game in games] == [dict(RUNGS)[game.opponent] for game in games]
    with (tmp_path / "levels" / TABLE).open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["code"], row["games"]) == ("P01", "2")


def test_levels_of_control_systems_stand_apart_and_opponents_are_flown_as_they_were_rated(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        room = await begin(hall, guest, system="direct")
        assert room.config.game.team_controllers == ("direct", "ergodic")
        await finish(guest, room, "red")
        assert (await ask(guest, protocol.AskLevel("P01", "direct"))).games == 1
        assert (await ask(guest, protocol.AskLevel("P01"))).games == 0
        room = await begin(hall, guest, system="direct")
        assert room.config.game.team_controllers == ("ergodic", "direct")

    visiting(tmp_path, script)


def test_a_game_that_is_left_is_lost_and_one_that_the_server_ends_counts_not(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        await begin(hall, guest)
        guest.say(protocol.Leave())
        level = await ask(guest, protocol.AskLevel("P01"))
        assert (level.games, level.last) == (1, "loss")
        await begin(hall, guest)

    visiting(tmp_path, script)
    (game,) = Climber(tmp_path / "levels", "P01").games
    assert (game.ended_by, game.outcome) == ("left", "loss")


def test_a_game_that_a_fault_decided_says_nothing_of_a_level(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        room = await begin(hall, guest)
        room.session.stop("red", "forfeit")
        await until(lambda: room.phase == "over")
        assert (await ask(guest, protocol.AskLevel("P01"))).games == 0

    visiting(tmp_path, script)


def test_a_room_of_the_ladder_is_for_one_game_against_whom_it_chose(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        seated = await ask(guest, protocol.Climb("P01"))
        assert guest.say(protocol.Invite("blue", None)) == "out_of_turn"
        rule = protocol.Rule(protocol.When(fewer=20), protocol.Response(policy="champion"))
        assert guest.say(protocol.Rules([rule])) == "not_valid"
        guest.say(protocol.Ready())
        room = hall.rooms[seated.room]
        await until(lambda: room.phase == "playing")
        await finish(guest, room, "red")
        assert guest.heard(protocol.RoomState)[-1].once
        assert guest.say(protocol.Ready()) == "out_of_turn"

    visiting(tmp_path, script)


def test_of_a_code_one_game_is_played_at_a_time(tmp_path):
    async def script(hall):
        one, other = Guest(hall), Guest(hall)
        room = await begin(hall, one)
        refused = await ask(other, protocol.Climb("P01"))
        assert refused.code == "taken" and room.code in refused.reason
        await begin(hall, other, "P02")
        await finish(one, room, "draw")
        await begin(hall, other)

    visiting(tmp_path, script)


@pytest.mark.parametrize("message", [protocol.AskLevel, protocol.Climb])
def test_bad_codes_systems_and_files_are_refused_and_nobody_else_is_disturbed(message, tmp_path):
    async def script(hall):
        hall.levels.mkdir()
        (hall.levels / "P09.jsonl").write_text("nonsense\n")
        other = Guest(hall)
        room = await begin(hall, other, "P02")
        guest = Guest(hall)
        for code in ("../../etc/passwd", "P 1", ".seats", "P1\n"):
            assert (await ask(guest, message(code))).code == "not_valid"
        refused = await ask(guest, message("P09"))
        assert refused.code == "not_valid" and "line 1 of P09.jsonl" in refused.reason
        assert (await ask(guest, protocol.Climb("P01", "nonsense"))).code == "not_valid"
        assert list(hall.rooms.values()) == [room]
        assert (await finish(other, room, "red")).games == 1

    visiting(tmp_path, script)
    assert (tmp_path / "levels" / "P09.jsonl").read_text() == "nonsense\n"


def test_a_game_that_cannot_be_kept_is_told(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        room = await begin(hall, guest)
        hall.levels.write_text("a file where the folder should be")
        room.session.stop("red", "capture")
        await until(lambda: guest.heard(protocol.Notice))
        assert "could not be counted" in guest.heard(protocol.Notice)[0].text
        assert str(tmp_path) not in guest.heard(protocol.Notice)[0].text

    visiting(tmp_path, script)


def test_nobody_is_met_who_is_not_installed(tmp_path):
    async def script(hall):
        level = await ask(Guest(hall), protocol.AskLevel("P01"))
        assert level.opponent == "ring" and len(level.rungs) == 1

    visiting(tmp_path, script, names=["ring", "noise"])
    with pytest.raises(ConfigError, match="nobody to meet"):
        Climbing(tmp_path, TableConfig(), ["noise"])


def test_a_table_without_a_ladder_says_so(tmp_path):
    async def script(hall):
        hall.climbing.close()
        hall.climbing = None
        guest = Guest(hall)
        assert not guest.heard(protocol.Welcome)[0].ladder
        assert (await ask(guest, protocol.AskLevel("P01"))).code == "unknown"

    visiting(tmp_path, script)


def test_a_ladder_needs_the_rules_by_which_its_opponents_were_rated():
    check_rules(GameConfig())
    check_rules(GameConfig(controllers=("direct", "ergodic")))
    with pytest.raises(ConfigError, match="default ones"):
        check_rules(GameConfig(drones_per_team=24))
    with pytest.raises(ConfigError, match="default ones"):
        check_rules(GameConfig(time_limit=60.0))


def test_games_of_who_sat_down_later_are_not_counted(tmp_path):
    async def script(hall):
        guest, other = Guest(hall), Guest(hall)
        seated = await ask(guest, protocol.Climb("P01"))
        room = hall.rooms[seated.room]
        other.say(protocol.Join(room.code, "watch"))
        guest.say(protocol.Leave())
        other.say(protocol.Join(room.code, "red"))
        other.say(protocol.Ready())
        await until(lambda: room.phase == "playing")
        room.session.stop("red", "capture")
        assert (await ask(guest, protocol.AskLevel("P01"))).games == 0

    visiting(tmp_path, script)


def test_a_lost_game_whose_player_is_gone_is_told_to_nobody(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        room = await begin(hall, guest)
        guest.handler.end()
        room.session.stop("blue", "capture")
        await until(lambda: not hall.climbing._telling)
        assert not guest.heard(protocol.Level)

    visiting(tmp_path, script)
    assert Climber(tmp_path / "levels", "P01").games[0].outcome == "loss"
