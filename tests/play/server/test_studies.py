"""A study's pages, games and monitor."""

import asyncio
import contextlib
import json
import re
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request

from swarm_pz.errors import ConfigError
from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.server import studies
from swarm_pz.play.server.studies import StudyHost, Visitor
from swarm_pz.play.server.study_games import AWAY_S, UNUSED_S
from swarm_pz.play.studies import PAGES, progress
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Step
from swarm_pz.play.studies.withdrawal import withdraw
from tests.play.server.test_client_handler import Guest, Hall
from tests.play.server.test_room import Client as Connection
from tests.play.server.test_room import playing
from tests.play.studying import StudyTable

STUDY = Path(__file__).parents[3] / "docs/examples/study"
PLAN = """
title = "A pilot"
participants = 8
codes = ["P01", "P02", "P03", "P04", "P05", "P06", "P07", "P08"]
games = 1
break_s = 0.01
seed = 3
consent = "consent.md"
order = [["alone", "together"]]
practice = { wins = 1, most = 1 }
rules = { time_limit = 1.0, drones_per_team = 3 }

[[conditions]]
title = "alone"

[[conditions]]
title = "together"
opponent = "person"
text = "consent.md"

[[forms]]
name = "hand"
title = "About you"
when = "start"
items = [{ id = "hand", text = "Your hand?", kind = "choice", choices = ["left", "right"] }]

[[forms]]
name = "nasa-tlx"
"""


def planned(folder, text=PLAN):
    """Write a study's file into a folder, and return it."""
    folder.mkdir(exist_ok=True)
    (folder / "consent.md").write_text("# Will you?\n\nYou *may* stop.")
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def lines_of(study, code):
    """Return the lines of a participant's file."""
    text = (study.folder / "participants" / f"{code}.jsonl").read_text()
    return [json.loads(line) for line in text.splitlines()]


# --- asked, where nobody plays --------------------------------------------------------------------


@contextlib.contextmanager
def begun(tmp_path, plan=PLAN):
    """Give the host of a study, and its folder."""
    begin = StudyFolder.begin(planned(tmp_path / "plan", plan), tmp_path / "data")
    with contextlib.closing(begin) as folder, contextlib.closing(Hall(tmp_path, is_hosted=True)) as hall:
        yield StudyHost(folder, hall), folder


async def posted(host, act, code="P01", data=None, **fields):
    """Post an action of a participant's page, and return the status and the response."""
    data = json.dumps({"window": "w", **fields}).encode() if data is None else data

    async def receive():
        return {"type": "http.request", "body": data, "more_body": False}

    scope = {"type": "http", "method": "POST", "headers": [], "path_params": {"code": code}}
    route = next(route for route in host.routes() if route.path == f"/study/{{code}}/{act}")
    answer = await route.endpoint(Request(scope, receive))
    return answer.status_code, json.loads(answer.body)


async def ask(host, act, code="P01", **fields):
    status, response = await posted(host, act, code, **fields)
    assert status == 200, response
    return response


def walk(walked, until):
    """Do a participant's steps until the next is of kind `until`, and return it."""
    while walked.next.kind != until:
        walked.finish(walked.next, **({"answers": {"hand": "left"}} if walked.next.form is not None else {}))
    return walked.next


async def test_a_participant_is_led_from_consent_to_a_game(tmp_path):
    with begun(tmp_path) as (host, folder):
        state = await ask(host, "state", code="p01")  # in lower or upper case
        assert (state["title"], state["step"]["kind"]) == ("A pilot", "consent")
        assert "<h2>Will you?</h2>" in state["step"]["html"]
        out_of_turn = await ask(host, "done", step="start.form.hand", answers={})
        assert out_of_turn["step"]["id"] == "consent"
        form = (await ask(host, "done", step="consent"))["step"]
        wrong = await ask(host, "done", step=form["id"], answers={"hand": "both"})
        assert "hand must be 'left' or 'right'" in wrong["refused"] and wrong["step"]["id"] == form["id"]
        after = await ask(host, "done", step=form["id"], answers={"hand": "left"})
        again = await ask(host, "done", step=form["id"], answers={"hand": "right"})
        assert after == again, "our answer was lost, and is repeated"
        assert await ask(host, "done", step=after["step"]["id"]) == after, "whatever a page says, a game must be played"
        kept = lines_of(SimpleNamespace(folder=folder.path), "P01")
        assert [line.get("answers") for line in kept] == [None, None, {"hand": "left"}]
        row = host._row(0)
        assert (row["step"], row["block"], row["where"]) == ("block1.practice1", "alone", "here")


async def test_a_window_is_the_participants_until_it_falls_silent_or_another_is_told_to_go_on(tmp_path):
    visitor, free = Visitor(), {"takes_over": False, "is_busy": False}
    assert visitor.claim("a", 1.0, 0.0, **free)
    assert not visitor.claim("b", 2.0, 7.0, **free)
    assert visitor.claim("a", 3.0, 7.5, **free)  # the window was reloaded
    assert not visitor.claim("a", 1.0, 8.0, **free)  # a tab that was copied from it
    assert not visitor.claim("b", 4.0, 15.0, **free)
    assert not visitor.claim("b", 4.0, 30.0, takes_over=False, is_busy=True)  # it is in a game
    assert visitor.claim("b", 4.0, 30.0, **free)
    with begun(tmp_path) as (host, _):
        await ask(host, "state")
        state = await ask(host, "done", window="another", step="consent")
        assert state == {"code": "P01", "title": "A pilot", "elsewhere": True}
        assert (await ask(host, "state"))["step"]["id"] == "consent"
        assert (await ask(host, "state", window="another", here=True))["step"]["id"] == "consent"
        assert (await ask(host, "state"))["elsewhere"]


async def test_a_window_stays_the_participants_while_it_plays_though_it_says_nothing(tmp_path, monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(studies, "time", SimpleNamespace(time=time.time, monotonic=lambda: now[0]))
    with begun(tmp_path) as (host, folder):
        assert (await ask(host, "state"))["step"]["id"] == "consent"
        host.games.open((0,), Step("block1.game1", "game", folder.study.conditions[0]))
        seat = host.games.of(0).room.seats[0]
        seat.connection = object()
        now[0] += 100.0
        assert (await ask(host, "state", window="another"))["elsewhere"]
        seat.connection = None
        assert "elsewhere" not in await ask(host, "state", window="another")


async def test_a_break_begins_when_what_came_before_was_done_and_cannot_be_cut_short(tmp_path, monkeypatch):
    now = [1000.0]
    for module in (progress, studies):
        monkeypatch.setattr(module, "time", SimpleNamespace(time=lambda: now[0], monotonic=time.monotonic))
    plan = PLAN.replace("break_s = 0.01", "break_s = 60.0").replace('[[forms]]\nname = "nasa-tlx"', "")
    with begun(tmp_path, plan) as (host, folder):
        step = walk(folder.progress(0), "break")
        now[0] += 20.0
        assert (await ask(host, "state"))["step"]["seconds"] == 40.0
        early = await ask(host, "done", step=step.id)
        assert "not over yet" in early["refused"] and early["step"]["id"] == step.id
        now[0] += 41.0
        assert (await ask(host, "done", step=step.id))["step"]["id"] != step.id


async def test_what_one_of_two_asks_waits_for_the_other(tmp_path, monkeypatch):
    """Otherwise, the game that one of them opens could be taken for an interrupted one."""
    at_work = []

    def settle(number):
        at_work.append(number // 2)
        assert at_work.count(number // 2) == 1
        time.sleep(0.02)
        at_work.remove(number // 2)

    with begun(tmp_path) as (host, folder):
        monkeypatch.setattr(folder, "settle", settle)
        states = await asyncio.gather(*(ask(host, "state", f"P0{n}") for n in range(1, 9)))
    assert [one["step"]["id"] for one in states] == ["consent"] * 8


async def test_pages_are_in_the_studys_language(tmp_path):
    german = (STUDY / "german.toml").read_text()
    (tmp_path / "plan").mkdir()
    (tmp_path / "plan" / "german.toml").write_text(german)
    with begun(tmp_path, f'words = "german.toml"\n{PLAN}') as (host, _folder):
        state = await ask(host, "state")
    assert (state["language"], state["words"]["Go on"]) == ("de", "Weiter")
    for text in ('language = "de"', f"{german}\n[more]\n", german.replace('"Weiter"', "1")):
        (tmp_path / "plan" / "german.toml").write_text(text)
        with pytest.raises(ConfigError, match="a table"):
            Study.read(tmp_path / "plan" / "study.toml")


EARLY = ("Welcome", "A code is made of letters, digits, _ and -.", "This does not go on")
"""Phrases that are shown before the language is known."""


def test_every_phrase_of_the_page_is_in_the_example_of_a_language():
    words = tomllib.loads((STUDY / "german.toml").read_text())["words"]
    source = (PAGES / "study.js").read_text()
    found = re.findall(r'(?:paragraph\(|button\(|complain\(|inWords\(|return |text = |[ \[]\[)"([A-Z][^"\n]+)"', source)
    found += [*re.findall(r'draw\w*\("\w+", "([^"]+)"', source), *studies._HEADINGS.values()]
    assert {"Back", "Stop, and keep it", "Do you want to stop?"} < set(found)
    assert len(found) > 20 and [one for one in found if one not in {*words, *EARLY}] == []


# --- who is refused -------------------------------------------------------------------------------


async def test_who_is_nobody_what_no_page_says_and_what_is_corrupt_is_told_to_that_page_alone(tmp_path, monkeypatch):
    with begun(tmp_path) as (host, _):
        for code, part in (("P99", "the code P99"), ("Monitor", "letters"), ("a.b", "letters"), ("x" * 33, "letters")):
            status, response = await posted(host, "state", code)
            assert status == 404 and part in response["fault"]
        for data in (b"", b"[]", b"{", b"[" * 4000, b'"' + b"x" * 2**20, b'{"window": 1e999}'):
            assert (await posted(host, "state", data=data))[0] == 400
        (tmp_path / "data" / "participants" / "P08.jsonl").write_text("{}\n")
        status, response = await posted(host, "state", "P08")
        assert status == 409 and "please tell whoever runs the study" in response["fault"]
        assert host._row(7)["step"] == "corrupt" and "of another study or participant" in host._row(7)["fault"]
        assert (await ask(host, "state", "P07"))["step"]["id"] == "consent"
        monkeypatch.setattr(studies, "_PART_S", 0.01)
        with pytest.raises(ConfigError, match="must come within"):
            await studies._read(Request({"type": "http"}, receive=lambda: asyncio.sleep(60)))


async def test_whatever_goes_wrong_a_page_hears_words(tmp_path, monkeypatch, caplog):
    def fail(number):
        raise faults.pop(0)

    faults = [OSError(28, "full"), ZeroDivisionError()]
    with begun(tmp_path) as (host, folder):
        monkeypatch.setattr(folder, "settle", fail)
        for status in (503, 500):
            answer = await posted(host, "state")
            assert answer[0] == status and "please tell whoever runs" in answer[1]["fault"]
            assert ("Traceback" in caplog.text) == (status == 500), "a full disk is no fault of ours"


def test_who_guesses_codes_is_stopped_and_others_go_on(tmp_path, clock):
    """Without a limit on wrong codes, anybody could guess a right one and take over its session."""
    with begun(tmp_path) as (host, _):
        host._visitors[1].window = "known"

        def status(code, window, address):
            try:
                return host._number_of(code, window, address)
            except HTTPException as error:
                return error.status_code

        tries = [status(f"X{guess}", "w", "there") for guess in range(studies.MOST_WRONG_CODES + 2)]
        assert tries == [404] * studies.MOST_WRONG_CODES + [429] * 2
        assert status("P02", "w", "there") == 429, "else a right guess is known by its answer"
        assert status("P01", "", "there") == 429, "a window without a name is nobody's"
        assert status("P02", "known", "there") == 1 and status("P02", "w", "elsewhere") == 1
        clock.now += studies.WRONG_CODES_S
        assert status("P02", "w", "there") == 1
        assert status("X", "w", "elsewhere") == 404 and list(host._guesses._limits) == ["elsewhere"], (
            "what is over goes"
        )


async def test_who_has_withdrawn_is_told_so_and_the_partner_is_asked_no_game_of_two(tmp_path):
    """Otherwise, a code in an old mail would start the study anew, and the partner would wait for ever."""
    with begun(tmp_path):
        pass
    withdraw(tmp_path / "data", "P01")
    with begun(tmp_path) as (host, folder):
        status, response = await posted(host, "state")
        assert status == 410 and "has withdrawn" in response["fault"] and host._row(0)["step"] == "withdrawn"
        assert "block2.game1" not in [step.id for step in folder.progress(1).steps]


@pytest.mark.parametrize("is_deleted", [True, False])
async def test_who_stops_in_a_game_of_two_is_gone_and_the_other_goes_on_while_the_server_runs(is_deleted, tmp_path):
    plan = PLAN.replace(
        'consent = "consent.md"', 'consent = "consent.md"\ndebriefing = "consent.md"\ncompletion = "C1"'
    )
    with begun(tmp_path, plan.replace('order = [["alone", "together"]]', 'order = [["together", "alone"]]')) as (
        host,
        folder,
    ):
        assert (await ask(host, "stop"))["step"]["id"] == "consent", "nothing is kept yet"
        steps = [walk(folder.progress(number), "practice") for number in (0, 1)]
        for number, step in enumerate(steps):
            folder.progress(number).finish(step, won=True)
        game = folder.progress(0).next
        host.games.open((0, 1), game)
        room, players = host.games.of(0).room, [Connection(), Connection()]
        for player, seat in zip(players, room.seats, strict=True):
            player.close = lambda _: None
            room.resume(player, seat)
        await playing(room)
        state = await ask(host, "stop", delete=is_deleted)
        assert host.games.of(0) is host.games.of(1) is None
        recordings = [path.name for path in (tmp_path / "data").glob("*/P01.block*.jsonl")]
        if is_deleted:
            assert state["withdrawn"] and "Will you" in state["html"] and recordings == []
            assert (await posted(host, "state"))[0] == 410
            assert len(lines_of(SimpleNamespace(folder=folder.path), "P01")) == 1
        else:
            assert state["step"]["id"] == "debriefing" and recordings == [f"P01.{game.id}.1.jsonl"]
            end = await ask(host, "done", step="debriefing")
            assert "step" not in end and end["completion"] == "" and host._row(0)["step"] == "stopped"
        other = await ask(host, "state", code="P02")
        assert other["step"]["id"] == "block2.break", "the other goes on without them"


async def test_what_was_asked_beside_a_withdrawal_is_not_kept(tmp_path):
    with begun(tmp_path) as (host, folder):
        walk(folder.progress(0), "practice")
        answers = await asyncio.gather(posted(host, "stop", delete=True), posted(host, "stop"))
        assert [status for status, _ in answers] == [200, 410]
        assert len(lines_of(SimpleNamespace(folder=folder.path), "P01")) == 1
        status, nobody = await posted(host, "state", code="P99")
        assert status == 404 and str(folder.path) not in nobody["fault"], "a visitor sees no path of the server"


async def test_a_page_gets_a_copy_of_the_consent_and_no_right_answers_and_the_code_at_the_end(tmp_path):
    plan = PLAN.replace('choices = ["left", "right"]', 'choices = ["left", "right"], correct = "left"')
    plan = plan.replace("practice = { wins = 1, most = 1 }", 'completion = "C1"')
    with begun(tmp_path, plan) as (host, folder):
        consent = next(route for route in host.routes() if route.path == "/study/{code}/consent").endpoint
        scope = {"type": "http", "method": "GET", "headers": [], "path_params": {"code": "P01"}}
        with pytest.raises(HTTPException):
            await consent(Request(scope))
        await ask(host, "state")
        state = await ask(host, "done", step="consent")
        assert state["step"]["items"][0]["id"] == "hand" and "correct" not in state["step"]["items"][0]
        copy = (await consent(Request(scope))).body.decode()
        assert "You <em>may</em> stop." in copy and "P01: &#10003; 20" in copy
        walked = folder.progress(0)
        while (step := walked.next) is not None:
            items = step.form.items if step.form is not None else ()
            walked.finish(step, answers={item.id: item.choices[0] if item.choices else item.least for item in items})
        assert (await ask(host, "state"))["completion"] == "C1"


# --- its games ------------------------------------------------------------------------------------


async def test_a_condition_is_of_its_participants_seats_and_its_speed_of_the_table(tmp_path):
    plan = PLAN.replace('title = "alone"', 'title = "alone"\nside = "blue"\ncommand_delay_ms = 300\nspeed = 0.5')
    plan = plan.replace('opponent = "person"', 'opponent = "person"\nspeed = 2.0\nhide = ["opponents"]')
    plan = plan.replace("rules = {", "rules = { controller = { target_mass = 10.0 },")
    with begun(tmp_path, plan) as (host, folder):
        games, (alone, together) = host.games, folder.study.conditions
        practice, game = (Step(f"block1.{kind}1", kind, alone) for kind in ("practice", "game"))
        opened = []
        for players, step in (((0,), practice), ((0,), game), ((2, 3), Step("block1.game1", "game", together))):
            games.open(players, step)
            opened.append(games.of(players[-1]).room)
        assert [[seat.policy for seat in room.seats] for room in opened] == [["corners", ""], ["uniform", ""], ["", ""]]
        assert {room.plan.config.mapping for room in opened} == {"paper"}, "as these rules need it"
        for room in opened[:2]:
            assert room.plan.config.factors == (Factors(speed=0.5), Factors(command_delay_ms=300, speed=0.5))
            assert [bool(seat.token) for seat in room.seats] == [False, True]
        assert opened[2].plan.config.factors == (Factors(speed=2.0, hide=("opponents",)),) * 2
        assert [games.of(number).seat_of(number)["seat"] for number in (0, 2, 3)] == ["blue", "red", "blue"]
        now = time.monotonic()
        opened[2].seats[0].away_since, opened[2].seats[1].away_since = now - 20.0, now - 1.0
        assert games.of(2).away_s >= 20.0, "as long as who is away for longest"


@pytest.mark.parametrize(("phase", "away_s"), [("waiting", UNUSED_S), ("playing", AWAY_S)])
async def test_a_game_that_a_participant_has_left_is_kept_aside_and_played_again(phase, away_s, tmp_path):
    with begun(tmp_path) as (host, folder):
        games, walked, player = host.games, folder.progress(0), Connection()
        step = walk(walked, "practice")
        games.open((0,), step)
        room = games.of(0).room
        assert (room.plan.seed, room.plan.hosted.path) == (folder.seed_of(step), folder.recording(0, step))
        if phase == "playing":
            room.resume(player, room.seats[0])
            await playing(room)
            room.disconnect(player)
        room.seats[0].away_since = time.monotonic() - away_s + 5.0
        games.look()
        assert games.of(0) is not None, "they may come back"
        room.seats[0].away_since -= 10.0
        games.look()
        await games.close()
        assert games.of(0) is None and walked.next == step
    aside = tmp_path / "data" / "interrupted" / f"P01.{step.id}.1.jsonl"
    assert aside.exists() == (phase == "playing") and not room.plan.hosted.path.exists()


async def test_who_goes_before_the_game_begins_comes_back_to_it_and_nobody_else_is_let_in(tmp_path):
    with begun(tmp_path) as (host, folder):
        step, hall = walk(folder.progress(0), "practice"), host.games._lobby
        seat = (await ask(host, "play", step=step.id))["game"]["seat"]
        assert (await ask(host, "play", step=step.id))["game"]["seat"] == seat, "pressed twice"
        stranger = Guest(hall)
        join = [protocol.Join(seat["room"], place) for place in ("watch", "red", "blue")]
        for message in (*join, protocol.Create(), protocol.Ready(), protocol.Leave()):
            assert stranger.say(message) == "out_of_turn"
            assert "from the study's page" in stranger.heard(protocol.Refused)[-1].reason
        for _ in range(2):
            player = Guest(hall, seat["token"])
            assert player.heard(protocol.Seated)[0].seat == "red"
            player.handler.end()


# --- served ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Give a study that several tests share, each with other participants; its log must hold no traceback."""
    folder = tmp_path_factory.mktemp("study")
    table = StudyTable(planned(folder / "plan"), folder / "data")
    yield table
    assert "Traceback" not in table.end()


def shape(value):
    """Return a response without the values that change from game to game."""
    if isinstance(value, dict):
        return {name: shape(one) for name, one in value.items() if name not in ("token", "room", "html")}
    return [shape(one) for one in value] if isinstance(value, list) else value


def test_who_knows_the_page_alone_takes_part_and_each_of_two_has_their_line(study):
    """The documentation's transcript is right, and its program completes a study, twice at the same time."""
    text = (STUDY / "transcript.txt").read_text().replace("KQ7F2MPD4X", "P01")
    transcript = re.findall(r"^> POST (\S+) (.*)\n< (\d+) (.*)", text, re.M)
    assert len(transcript) == 4
    for path, body, status, response in transcript:
        answer = study.ask(path, json.loads(body))
        assert (answer[0], shape(answer[1])) == (int(status), shape(json.loads(response)))
    space, codes = {}, ["P01", "P02"]
    exec((STUDY / "participant.py").read_text(), space)  # noqa: S102  (our own)
    with ThreadPoolExecutor() as pool:
        done = [*pool.map(space["take_part"], [study.address] * 2, codes)]
    kept = [lines_of(study, code)[1:] for code in codes]
    for number, steps in enumerate(done):
        ids = [line["step"] for line in kept[number]]
        assert steps == ids[2 if number == 0 else 0 :] and ids[-1] == "block2.form.nasa-tlx" and len(ids) == 10
    games = [next(line for line in lines if line["step"] == "block2.game1") for lines in kept]
    assert [game["side"] for game in games] == ["red", "blue"]
    about = {(game["opponent"], game["condition"], game["seed"], game["recording"]) for game in games}
    assert about == {("person", "together", study.kept.study.seed_of(0), "games/P01.block2.game1.jsonl")}
    assert sorted(game["outcome"] for game in games) in (["draw", "draw"], ["loss", "win"])
    rows = study.monitor()
    assert [rows[code]["step"] for code in codes] == ["all done"] * 2 and rows["P01"]["played"] == 2


def test_the_monitor_opens_with_its_token_alone_and_other_pages_are_not_there(study):
    for headers in ({}, {"authorization": "Bearer x"}, {"authorization": "Bearer ä".encode().decode("latin-1")}):
        assert study.ask("/study/monitor/data", **headers)[0] == 403
    assert "study.js" in study.ask("/study/monitor")[1]
    assert sorted(study.monitor()) == [f"P0{number}" for number in range(1, 9)]
    assert study.monitor()["P06"]["seen_s"] is None
    assert "<title>Study</title>" in study.ask("/")[1] and study.ask("/recordings")[0] == 404
    for path in ("/study/..%2F..%2Fetc/state", "/study/%2e%2e/state"):
        assert study.ask(path, {"window": "w"})[0] in (404, 405)
