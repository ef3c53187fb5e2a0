"""What the server tells about itself: addresses to invite people to, cards, labels, recorded games."""

import asyncio
import json
import urllib.parse
from types import SimpleNamespace

from segno import make
from starlette.requests import Request

from swarm_pz.play import protocol
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.server import app
from swarm_pz.play.server.serve import addresses_of
from tests.play.conftest import Table


def test_addresses_to_invite_to_are_those_that_other_devices_reach():
    names = ["127.0.0.1:80", "localhost", "localhost:80", "[::1]:80", "box.local:80", "192.0.2.7:80", "192.0.2.7"]
    names += ["[2001:db8::7]:80", "[2001:db8::7]"]
    found = addresses_of(names)
    assert found == ["http://192.0.2.7:80/", "http://[2001:db8::7]:80/", "http://box.local:80/"]
    assert addresses_of(["127.0.0.1:8000", "localhost:8000"]) == []


def test_an_invitation_is_drawn_for_rooms_and_addresses_of_this_table_and_no_others(table):
    client = table.visit()
    client.say(protocol.Create())
    room = client.hear(protocol.Seated).room

    def drawn(room, at):
        return table.get(f"/invitations/{room}.svg?at={urllib.parse.quote(at)}")

    status, headers, text = drawn(room, f"http://{table.address}/")
    assert status == 200 and headers["content-type"].startswith("image/svg+xml")
    assert 'xmlns="http://www.w3.org/2000/svg"' in text and "<path" in text
    assert drawn(room, f"https://{table.address}/")[0] == 200, "behind a proxy"
    assert drawn("ZZZZ", f"http://{table.address}/")[0] == 404
    assert drawn(room, "http://elsewhere.example/")[0] == drawn(room, "")[0] == 404
    client.close()


def test_an_invitation_is_drawn_once(tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(app.segno, "make", lambda text, **how: made.append(text) or make(text, **how))
    path = {"path_params": {"room": "QRQR"}, "query_string": b"at=http://here/", "headers": [(b"host", b"here")]}
    hall = SimpleNamespace(rooms={"QRQR": None}, addresses=[])

    async def ask():
        return [await app.Server(hall)._invitation(Request({"type": "http"} | path)) for _ in range(3)]

    first, *others = asyncio.run(ask())
    assert b"<path" in first.body and all(other.body == first.body for other in others)
    assert made == ["http://here/#room=QRQR"], "all games wait for it"


def test_who_comes_is_told_how_good_policies_are(table):
    client = table.visit()
    (welcome,) = [message for message in client.messages if isinstance(message, protocol.Welcome)]
    cards = {policy.name: policy.card for policy in welcome.policies}
    assert cards["uniform"].rating == 1000 < cards["champion"].rating
    assert len(cards["uniform"].target) == 10 and cards["uniform"].drones
    assert welcome.addresses == [], "this machine alone can reach it"
    client.close()


def test_labels_are_seen_at_the_table_and_recorded_only_if_the_host_says_so(table, tmp_path):
    plain = Table(tmp_path)
    for server, is_recorded in ((plain, False), (table, True)):
        client = server.visit()
        welcome = next(message for message in client.messages if isinstance(message, protocol.Welcome))
        assert welcome.records_labels == is_recorded
        client.say(protocol.Create(settings=protocol.Settings(blue=0, time_limit=None), label="P9"))
        room = client.hear(protocol.Seated).room
        assert client.hear(protocol.RoomState).red.label == "P9"
        client.say(protocol.Ready())
        client.hear(protocol.RoomState, lambda state: state.phase == "playing")
        client.close()
        header = Recording.read(server.recording(room)).header
        assert header.red.label == ("P9" if is_recorded else "")
    plain.end()


def test_recorded_games_are_listed_the_latest_first_and_none_that_is_being_played(own_table):
    names = [f"2026010{day}T000000Z-ABCD-1.jsonl" for day in (1, 2)]
    for name in [*names, "notes.txt"]:
        (own_table.folder / name).write_text("{}\n")
    client = own_table.visit()
    client.practise()
    status, _, text = own_table.get("/recordings")
    assert status == 200 and json.loads(text) == names[::-1]
    client.close()
