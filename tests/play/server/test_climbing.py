"""The ladder at a table: who is met, what is counted, and what becomes of games that nobody finishes."""

import csv

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.play import protocol
from swarm_pz.play.climbers import TABLE, Climber
from swarm_pz.play.game import TableConfig
from swarm_pz.play.levels import RUNGS
from swarm_pz.play.server.climbing import Climbing, check_rules
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import playing, until

pytestmark = pytest.mark.anyio
NAMES = [rung.name for rung in RUNGS]


@pytest.fixture
async def hall(tmp_path, request):
    """Give a lobby with a ladder."""
    names = getattr(request, "param", NAMES)
    made = Hall(tmp_path, names, Climbing(tmp_path / "levels", TableConfig(), names))
    yield made
    made.close()


def games_of(tmp_path, code="P01"):
    return Climber(tmp_path / "levels", code).games


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
    await playing(room)
    return room


async def finish(guest, room, outcome):
    """End a room's game, and return the new level."""
    before = len(guest.heard(protocol.Level))
    room.session.stop(outcome, "time" if outcome == "draw" else "capture")
    await until(lambda: len(guest.heard(protocol.Level)) > before)
    return guest.heard(protocol.Level)[-1]


async def test_somebody_climbs_game_by_game_on_both_sides(hall, tmp_path):
    guest = Guest(hall)
    (welcome,) = guest.heard(protocol.Welcome)
    assert welcome.ladder and welcome.rungs == NAMES
    first = await ask(guest, protocol.AskLevel("P01"))
    assert (first.games, first.opponent, first.side) == (0, "uniform", "red")
    room = await begin(hall, guest)
    assert room.seats[0].kind == "person" and room.seats[1].policy == "uniform"
    level = await finish(guest, room, "red")
    assert (level.games, level.side) == (1, "blue") and first.level < level.level < level.high
    room = await begin(hall, guest)
    assert room.seats[0].policy == level.opponent and room.seats[1].kind == "person"
    lower = await finish(guest, room, "red")
    assert lower.level < level.level
    games = games_of(tmp_path)
    assert [(game.side, game.outcome) for game in games] == [("red", "win"), ("blue", "loss")]
    assert all((tmp_path / game.recording).is_file() for game in games) and games[0].seed != games[1].seed
    assert [game.rating for game in games] == [dict(RUNGS)[game.opponent] for game in games]
    with (tmp_path / "levels" / TABLE).open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["code"], row["games"]) == ("P01", "2")


async def test_levels_of_control_systems_stand_apart_and_opponents_are_flown_as_they_were_rated(hall):
    guest = Guest(hall)
    room = await begin(hall, guest, system="direct")
    assert room.config.game.team_controllers == ("direct", "ergodic")
    await finish(guest, room, "red")
    told = [await ask(guest, protocol.AskLevel("P01", system)) for system in ("direct", None)]
    assert [(level.games, level.side) for level in told] == [(1, "blue"), (0, "red")]
    assert hall.climbing.settings(told[0]).red_system == "ergodic"


@pytest.mark.parametrize(
    ("how", "counted"),
    [("left", [("left", "loss")]), ("lost connection", [("capture", "loss")]), ("forfeit", []), ("server", [])],
)
async def test_a_game_counts_as_its_player_ended_it(how, counted, hall, tmp_path):
    guest = Guest(hall)
    room = await begin(hall, guest)
    if how == "left":
        guest.say(protocol.Leave())
    elif how == "lost connection":
        guest.handler.end()
        room.session.stop("blue", "capture")
    else:
        room.session.stop("red" if how == "forfeit" else "stopped", how)
    await until(lambda: not hall.climbing._telling)
    assert [(game.ended_by, game.outcome) for game in games_of(tmp_path)] == counted
    assert not guest.heard(protocol.Level), "nobody is told who is gone"


async def test_games_of_who_sat_down_later_are_not_counted(hall):
    guest, other = Guest(hall), Guest(hall)
    room = hall.rooms[(await ask(guest, protocol.Climb("P01"))).room]
    other.say(protocol.Join(room.code, "watch"))
    guest.say(protocol.Leave())
    other.say(protocol.Join(room.code, "red"))
    other.say(protocol.Ready())
    await playing(room)
    room.session.stop("red", "capture")
    assert (await ask(guest, protocol.AskLevel("P01"))).games == 0


async def test_on_the_ladder_no_policy_commands_in_the_players_place_and_the_opponent_stays(hall):
    guest = Guest(hall)
    room = hall.rooms[(await ask(guest, protocol.Climb("P01"))).room]
    rule = protocol.Rule(protocol.When(fewer=20), protocol.Response(policy="champion"))
    assert (
        guest.say(protocol.Invite("blue", None)) == "out_of_turn" and guest.say(protocol.Rules([rule])) == "not_valid"
    )
    assert guest.heard(protocol.RoomState)[-1].once and room.ranked


async def test_of_a_code_one_game_is_played_at_a_time(hall):
    one, other = Guest(hall), Guest(hall)
    room = await begin(hall, one)
    refused = await ask(other, protocol.Climb("P01"))
    assert refused.code == "taken" and room.code in refused.reason
    await begin(hall, other, "P02")
    await finish(one, room, "draw")
    await begin(hall, other)


async def test_bad_codes_systems_and_files_are_refused_and_nobody_else_is_disturbed(hall, tmp_path):
    corrupt = tmp_path / "levels" / "P09.jsonl"
    corrupt.parent.mkdir()
    corrupt.write_text("nonsense\n")
    other, guest = Guest(hall), Guest(hall)
    room = await begin(hall, other, "P02")
    for message in (protocol.AskLevel, protocol.Climb):
        for code in ("../../etc/passwd", "P 1", ".seats", "P1\n"):
            assert (await ask(guest, message(code))).code == "not_valid"
        refused = await ask(guest, message("P09"))
        assert refused.code == "not_valid" and "line 1 of P09.jsonl" in refused.reason
    assert (await ask(guest, protocol.Climb("P01", "nonsense"))).code == "not_valid"
    assert list(hall.rooms.values()) == [room] and corrupt.read_text() == "nonsense\n"
    assert (await finish(other, room, "red")).games == 1


async def test_a_game_that_cannot_be_kept_is_told(hall, tmp_path):
    guest = Guest(hall)
    room = await begin(hall, guest)
    (tmp_path / "levels").write_text("a file where the folder should be")
    room.session.stop("red", "capture")
    await until(lambda: guest.notices)
    assert "could not be counted" in guest.notices[0] and str(tmp_path) not in guest.notices[0]


@pytest.mark.parametrize("hall", [["ring", "noise"]], indirect=True)
async def test_nobody_is_met_who_is_not_installed(hall, tmp_path):
    guest = Guest(hall)
    level = await ask(guest, protocol.AskLevel("P01"))
    assert level.opponent == "ring" and len(guest.heard(protocol.Welcome)[0].rungs) == 1
    with pytest.raises(ConfigError, match="nobody to meet"):
        Climbing(tmp_path, TableConfig(), ["noise"])


def test_a_ladder_needs_the_rules_by_which_its_opponents_were_rated():
    check_rules(GameConfig(controllers=("direct", "ergodic")))
    for other in ({"drones_per_team": 24}, {"time_limit": 60.0}):
        with pytest.raises(ConfigError, match="default ones"):
            check_rules(GameConfig(**other))
