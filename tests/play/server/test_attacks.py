"""Five clients do their worst at once: what that costs is bounded, whatever they send, and others play on."""

import asyncio
import threading
import time
from collections import Counter
from types import SimpleNamespace
from unittest.mock import AsyncMock, Mock

import pytest

from swarm_pz.errors import ProtocolError
from swarm_pz.play import protocol
from swarm_pz.play.server import app, budget, client_handler, connection, lobby, middleware, rendered_command
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.budget import Accounts, Rate
from swarm_pz.play.server.client_handler import ClientHandler
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.replays import LoadedRecording
from tests.play.recordings.test_format import record
from tests.play.recordings.test_playback import CALM
from tests.play.server.test_client_handler import Guest, visiting
from tests.play.server.test_connection import Socket
from tests.play.server.test_room import until

ALONE = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
LARGE = protocol.CommandMessage(
    1, strokes=[protocol.StrokeMessage("attract", 0.3, [(k % 2 + 0.01, round(k / 4500, 4)) for k in range(300)] * 12)]
)


class Attacker:
    """A client with a connection as the server has it, whose clock stands still."""

    def __init__(self, hall):
        self.connection = Connection(Socket(), "192.0.2.66")
        self.handler = ClientHandler(hall, self.connection)
        self.say(protocol.Hello())

    def say(self, message):
        self.handler.hear(protocol.encode(message))

    def refused(self):
        """Count the refusals that wait to be sent to it."""
        told = [protocol.decode_server(data) for data in self.connection._waiting if isinstance(data, str)]
        return Counter(message.code for message in told if isinstance(message, protocol.Refused))


@pytest.fixture
def still(monkeypatch):
    """Hold the clock by which messages are counted."""
    now = time.monotonic()
    monkeypatch.setattr(connection, "time", SimpleNamespace(monotonic=lambda: now))


@pytest.fixture
def elsewhere(monkeypatch):
    """Give the threads in which each kind of work was done."""
    threads = {}

    def note(place, name):
        work = getattr(place, name)

        def noted(*what):
            threads.setdefault(name, []).append(threading.current_thread())
            return work(*what)

        monkeypatch.setattr(place, name, noted)

    note(rendered_command, "density_of")
    for name in ("read", "picture", "moment"):
        note(LoadedRecording, name)
    return threads


async def plays_on(guest):
    """Whether a game goes on, no tick left out."""
    count = len(guest.frames)
    await until(lambda: len(guest.frames) > count + 10)
    sequences = [sequence for _, sequence in guest.frames]
    return sequences == list(range(sequences[0], sequences[0] + len(sequences)))


def peaceful(hall):
    guest = Guest(hall)
    guest.say(ALONE)
    guest.say(protocol.Ready())
    return guest


def test_a_flood_of_drawings_is_painted_twice_a_client_and_not_where_games_run(still, elsewhere, tmp_path):
    assert 20_000 < len(protocol.encode(LARGE)) < protocol.MAX_MESSAGE_BYTES

    async def script(hall):
        guest, attackers = peaceful(hall), [Attacker(hall) for _ in range(5)]
        for attacker in attackers:
            attacker.say(ALONE)
            attacker.say(protocol.Ready())
            for _ in range(15):
                attacker.say(LARGE)
        affordable = 2 * protocol.MAX_MESSAGE_BYTES // len(protocol.encode(LARGE))
        assert all(attacker.refused() == {"too_many": 15 - affordable} for attacker in attackers)
        await until(lambda: all(attacker.handler._rendering is None for attacker in attackers))
        assert 5 <= len(elsewhere["density_of"]) <= 5 * affordable
        assert len(set(elsewhere["density_of"])) == 1 and threading.current_thread() not in elsewhere["density_of"]
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_floods_of_openings_seeks_and_take_overs_are_one_at_a_time_and_not_where_games_run(still, elsewhere, tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(hall):
        guest, attackers = peaceful(hall), [Attacker(hall) for _ in range(5)]
        for attacker in attackers:
            for _ in range(3):
                attacker.say(protocol.OpenReplay("a.jsonl"))
        await until(lambda: len(hall.watched) == 5)
        assert len(elsewhere["read"]) <= 2 * 5, "who asks again is read for once, and what had begun ends"
        await asyncio.sleep(0.1)
        elsewhere["picture"].clear()
        for attacker in attackers:
            attacker.say(protocol.Pace(0.0))
            for tick in range(10):
                attacker.say(protocol.Seek(10 * tick))
        await until(lambda: len(elsewhere["picture"]) >= 5)
        await asyncio.sleep(0.2)
        assert len(elsewhere["picture"]) <= 2 * 5, "of ten"
        for attacker in attackers:
            for _ in range(5):
                attacker.say(protocol.TakeOver("red", "uniform"))
        await until(lambda: len(hall.rooms) == 6)
        await asyncio.sleep(0.1)
        assert len(hall.rooms) == 6 and not hall.watched
        for kind in ("read", "picture", "moment"):
            assert len(set(elsewhere[kind])) == 1 and threading.current_thread() not in elsewhere[kind], kind
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_who_fills_the_house_with_rooms_leaves_most_of_it_to_others(tmp_path, monkeypatch):
    monkeypatch.setattr(lobby, "MOST_ROOMS_OF_ADDRESS", 10)

    async def script(hall):
        guest = peaceful(hall)
        for _ in range(6):
            attackers = [Attacker(hall) for _ in range(5)]
            for attacker in attackers:
                attacker.say(ALONE)
                attacker.say(protocol.Ready())
            refused = attackers[-1].refused()
            for attacker in attackers:
                attacker.handler.end()
        assert refused == {"full": 1, "out_of_turn": 1}
        assert len(hall.rooms) <= 10 + 5 + 1
        assert len(list(tmp_path.glob("*.jsonl"))) <= 10 + 5, "nor are so many games begun"
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_numbers_that_take_hundreds_of_times_as_long_to_read_are_refused_and_words_like_them_are_not(monkeypatch):
    words = protocol.decode_client(f'{{"type":"hello","token":"{"1e30" * 8}"}}')
    assert words.token == "1e30" * 8
    assert protocol.decode_client('{"type":"command","number":1,"density":[[3e-120,0e999]]}').density == [[3e-120, 0.0]]
    monkeypatch.setattr(protocol, "_client_decoder", Mock())
    for number in ("1e300", "-2.5E+23", "5e-324", "12e00301"):
        with pytest.raises(ProtocolError, match="a number must be 0, or from 1e-300 to 1e"):
            protocol.decode_client(f'{{"type":"ping","sent_ms":{number}}}')
    protocol._client_decoder.decode.assert_not_called()


def test_a_command_of_who_has_no_seat_is_refused_before_it_is_read(monkeypatch, tmp_path):
    async def script(hall):
        stranger, player = Attacker(hall), Attacker(hall)
        player.say(ALONE)
        read = Mock(side_effect=protocol.decode_client)
        monkeypatch.setattr(protocol, "decode_client", read)
        stranger.say(LARGE)
        read.assert_not_called()
        assert stranger.refused() == {"out_of_turn": 1}
        player.say(LARGE)
        read.assert_called_once()

    visiting(tmp_path, script)


class Clock:
    """A clock that goes on while somebody sleeps, and a processor that works when it is told to."""

    def __init__(self, monkeypatch):
        self.now = self.worked = 0.0
        clocks = SimpleNamespace(monotonic=lambda: self.now, thread_time=lambda: self.worked)
        monkeypatch.setattr(budget, "time", clocks)
        monkeypatch.setattr(budget, "asyncio", SimpleNamespace(Lock=asyncio.Lock, sleep=self.sleep))

    async def sleep(self, seconds):
        self.now += seconds
        await asyncio.sleep(0)


def test_only_the_steps_of_work_are_charged_and_whoever_overdraws_waits_until_it_has_come_back(monkeypatch):
    clock = Clock(monkeypatch)
    accounts = Accounts(Rate(1.0, 0.1), Rate(10.0, 1.0))
    account, neighbour = accounts.of(("a", 1)), accounts.of(("a", 2))

    async def work():
        clock.worked += 2.0
        await asyncio.sleep(0)  # others work meanwhile
        with pytest.raises(asyncio.CancelledError):
            await asyncio.sleep(60)
        clock.worked += 1.0
        return "done"

    async def play():
        task = asyncio.create_task(account.run(work()))
        await asyncio.sleep(0)
        clock.worked += 100.0
        for _ in range(3):
            await asyncio.sleep(0)
        task.cancel()
        assert await task == "done"
        assert (account.debt_s(), neighbour.debt_s()) == (pytest.approx(20.0), 0.0)
        await neighbour.turn()
        assert clock.now == 0.0, "the address has more left"
        await account.turn()
        assert clock.now == pytest.approx(20.0)

    asyncio.run(play())


def test_an_address_in_debt_serves_its_connections_in_turn_and_no_debt_is_left_behind(monkeypatch):
    clock = Clock(monkeypatch)
    accounts = Accounts(Rate(1.0, 1.0), Rate(2.0, 0.5))
    served = []

    async def use(name, account):
        while clock.now < 100.0:
            await account.turn()
            served.append(name)
            account.spend(0.5)

    async def play():
        everybody = [accounts.of(("a", port)) for port in range(1, 10)]
        await asyncio.gather(*(use(name, account) for name, account in enumerate(everybody)))
        counts = Counter(served)
        assert min(counts.values()) >= 10 and len(served) <= 2.0 / 0.5 + 100.0 + 9, "of about eleven each"
        assert accounts.of(("a", 10)).debt_s() > 0.0 and accounts.of(("b", 1)).debt_s() == 0.0
        accounts.forget(clock.now)
        assert accounts.of(("a", 11)).debt_s() > 0.0

    asyncio.run(play())


def test_requests_are_charged_to_their_address_and_refused_with_words_once_it_has_nothing(monkeypatch, tmp_path):
    monkeypatch.setattr(middleware, "_PATIENCE_S", 0.01)

    async def script(hall):
        server = Server(hall)
        answer = server.app(["here"])

        async def ask(host):
            scope = {"type": "http", "method": "GET", "path": "/status", "client": (host, 5)}
            scope |= {"headers": [(b"host", b"here")], "query_string": b""}
            told = []
            await answer(scope, Mock(), AsyncMock(side_effect=told.append))
            return told[0]["status"], told[1]["body"]

        assert (await ask("192.0.2.1"))[0] == 200
        assert server.accounts._addresses["192.0.2.1"].budget.left(0.0) < app.ADDRESS_S.most
        server.accounts.of(("192.0.2.1", 6)).spend(100.0)
        status, text = await ask("192.0.2.1")
        assert status == 429 and b"try again in a few seconds" in text
        assert (await ask("192.0.2.2"))[0] == 200, "others are not asked to wait"

    visiting(tmp_path, script)


def test_a_client_in_debt_is_told_so_and_heard_later(monkeypatch):
    clock, guest = Clock(monkeypatch), Connection(Socket())
    account = Accounts(app.CONNECTION_S, app.ADDRESS_S).of(("a", 1))
    account.spend(1.0)
    asyncio.run(client_handler.wait_for_turn(account, guest, 60_000))
    (told,) = guest._waiting
    assert "more processor time than a client may use" in told
    assert clock.now == pytest.approx((1.0 - app.CONNECTION_S.most) / app.CONNECTION_S.per_second)
