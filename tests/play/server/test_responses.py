"""Automatic responses: when they act, as whom they command, and what is refused."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import CommandError, PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.protocol import Response, Rule, When
from swarm_pz.play.recordings.format import CommandLine, InForceLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.server.responses import SAVED, Look, ReadyRule, Responses, check_rules
from tests.play.server.test_client_handler import Guest, visiting
from tests.play.server.test_room import Workers, playing, read, until

EVEN = np.ones((10, 10)).tolist()
DOT = [protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])]
SILENT = When(silent_s=0.5)


def game_with(places):
    game = LiveGame(TableConfig(game=GameConfig(drones_per_team=2, capture=CaptureConfig(enabled=False))), 0)
    game.simulator.games.positions[0] = places
    return game


def test_a_condition_holds_exactly_when_it_says():
    game = game_with([[0.1, 0.1], [0.5, 0.5], [0.5, 0.75], [0.9, 0.9]])
    assert Look(game, 0, 0).shows(When(nobody_within=0.2)) and not Look(game, 0, 0).shows(When(nobody_within=0.3))
    assert not Look(game, 0, 0).shows(When(fewer=2)) and Look(game, 0, 0).shows(When(fewer=3))
    game.advance(30)
    assert Look(game, 0, 0).shows(When(silent_s=1.0)) and not Look(game, 0, 1).shows(When(silent_s=1.0))
    game.simulator.games.teams[:] = 0
    assert Look(game, 0, 0).shows(When(nobody_within=1.5)), "nobody is there"
    assert Look(game, 1, 0).shows(When(fewer=1)) and Look(game, 1, 0).shows(When(nobody_within=1.5))


@pytest.mark.parametrize(
    ("rules", "told"),
    [
        ([Rule(When(), Response(policy="ring"))], "rule 1: a condition must be one"),
        ([Rule(When(fewer=1, silent_s=5.0), Response(policy="ring"))], "rule 1: a condition must be one"),
        ([Rule(SILENT, Response(policy="a")), Rule(SILENT, Response())], "rule 2: what to do must be one"),
        ([Rule(SILENT, Response(policy="a", density=EVEN))], "rule 1: what to do must be one"),
        ([Rule(SILENT, Response(policy=name)) for name in "abcd"], "3 different policies, got 4"),
    ],
)
def test_a_rule_has_one_condition_and_one_answer(rules, told):
    with pytest.raises(CommandError, match=told):
        check_rules(rules)


class Commands:
    """What is handed in to a game."""

    def __init__(self, game):
        self.game, self.sent, self.given = game, [0, 0], []

    def submit(self, command):
        self.given.append(command)

    def take_answer(self, team, number, answer, sender):
        self.submit(self.game.reader.answered(team, number, answer, sender))


class Session:
    """A game without a clock, and what is handed in to it."""

    ended = False

    def __init__(self, **rules):
        game = GameConfig(drones_per_team=2, capture=CaptureConfig(enabled=False), **rules)
        self.game = LiveGame(TableConfig(game=game), 0)
        self.commands = Commands(self.game)

    def responses(self, team, workers=None, failed=None):
        """Return those of a seat of this game."""
        rules = self.game.config.game
        return Responses("seat", rules, team, workers or Workers(), lambda: None, failed or pytest.fail)


async def settled():
    """Let all that can go on do so."""
    for _ in range(10):
        await asyncio.sleep(0)


def saved(session, team, when, given, kind="density"):
    return ReadyRule(Rule(when, Response(density=EVEN)), session.game.reader.read(team, 0, given, kind, SAVED))


@pytest.mark.parametrize("team", [0, 1])
def test_the_first_rule_whose_condition_holds_for_its_own_side_acts(team):
    session = Session()
    session.game.simulator.games.teams[0] = [1 - team, 1 - team, 1 - team, team]
    responses = session.responses(team)
    dot = np.eye(10)
    always = When(silent_s=0.0)
    responses.replace([saved(session, team, when, dot) for when in (When(fewer=1), When(fewer=2), always)])
    responses.look(session)
    responses.look(session)
    assert responses.acting == (1, SAVED)
    assert [(command.team, command.number, command.sender) for command in session.commands.given] == [(team, 1, SAVED)]
    responses.replace([saved(session, team, always, dot)])
    assert responses.acting == (None, ""), "other rules act from when they are looked at"


def test_a_saved_command_that_cannot_fly_the_team_as_it_is_now_is_told_of_and_not_sent():
    session, told = Session(controllers="formation"), []
    responses = session.responses(1, failed=told.append)
    points = {"points": [(-1, 0), (1, 0)]}
    responses.replace([saved(session, 1, When(silent_s=0.0), points, "formation")])
    session.game.simulator.games.teams[0, 1] = 1
    responses.look(session)
    (reason,) = told
    assert reason.startswith("rule 1 commands nothing: ") and "that is 3, got 2" in reason
    assert not session.commands.given


def test_a_policy_that_acts_anew_is_asked_at_once_for_its_own_side_with_a_new_stream():
    async def script():
        workers, session = Workers(), Session()
        responses = session.responses(1, workers)
        responses.replace([ReadyRule(Rule(SILENT, Response(policy="ring")), None)])

        async def look(ticks):
            session.game.advance(ticks)
            responses.look(session)
            await settled()

        await settled()
        await look(15)
        await look(6)
        ((seat, _),) = workers.asked
        assert (seat.team, seat.policy) == (1, "ring") and workers.paused == []
        first = workers.seeds[seat.key]
        session.commands.sent[1] = session.game.tick
        await look(3)
        assert (responses.acting, workers.paused) == ((None, ""), [seat.key])
        await look(15)
        assert [tick for _, tick in workers.asked] == [15, 39] and workers.seeds[seat.key] is not first
        await look(30)
        assert [tick for _, tick in workers.asked] == [15, 39, 69]
        assert [(one.team, one.number, one.sender) for one in session.commands.given] == [
            (1, number, "auto:ring") for number in (1, 2, 3)
        ]
        responses.close()

    asyncio.run(script())


async def practising(hall, **settings):
    """Return a guest who plays alone."""
    guest = Guest(hall)
    guest.say(protocol.Create(settings=protocol.Settings(red=3, blue=0, time_limit=None, **settings)))
    guest.say(protocol.Ready())
    await playing(hall.room())
    return guest


def acting(guest):
    return [(message.rule, message.sender) for message in guest.heard(protocol.Acting)]


def test_a_saved_drawing_is_sent_once_while_its_player_says_nothing(tmp_path):
    async def script(hall):
        guest = await practising(hall)
        rules = protocol.Rules([Rule(When(fewer=2), Response(density=EVEN)), Rule(SILENT, Response(strokes=DOT))])
        assert guest.say(rules) is None
        await until(lambda: guest.heard(protocol.InForceMessage))
        assert acting(guest) == [(1, SAVED)]
        assert guest.heard(protocol.InForceMessage)[0].sender == SAVED
        assert guest.say(rules) is None, "the same rules change nothing"
        assert guest.say(protocol.CommandMessage(1, density=EVEN)) is None
        await until(lambda: len(guest.heard(protocol.Acting)) == 3)
        assert acting(guest) == [(1, SAVED), (None, ""), (1, SAVED)], "one's own command ended it for a while"
        guest.say(protocol.Rules([]))
        await until(lambda: len(guest.heard(protocol.Acting)) == 4)
        await until(lambda: len(guest.heard(protocol.InForceMessage)) == 3)
        hall.room().stop()
        recording = read(hall.room())
        commands = recording.of(CommandLine)
        assert [(line.sender, line.number) for line in commands] == [(SAVED, 1), ("", 1), (SAVED, 2)]
        assert commands[0].density == commands[2].density != EVEN and commands[0].timing is None
        assert [line.sender for line in recording.of(InForceLine)] == [SAVED, "", SAVED]
        result = Playback(recording).verify()
        assert result.verified, result
        (row,) = seat_rows(recording)
        assert (row.commands, row.automatic_commands) == (1, 2)

    visiting(tmp_path, script)


def test_a_policy_acts_as_the_sender_while_its_condition_holds(tmp_path):
    async def script(hall):
        answers = iter(range(1, 100))

        async def answer(seat):
            return np.full((10, 10), 0.5) + np.eye(10) / (1 + next(answers))

        hall.context.workers.answer = answer
        guest = await practising(hall)
        guest.say(protocol.Rules([Rule(When(nobody_within=0.2), Response(policy="ring"))]))
        await until(lambda: len(guest.heard(protocol.InForceMessage)) >= 2)
        assert acting(guest) == [(0, "auto:ring")]
        room = hall.room()
        asked = [tick for seat, tick in hall.context.workers.asked if seat.policy == "ring"]
        assert min(np.diff(asked)) >= 30, "no more often than policies are"
        guest.handler.end()
        back = Guest(hall, token=room.seats[0].token)
        assert acting(back) == [(0, "auto:ring")], "who comes back is told"
        back.say(protocol.Leave())
        assert hall.context.workers.forgotten and not hall.rooms

    visiting(tmp_path, script)


def test_a_policy_that_cannot_act_is_refused_later_and_the_next_rule_acts(tmp_path):
    async def script(hall):
        async def loading(seat):
            raise PolicyError("it answers commands of kind 'density'")

        hall.context.workers.loading = loading
        guest = await practising(hall)
        rules = [Rule(SILENT, Response(policy="ring")), Rule(SILENT, Response(density=EVEN))]
        assert guest.say(protocol.Rules(rules)) is None
        await until(lambda: guest.heard(protocol.Refused) and guest.heard(protocol.Acting))
        refused = guest.heard(protocol.Refused)[0]
        assert (refused.code, refused.about) == ("not_valid", "rules")
        assert refused.reason == "ring will not act: it answers commands of kind 'density'"
        assert acting(guest) == [(1, SAVED)]
        hall.context.workers.loading = None
        guest.say(protocol.Rules(rules[:1]))
        await until(lambda: len(acting(guest)) == 3)
        assert acting(guest)[-1] == (0, "auto:ring"), "it is tried again with other rules"

    visiting(tmp_path, script)


def test_an_answer_that_comes_when_its_rule_acts_no_more_is_nobodys_and_no_other_is_asked_before_it(tmp_path):
    async def script(hall):
        gate, asked = asyncio.Event(), []

        async def answer(seat):
            asked.append(seat)
            await gate.wait()
            return np.eye(10)

        hall.context.workers.answer = answer
        guest = await practising(hall)
        guest.say(protocol.Rules([Rule(SILENT, Response(policy="ring"))]))
        for number in (1, 2):
            await until(lambda number=number: len(acting(guest)) == 2 * number - 1)
            guest.say(protocol.CommandMessage(number, density=EVEN))
            await until(lambda number=number: len(acting(guest)) == 2 * number)
        assert len(asked) == 1
        gate.set()
        await until(lambda: len(guest.heard(protocol.InForceMessage)) == 3)
        assert [one.sender for one in guest.heard(protocol.InForceMessage)] == ["", "", "auto:ring"]
        assert len(asked) == 2, "the first answer was not followed"

    visiting(tmp_path, script)


@pytest.mark.parametrize(
    ("do", "code"),
    [
        (Response(policy="nobody"), "unknown"),
        (Response(density=[[1.0]]), "not_valid"),
        (Response(command=[[1.0, 2.0]]), "not_valid"),
        (Response(strokes=[protocol.StrokeMessage("attract", 9.0, [(0.5, 0.5)])]), "not_valid"),
        (Response(), "not_valid"),
    ],
)
def test_rules_with_one_that_cannot_be_are_refused_and_nothing_changes(do, code, tmp_path):
    async def script(hall):
        guest = await practising(hall)
        guest.say(protocol.Rules([Rule(SILENT, Response(density=EVEN))]))
        await until(lambda: acting(guest))
        guest.say(protocol.Rules([Rule(SILENT, Response(density=EVEN)), Rule(SILENT, do)]))
        await until(lambda: guest.heard(protocol.Refused))
        (refused,) = guest.heard(protocol.Refused)
        assert (refused.code, refused.about) == (code, "rules")
        assert acting(guest) == [(0, SAVED)]

    visiting(tmp_path, script)


def test_who_watches_sets_no_rules(tmp_path):
    async def script(hall):
        await practising(hall)
        watcher = Guest(hall)
        watcher.say(protocol.Join(hall.room().code))
        assert watcher.say(protocol.Rules([])) == "out_of_turn"

    visiting(tmp_path, script)
