"""A study as participants' pages and its monitor meet it: who is let in, and what is kept."""

import contextlib
import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.studies import StudyHost, Visitor
from swarm_pz.play.studies.folder import StudyFolder
from tests.play.conftest import Client
from tests.play.studying import NearStudyTable, Participant, walk_all

PLAN = """
title = "All that there is"
participants = 8
codes = ["P01", "P02", "P03", "P04", "P05", "P06", "P07", "P08"]
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


STUDY = Path(__file__).parents[3] / "docs/examples/study"
PILOT = """
title = "A pilot"
participants = 2
games = 1
break_s = 0.01
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


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Give a study that several tests share: each has participants of its own."""
    folder = tmp_path_factory.mktemp("study")
    table = NearStudyTable(planned(folder / "plan"), folder / "data")
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
    waiting = {"phase": "waiting", "of_two": True, "until": "", "again": False}
    assert first.say("play", step="block1.game1")["game"] == waiting
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
    assert not (study.folder / "games" / ".seats").exists(), "no token of a seat leads anywhere after its game"
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
    stranger = Client(study.address)
    for place in ("watch", "red", "blue"):
        assert "from the study's page" in stranger.refused(protocol.Join(seat["room"], place)).reason
    stranger.close()
    client = Client(study.address, seat["token"])
    assert client.hear(protocol.Seated).seat == "blue"
    client.close()
    one.walk(lambda step: step["id"].startswith("block2"))
    game = lines_of(study, "P02")[-1]
    assert (game["step"], game["seed"]) == ("block1.game1", study.kept.study.seed_of(0))


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("/study/P99/state", "nobody in this study has the code P99"),
        ("/study/Monitor/state", "letters, digits"),
        ("/study/..%2F..%2Fetc/state", None),
        ("/study/a.b/state", "letters, digits"),
        ("/study/%2e%2e/state", None),
        (f"/study/{'x' * 33}/state", "letters, digits"),
    ],
)
def test_who_is_nobody_is_told_so(path, said, study):
    status, told = study.ask(path, {"window": "w"})
    assert status in (404, 405) and (said is None or said in told["fault"])


@pytest.mark.parametrize("said", [b"", b"[]", b"{", b"[" * 4000, b'"' + b"x" * 5000])
def test_what_no_page_says_is_refused(said, study):
    status, told = study.ask("/study/P07/state", said)
    assert status == 400 and ("the page said" in told["fault"] or "a page may say" in told["fault"])
    assert study.ask("/study/P07/done", {"step": 7, "answers": [1], "window": [], "loaded": "x"})[0] == 200
    assert study.ask("/study/P07/state", {"window": "w", "loaded": 10**400})[0] == 200


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


def test_the_page_names_every_request_that_a_studys_server_answers(tmp_path):
    """A lab that scripts a study knows only what the page says."""
    lines = re.findall(r"^(GET|POST) (.*)", (STUDY / "participant.py").read_text(), re.M)
    named = [(method, path) for method, paths in lines for path in paths.split()]
    with contextlib.closing(StudyFolder.begin(planned(tmp_path / "plan"), tmp_path / "data")) as folder:
        server = Server(SimpleNamespace(embedders=()), StudyHost(folder, None))
        routes = server.app(["localhost"])._app.routes
    there = [
        (method, route.path.replace("{code}", "CODE"))
        for route in routes
        for method in (getattr(route, "methods", None) or {"GET"}) - {"HEAD"}
    ]
    assert sorted(named) == sorted(there)


def shape(value):
    """Return what kinds of values an answer holds, and the values of short texts."""
    if isinstance(value, dict):
        return {name: shape(one) for name, one in value.items() if name not in ("token", "room", "html")}
    return [shape(one) for one in value] if isinstance(value, list) else value


def test_who_knows_the_page_alone_takes_part(tmp_path):
    """The page's transcript is what is said, and its program does all of a study, beside another one."""
    table = NearStudyTable(planned(tmp_path / "plan", PILOT), tmp_path / "data")
    codes = table.kept.codes
    said = (STUDY / "transcript.txt").read_text().replace("KQ7F2MPD4X", codes[0])
    transcript = re.findall(r"^> POST (\S+) (.*)\n< (\d+) (.*)", said, re.M)
    assert len(transcript) == 4
    for path, said, status, told in transcript:
        answer = table.ask(path, json.loads(said))
        assert (answer[0], shape(answer[1])) == (int(status), shape(json.loads(told)))
    space = {}
    exec((STUDY / "participant.py").read_text(), space)  # noqa: S102  (our own)
    with ThreadPoolExecutor() as pool:
        told = [*pool.map(space["take_part"], [table.address] * 2, codes)]
    for number, steps in enumerate(told):
        kept = [line["step"] for line in lines_of(table, f"P0{number + 1}")[1:]]
        assert steps == kept[2 if number == 0 else 0 :] and kept[-1] == "block2.form.nasa-tlx" and len(kept) == 10
    assert "Traceback" not in table.end()


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
