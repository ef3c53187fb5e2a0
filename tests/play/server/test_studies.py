"""A study as participants' pages and its monitor meet it: who is let in, what is kept, and what is broken off."""

import asyncio
import contextlib
import json
import time
from types import SimpleNamespace

import pytest
from starlette.requests import Request

from swarm_pz.play import protocol
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server import studies
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.studies import StudyHost, Visitor
from swarm_pz.play.server.study_games import AWAY_S, UNUSED_S, StudyGames
from swarm_pz.play.studies import progress
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Step
from tests.play.conftest import Client
from tests.play.studying import Participant, StudyTable, walk_all

PLAN = """
title = "All that there is"
participants = 8
games = 1
seed = 3
consent = "consent.md"
rules = { time_limit = 1.0, drones_per_team = 3 }

[[conditions]]
title = "alone"
opponent = "uniform"
side = "blue"

[[conditions]]
title = "together"
opponent = "person"
speed = 2.0

[[forms]]
name = "words"
title = "Looking back"
when = "start"
items = [
    { id = "hand", text = "Your hand?", kind = "choice", choices = ["left", "right"] },
    { id = "free", text = "Anything else?", kind = "text", optional = true },
]
"""


def planned(folder, text=PLAN):
    """Write a study's file into a folder, and return it."""
    folder.mkdir(exist_ok=True)
    (folder / "consent.md").write_text("# Will you?\n\nYou *may* stop.")
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Give a study that several tests share: each has participants of its own."""
    folder = tmp_path_factory.mktemp("study")
    table = StudyTable(planned(folder / "plan"), folder / "data")
    yield table
    assert "Traceback" not in table.end()


def lines_of(study, code):
    """Return what is kept of a participant."""
    text = (study.folder / "participants" / f"{code}.jsonl").read_text()
    return [json.loads(line) for line in text.splitlines()]


def test_a_participant_is_led_from_consent_to_a_game(study):
    one = Participant(study, "P01")
    state = one.say("state")
    assert state["title"] == "All that there is" and state["step"]["kind"] == "consent"
    assert "<h2>Will you?</h2>" in state["step"]["html"]
    assert one.say("done", step="start.form.words", answers={})["step"]["id"] == "consent"  # out of turn
    form = one.say("done", step="consent")["step"]
    assert form["heading"] == "Looking back" and [item["id"] for item in form["items"]] == ["hand", "free"]
    wrong = one.say("done", step=form["id"], answers={"hand": "both"})
    assert "hand must be 'left' or 'right'" in wrong["refused"] and wrong["step"]["id"] == form["id"]
    told = one.say("done", step=form["id"], answers={"hand": "left"})
    assert told == one.say("done", step=form["id"], answers={"hand": "right"})  # our answer was lost, and is repeated
    assert (told["step"]["kind"], told["step"]["heading"]) == ("game", "Game 1 of 1")
    assert one.say("done", step="block1.game1") == told, "a game is over when it was played, whatever a page says"
    assert [line.get("answers") for line in lines_of(study, "P01")] == [None, None, {"hand": "left", "free": None}]
    row = study.monitor()["P01"]
    assert (row["step"], row["block"], row["where"]) == ("block1.game1", "alone", "here")
    assert study.ask("/study/p01/state", {"window": "other"})[1]["code"] == "P01"  # in either case


def test_two_participants_meet_and_each_has_their_line(study):
    pair = [Participant(study, code) for code in ("P03", "P04")]  # their first block is the one together
    first, second = pair
    for one in pair:
        one.walk(lambda step: step["kind"] == "game")
    assert first.say("play", step="block1.game1")["game"] == {"phase": "waiting", "of_two": True, "until": ""}
    assert first.say("state")["game"]["phase"] == "waiting"
    walk_all(pair)
    lines = [{line["step"]: line for line in lines_of(study, one.code)[1:]} for one in pair]
    games = [of["block1.game1"] for of in lines]
    assert [game["side"] for game in games] == ["red", "blue"]
    assert {(game["opponent"], game["condition"], game["seed"]) for game in games} == {
        ("person", "together", study.kept.study.seed_of(0))
    }
    assert {game["recording"] for game in games} == {"games/P03.block1.game1.jsonl"}
    assert sorted(game["outcome"] for game in games) in (["draw", "draw"], ["loss", "win"])
    assert [of["block2.game1"]["side"] for of in lines] == ["blue", "blue"]
    assert [of["block2.game1"]["seed"] for of in lines] == [game["seed"] for game in games]
    assert all(one.say("state").get("step") is None for one in pair)
    assert second.done == first.done
    rows = study.monitor()
    assert [rows[one.code]["step"] for one in pair] == ["all done"] * 2 and rows["P03"]["played"] == 2


def test_a_second_window_says_so_until_it_is_told_to_go_on(study):
    first, second = Participant(study, "P05"), Participant(study, "P05")
    second.window = "another"
    first.say("state")
    told = second.say("done", step="consent")
    assert told == {"code": "P05", "title": "All that there is", "elsewhere": True}
    assert first.say("state")["step"]["id"] == "consent"
    assert second.say("state", here=True)["step"]["id"] == "consent"
    assert first.say("state")["elsewhere"]


def test_a_window_is_the_participants_until_it_falls_silent():
    visitor, free = Visitor(), {"takes_over": False, "is_busy": False}
    assert visitor.claim("a", 1.0, 0.0, **free)
    assert not visitor.claim("b", 2.0, 7.0, **free)
    assert visitor.claim("a", 3.0, 7.5, **free)  # it was loaded again
    assert not visitor.claim("a", 1.0, 8.0, **free)  # a tab that was copied from it
    assert not visitor.claim("b", 4.0, 15.0, **free)
    assert not visitor.claim("b", 4.0, 30.0, takes_over=False, is_busy=True)  # it is in a game
    assert visitor.claim("b", 4.0, 30.0, **free)


def test_who_goes_before_the_game_begins_comes_back_to_it(study):
    one = Participant(study, "P02")
    step = one.walk(lambda step: step["kind"] == "game")["step"]
    seat = one.say("play", step=step["id"])["game"]["seat"]
    assert one.say("play", step=step["id"])["game"]["seat"] == seat  # pressed twice
    client = Client(study.address, seat["token"])
    assert client.hear(protocol.Seated).seat == "blue"
    client.close()
    one.walk(lambda step: step["id"].startswith("block2"))
    game = lines_of(study, "P02")[-1]
    assert (game["step"], game["seed"]) == ("block1.game1", study.kept.study.seed_of(0))


def answer_of(host, act, **said):
    """Return what a study tells the page of its first participant."""
    data = json.dumps({"window": "w", **said}).encode()

    async def receive():
        return {"type": "http.request", "body": data, "more_body": False}

    scope = {"type": "http", "method": "POST", "headers": [], "path_params": {"code": "P01"}}
    route = next(route for route in host.routes() if route.path == f"/study/{{code}}/{act}")
    return json.loads(asyncio.run(route.endpoint(Request(scope, receive))).body)


def test_a_break_begins_when_what_came_before_was_done_and_cannot_be_cut_short(tmp_path, monkeypatch):
    now = [1000.0]
    clock = SimpleNamespace(time=lambda: now[0], monotonic=time.monotonic)
    for module in (progress, studies):
        monkeypatch.setattr(module, "time", clock)
    plan = planned(tmp_path / "plan", PLAN.replace("seed = 3", "seed = 3\nbreak_s = 60.0"))
    with contextlib.closing(StudyFolder.begin(plan, tmp_path / "data")) as folder:
        host, walked = StudyHost(folder, Rooms()), folder.progress(0)
        while walked.next.kind != "break":
            now[0] += 100.0
            walked.finish(walked.next, **({"answers": {"hand": "left"}} if walked.next.form is not None else {}))
        step = walked.next
        now[0] += 20.0
        assert answer_of(host, "state")["step"]["seconds"] == 40.0
        early = answer_of(host, "done", step=step.id)
        assert early["refused"] == "the break is not over yet" and early["step"]["id"] == step.id
        now[0] += 41.0
        assert answer_of(host, "done", step=step.id)["step"]["id"] == "block2.game1"


def test_a_window_stays_the_participants_while_it_plays_though_it_says_nothing(tmp_path, monkeypatch):
    now = [1000.0]
    monkeypatch.setattr(studies, "time", SimpleNamespace(time=time.time, monotonic=lambda: now[0]))
    with contextlib.closing(StudyFolder.begin(planned(tmp_path / "plan"), tmp_path / "data")) as folder:
        host = StudyHost(folder, Rooms())
        assert answer_of(host, "state")["step"]["id"] == "consent"
        host.games.open((0,), Step("block1.game1", "game", folder.study.conditions[0]))
        host.games.of(0).room.seats[1].connection = object()
        now[0] += 100.0
        assert answer_of(host, "state", window="another")["elsewhere"]
        host.games.of(0).room.seats[1].connection = None
        assert "elsewhere" not in answer_of(host, "state", window="another")


class Room:
    """A room whose game somebody else plays."""

    def __init__(self, hosted):
        self.code, self.hosted, self.phase, self.connections = "ABCD", hosted, "waiting", []
        self.seats, self.policies, self.session = (Seat(0), Seat(1)), [], SimpleNamespace(recorder=self)

    def reserve(self, team):
        self.seats[team].reserve()

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


def test_a_condition_is_of_its_participants_seats_and_its_speed_of_the_table(tmp_path):
    plan = PLAN.replace('side = "blue"', 'side = "blue"\ncommand_delay_ms = 300\nspeed = 0.5')
    plan = plan.replace("speed = 2.0", 'speed = 2.0\nhide = ["opponents"]\n\n[practice]\nwins = 1')
    with contextlib.closing(StudyFolder.begin(planned(tmp_path / "plan", plan), tmp_path / "data")) as folder:
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
    both = Factors(speed=2.0, hide=("opponents",))
    assert opened[2].hosted.config.factors == (both, both)
    assert [games.of(number).seat_of(number)["seat"] for number in (0, 2, 3)] == ["blue", "red", "blue"]
    now = time.monotonic()
    opened[2].seats[0].away_since, opened[2].seats[1].away_since = now - 20.0, now - 1.0
    assert games.of(2).away_s >= 20.0, "as long as who is away for longest"


def test_a_game_that_a_participant_has_left_is_kept_aside_and_played_again(tmp_path):
    folder = StudyFolder.begin(planned(tmp_path / "plan"), tmp_path / "data")
    walked = folder.progress(0)
    for told in ({}, {"answers": {"hand": "left"}}):
        walked.finish(walked.next, **told)
    step, lobby = walked.next, Rooms()

    async def leave_twice():
        games = StudyGames(folder, lobby)
        for phase, away_s in (("waiting", UNUSED_S), ("playing", AWAY_S)):
            games.open((0,), step)
            room = lobby.rooms["ABCD"]
            assert room.policies == [("red", "uniform")] and room.seats[1].token
            assert (room.hosted.seed, room.hosted.path) == (folder.seed_of(step), folder.recording(0, step))
            room.phase = phase
            room.seats[1].away_since = time.monotonic() - away_s + 5.0
            games.look()
            assert lobby.rooms and games.of(0) is not None  # they may come back
            room.hosted.path.write_text("{")
            room.seats[1].away_since -= 10.0
            games.look()
            assert not lobby.rooms
            await games.close()
            assert games.of(0) is None
            assert room.hosted.path.exists() == (phase == "waiting")

    asyncio.run(leave_twice())
    assert walked.next == step and (tmp_path / "data" / "interrupted" / f"P01.{step.id}.1.jsonl").exists()
    folder.close()


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/study/P99/state", "nobody in this study has the code P99"),
        ("/study/..%2F..%2Fetc/state", None),
        ("/study/a.b/state", "letters, digits"),
        ("/study/%2e%2e/state", None),
        (f"/study/{'x' * 33}/state", "letters, digits"),
    ],
)
def test_who_is_nobody_is_told_so(path, said, study):
    status, told = study.ask(path, {"window": "w"})
    assert status in (404, 405) and (said is None or said in told["fault"])


@pytest.mark.parametrize("said", [b"", b"[]", b"{", b"[" * 100_000, b'"' + b"x" * 2**21])
def test_what_no_page_says_is_refused(said, study):
    status, told = study.ask("/study/P07/state", said)
    assert status == 404 and ("the page said" in told["fault"] or "a page may say" in told["fault"])
    assert study.ask("/study/P07/done", {"step": 7, "answers": [1], "window": [], "loaded": "x"})[0] == 200


def test_a_corrupt_file_is_told_to_that_participant_and_disturbs_nobody(study):
    (study.folder / "participants" / "P08.jsonl").write_text("{}\n")
    status, told = study.ask("/study/P08/state", {"window": "w"})
    assert status == 409 and "please tell whoever runs the study" in told["fault"]
    rows = study.monitor()
    assert rows["P08"]["step"] == "corrupt" and "is of another study or participant" in rows["P08"]["fault"]
    assert Participant(study, "P07").say("state", here=True)["step"]["id"] == "consent"


def test_the_monitor_opens_with_its_token_alone(study):
    for headers in ({}, {"authorization": "Bearer x"}, {"authorization": "Bearer ä".encode().decode("latin-1")}):
        assert study.ask("/study/monitor/data", **headers)[0] == 403
    assert "<title>Monitor</title>" in study.ask("/study/monitor")[1]
    assert sorted(study.monitor()) == [f"P0{number}" for number in range(1, 9)]
    assert study.monitor()["P06"]["seen_s"] is None


def test_there_is_nothing_here_but_the_study(study):
    assert "<title>Study</title>" in study.ask("/")[1] and study.ask("/recordings")[0] == 404
    client = Client(study.address)
    for message in (
        protocol.Create(),
        protocol.Join("ABCD"),
        protocol.Ready(),
        protocol.Leave(),
        protocol.OpenReplay("P03.block1.game1.jsonl"),
    ):
        assert "from the study's page" in client.refused(message).reason
    client.close()
