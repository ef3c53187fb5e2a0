"""A study's games and breaks, at a table where nobody plays: whose the seats are, and when what is over."""

import asyncio
import contextlib
import json
import time
from types import SimpleNamespace

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request

from swarm_pz.errors import ConfigError
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server import studies
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.studies import StudyHost
from swarm_pz.play.server.study_games import AWAY_S, UNUSED_S, StudyGames
from swarm_pz.play.studies import progress
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Step
from swarm_pz.play.studies.withdrawal import withdraw
from tests.play.server.test_studies import PLAN, planned

pytestmark = pytest.mark.anyio


class Room:
    """A room whose game somebody else plays."""

    def __init__(self, hosted):
        self.code, self.hosted, self.phase, self.connections = "ABCD", hosted, "waiting", []
        self.seats = tuple(Seat(team, hosted.config, self.code, None) for team in range(2))
        self.policies, self.session = [], SimpleNamespace(recorder=self)

    def reserve(self, team):
        self.seats[team].take("person")

    def place_policy(self, side, policy):
        self.policies.append((side, policy))

    def join(self):
        """Wait for nothing: what there is of the recording is on the disk."""


class Rooms:
    """A lobby of such rooms."""

    def __init__(self):
        self.context, self.rooms = SimpleNamespace(table=TableConfig()), {}

    def open_hosted(self, hosted):
        self.rooms["ABCD"] = Room(hosted)
        return self.rooms["ABCD"]

    def close_room(self, room):
        was_running, room.phase = room.phase == "playing", "over"
        del self.rooms[room.code]
        if was_running:
            room.hosted.over()


@contextlib.contextmanager
def begun(tmp_path, plan=PLAN):
    """Give the folder of a study."""
    with contextlib.closing(StudyFolder.begin(planned(tmp_path / "plan", plan), tmp_path / "data")) as folder:
        yield folder


async def posted(host, act, code="P01", **said):
    """Return a study's answer to a participant's page."""
    data = json.dumps({"window": "w", **said}).encode()

    async def receive():
        return {"type": "http.request", "body": data, "more_body": False}

    scope = {"type": "http", "method": "POST", "headers": [], "path_params": {"code": code}}
    route = next(route for route in host.routes() if route.path == f"/study/{{code}}/{act}")
    return await route.endpoint(Request(scope, receive))


async def asked(host, act, code="P01", **said):
    return json.loads((await posted(host, act, code, **said)).body)


def walk(walked, until):
    """Do what is asked of a participant until a step of some kind comes, and return that."""
    while walked.next.kind != until:
        walked.finish(walked.next, **({"answers": {"hand": "left"}} if walked.next.form is not None else {}))
    return walked.next


async def test_a_break_begins_when_what_came_before_was_done_and_cannot_be_cut_short(tmp_path, monkeypatch):
    now = [1000.0]
    for module in (progress, studies):
        monkeypatch.setattr(module, "time", SimpleNamespace(time=lambda: now[0], monotonic=time.monotonic))
    with begun(tmp_path, PLAN.replace("seed = 3", "seed = 3\nbreak_s = 60.0")) as folder:
        host, step = StudyHost(folder, Rooms()), walk(folder.progress(0), "break")
        now[0] += 20.0
        assert (await asked(host, "state"))["step"]["seconds"] == 40.0
        early = await asked(host, "done", step=step.id)
        assert "not over yet" in early["refused"] and early["step"]["id"] == step.id
        now[0] += 41.0
        assert (await asked(host, "done", step=step.id))["step"]["id"] == "block2.game1"


async def test_a_window_stays_the_participants_while_it_plays_though_it_says_nothing(tmp_path, monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(studies, "time", SimpleNamespace(time=time.time, monotonic=lambda: now[0]))
    with begun(tmp_path) as folder:
        host = StudyHost(folder, Rooms())
        assert (await asked(host, "state"))["step"]["id"] == "consent"
        host.games.open((0,), Step("block1.game1", "game", folder.study.conditions[0]))
        seat = host.games.of(0).room.seats[1]
        seat.connection = object()
        now[0] += 100.0
        assert (await asked(host, "state", window="another"))["elsewhere"]
        seat.connection = None
        assert "elsewhere" not in await asked(host, "state", window="another")


def test_a_condition_is_of_its_participants_seats_and_its_speed_of_the_table(tmp_path):
    plan = PLAN.replace('side = "blue"', 'side = "blue"\ncommand_delay_ms = 300\nspeed = 0.5')
    plan = plan.replace("speed = 2.0", 'speed = 2.0\nhide = ["opponents"]\n\n[practice]\nwins = 1')
    with begun(tmp_path, plan) as folder:
        games, (alone, together) = StudyGames(folder, Rooms()), folder.study.conditions
        practice, game = (Step(f"block1.{kind}1", kind, alone) for kind in ("practice", "game"))
        opened = []
        for players, step in (((0,), practice), ((0,), game), ((2, 3), Step("block1.game1", "game", together))):
            games.open(players, step)
            opened.append(games.of(players[-1]).room)
    assert [room.policies for room in opened] == [[("red", "corners")], [("red", "uniform")], []]
    for room in opened[:2]:
        assert room.hosted.config.factors == (Factors(speed=0.5), Factors(command_delay_ms=300, speed=0.5))
        assert [bool(seat.token) for seat in room.seats] == [False, True]
    assert opened[2].hosted.config.factors == (Factors(speed=2.0, hide=("opponents",)),) * 2
    assert [games.of(number).seat_of(number)["seat"] for number in (0, 2, 3)] == ["blue", "red", "blue"]
    now = time.monotonic()
    opened[2].seats[0].away_since, opened[2].seats[1].away_since = now - 20.0, now - 1.0
    assert games.of(2).away_s >= 20.0, "as long as who is away for longest"


@pytest.mark.parametrize(("phase", "away_s"), [("waiting", UNUSED_S), ("playing", AWAY_S)])
async def test_a_game_that_a_participant_has_left_is_kept_aside_and_played_again(phase, away_s, tmp_path):
    with begun(tmp_path) as folder:
        walked, lobby = folder.progress(0), Rooms()
        step, games = walk(walked, "game"), StudyGames(folder, lobby)
        games.open((0,), step)
        room = lobby.rooms["ABCD"]
        assert (room.hosted.seed, room.hosted.path) == (folder.seed_of(step), folder.recording(0, step))
        room.phase = phase
        room.seats[1].away_since = time.monotonic() - away_s + 5.0
        games.look()
        assert lobby.rooms and games.of(0) is not None, "they may come back"
        room.hosted.path.write_text("{")
        room.seats[1].away_since -= 10.0
        games.look()
        await games.close()
        assert not lobby.rooms and games.of(0) is None and walked.next == step
        assert room.hosted.path.exists() == (phase == "waiting")
    aside = tmp_path / "data" / "interrupted" / f"P01.{step.id}.1.jsonl"
    assert aside.exists() == (phase == "playing")


async def test_what_one_of_two_asks_waits_for_the_other(tmp_path, monkeypatch):
    """Else the game that one of them opens may be taken for what the last power failure left of it."""
    at_work = []

    def settle(number):
        at_work.append(number // 2)
        assert at_work.count(number // 2) == 1
        time.sleep(0.02)
        at_work.remove(number // 2)

    with begun(tmp_path) as folder:
        host = StudyHost(folder, Rooms())
        monkeypatch.setattr(folder, "settle", settle)
        told = await asyncio.gather(*(asked(host, "state", f"P0{n}") for n in range(1, 9)))
    assert [one["step"]["id"] for one in told] == ["consent"] * 8


def test_who_guesses_codes_is_stopped_and_others_go_on(tmp_path, monkeypatch):
    """Without a limit of wrong codes whoever tries many finds a session, and takes it over."""
    now = [1000.0]
    monkeypatch.setattr(studies, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with begun(tmp_path) as folder:
        host = StudyHost(folder, Rooms())
        host._visitors[1].window = "known"

        def status(code, window, address):
            try:
                return host._number_of(code, window, address)
            except HTTPException as error:
                return error.status_code

        tries = [status(f"X{guess}", "w", "there") for guess in range(studies.MOST_WRONG_CODES + 2)]
        assert tries == [404] * studies.MOST_WRONG_CODES + [429] * 2
        assert status("P02", "w", "there") == 429, "else a right guess is told from a wrong one"
        assert status("P01", "", "there") == 429, "a window without a name is nobody's"
        assert status("P02", "known", "there") == 1 and status("P02", "w", "elsewhere") == 1
        now[0] += 6.0
        assert status("P02", "w", "there") == 1
        now[0] += 1000.0
        assert status("X", "w", "elsewhere") == 404 and list(host._guesses) == ["elsewhere"], "what is over goes"


async def test_who_has_withdrawn_is_told_so_and_the_partner_is_asked_no_game_of_two(tmp_path):
    """Else a code that is still in a mail begins the study anew, and the partner waits for ever."""
    with begun(tmp_path):
        pass
    withdraw(tmp_path / "data", "P01")
    with begun(tmp_path) as folder:
        host = StudyHost(folder, Rooms())
        answer = await posted(host, "state")
        assert answer.status_code == 410 and "has withdrawn" in json.loads(answer.body)["fault"]
        assert host._row(0)["step"] == "withdrawn"
        assert "block2.game1" not in [step.id for step in folder.progress(1).steps]


@pytest.mark.parametrize(("fault", "status"), [(ZeroDivisionError(), 500), (OSError(28, "full"), 503)])
async def test_whatever_goes_wrong_a_page_hears_words(fault, status, tmp_path, monkeypatch, caplog):
    def fail(number):
        raise fault

    with begun(tmp_path) as folder:
        monkeypatch.setattr(folder, "settle", fail)
        answer = await posted(StudyHost(folder, Rooms()), "state")
    assert answer.status_code == status and "please tell whoever runs" in json.loads(answer.body)["fault"]
    assert ("Traceback" in caplog.text) == (status == 500), "a full disk is no fault of ours"


async def test_a_body_that_comes_little_by_little_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(studies, "_PART_S", 0.01)
    request = Request({"type": "http"}, receive=lambda: asyncio.sleep(60))
    with pytest.raises(ConfigError, match="must come within"):
        await studies._read(request, 100)
