"""Automatic responses: when they act, as whom they command, and what is refused."""

import asyncio

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import CommandError, PolicyError
from swarm_pz.play import protocol
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.protocol import InForceMessage, Response, Rule, SeatCommand, When
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.server.responses import SAVED, ReadyRule, Responses, TeamView, check_rules
from tests.play.server.test_client_handler import Guest
from tests.play.server.test_room import playing, read, until

EVEN = np.ones((10, 10)).tolist()
DOT = [protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])]
SILENT, ALWAYS = When(silent_s=0.5), When(silent_s=0.0)


def new_game(**rules):
    game = GameConfig(drones_per_team=2, capture=CaptureConfig(enabled=False), **rules)
    return LiveGame(TableConfig(game=game), 0)


def test_a_condition_holds_exactly_when_it_says():
    game = new_game()
    game.simulator.games.positions[0] = [[0.1, 0.1], [0.5, 0.5], [0.5, 0.75], [0.9, 0.9]]
    assert TeamView(game, 0, 0).fits(When(nobody_within=0.2)) and not TeamView(game, 0, 0).fits(When(nobody_within=0.3))
    assert not TeamView(game, 0, 0).fits(When(fewer=2)) and TeamView(game, 0, 0).fits(When(fewer=3))
    game.advance(30)
    assert TeamView(game, 0, 0).fits(When(silent_s=1.0)) and not TeamView(game, 0, 1).fits(When(silent_s=1.0))
    game.simulator.games.teams[:] = 0
    assert TeamView(game, 0, 0).fits(When(nobody_within=1.5)), "nobody is there"
    assert TeamView(game, 1, 0).fits(When(fewer=1)) and TeamView(game, 1, 0).fits(When(nobody_within=1.5))


def test_a_rule_has_one_condition_and_one_answer():
    ring = Response(policy="ring")
    for rules, told in (
        ([Rule(When(), ring)], "rule 1: a condition"),
        ([Rule(When(fewer=1, silent_s=5.0), ring)], "rule 1: a condition"),
        ([Rule(SILENT, ring), Rule(SILENT, Response())], "rule 2: what to do"),
        ([Rule(SILENT, Response(policy="a", density=EVEN))], "rule 1: what to do"),
        ([Rule(SILENT, Response(policy=name)) for name in "abcd"], "got 4"),
    ):
        with pytest.raises(CommandError, match=told):
            check_rules(rules)


class Commands:
    """Keeps the commands of a game."""

    def __init__(self):
        self.sent, self.given = [0, 0], []

    def submit(self, command):
        self.given.append(command)


def saved(game, team, when, given, kind="density"):
    return ReadyRule(Rule(when, Response(density=EVEN)), game.reader.read(team, 0, given, kind, SAVED))


@pytest.mark.parametrize("team", [0, 1])
def test_the_first_rule_whose_condition_holds_for_its_own_side_acts(team):
    game, commands = new_game(), Commands()
    game.simulator.games.teams[0] = [1 - team, 1 - team, 1 - team, team]
    responses = Responses(team, None, lambda: None, pytest.fail)
    responses.replace([saved(game, team, when, np.eye(10)) for when in (When(fewer=1), When(fewer=2), ALWAYS)])
    for _ in range(2):
        responses.look(game, commands)
    assert responses.acting == (1, SAVED)
    assert [(command.team, command.number, command.sender) for command in commands.given] == [(team, 1, SAVED)]
    responses.replace([saved(game, team, ALWAYS, np.eye(10))])
    assert responses.acting == (None, ""), "other rules act from when they are looked at"


def test_a_saved_command_that_cannot_fly_the_team_as_it_is_now_is_told_of_and_not_sent():
    game, commands, told = new_game(controllers="formation"), Commands(), []
    responses = Responses(1, None, lambda: None, told.append)
    responses.replace([saved(game, 1, ALWAYS, {"points": [(-1, 0), (1, 0)]}, "formation")])
    game.simulator.games.teams[0, 1] = 1
    responses.look(game, commands)
    (reason,) = told
    assert reason.startswith("rule 1 commands nothing: ") and not commands.given


# --- at a table -----------------------------------------------------------------------------------


@pytest.fixture
async def guest(hall):
    """Give a guest who plays alone."""
    made = Guest(hall)
    made.say(protocol.Create(settings=protocol.Settings(red=3, blue=0, time_limit=None, speed=2.0)))
    made.say(protocol.Ready())
    await playing(hall.room())
    return made


def acting(guest):
    return [(message.rule, message.sender) for message in guest.heard(protocol.Acting)]


async def test_a_saved_drawing_is_sent_once_while_its_player_says_nothing(hall, guest):
    rules = protocol.Rules([Rule(When(fewer=2), Response(density=EVEN)), Rule(SILENT, Response(strokes=DOT))])
    assert guest.say(rules) is None
    await until(lambda: guest.heard(protocol.InForceMessage))
    assert acting(guest) == [(1, SAVED)]
    assert guest.say(rules) is None, "the same rules change nothing"
    assert guest.say(protocol.CommandMessage(1, density=EVEN)) is None
    await until(lambda: len(acting(guest)) == 3)
    assert acting(guest) == [(1, SAVED), (None, ""), (1, SAVED)], "one's own command ended it for a while"
    guest.say(protocol.Rules([]))
    await until(lambda: len(acting(guest)) == 4 and len(guest.heard(protocol.InForceMessage)) == 3)
    hall.room().stop()
    recording = read(hall.room())
    commands = recording.of(SeatCommand)
    assert [(line.sender, line.number) for line in commands] == [(SAVED, 1), ("", 1), (SAVED, 2)]
    assert commands[0].density == commands[2].density != EVEN and commands[0].timing is None
    assert [line.sender for line in recording.of(InForceMessage)] == [SAVED, "", SAVED]
    assert Playback(recording).verify().verified
    (row,) = seat_rows(recording)
    assert (row.commands, row.automatic_commands) == (1, 2)


async def test_a_policy_acts_as_the_sender_while_its_condition_holds(hall, guest):
    answers, workers = iter(range(1, 100)), hall.context.workers

    async def answer(seat):
        return np.full((10, 10), 0.5) + np.eye(10) / (1 + next(answers))

    workers.answer = answer
    guest.say(protocol.Rules([Rule(SILENT, Response(policy="ring"))]))
    await until(lambda: len(guest.heard(protocol.InForceMessage)) >= 2)
    assert acting(guest) == [(0, "auto:ring")]
    (key,) = workers.loaded
    asked, first = [tick for _, tick in workers.asked], workers.seeds[key]
    assert min(np.diff(asked)) >= 30, "no more often than policies are"
    guest.handler.end()
    back = Guest(hall, token=hall.room().seats[0].token)
    assert acting(back) == [(0, "auto:ring")], "also after a reconnection"
    back.say(protocol.CommandMessage(1, density=EVEN))
    await until(lambda: len(acting(back)) == 3)
    assert workers.paused == [key] and acting(back)[1:] == [(None, ""), (0, "auto:ring")]
    await until(lambda: workers.seeds[key] is not first)  # it acts anew, with a new stream
    back.say(protocol.Leave())
    assert workers.forgotten == [key] and not hall.rooms


async def test_a_policy_that_cannot_act_is_refused_later_and_the_next_rule_acts(hall, guest):
    async def fail(seat):
        raise PolicyError("no idea")

    workers = hall.context.workers
    workers.loading = fail
    rules = [Rule(SILENT, Response(policy="ring")), Rule(SILENT, Response(density=EVEN))]
    assert guest.say(protocol.Rules(rules)) is None
    await until(lambda: guest.heard(protocol.Refused) and acting(guest))
    refused = guest.heard(protocol.Refused)[0]
    assert (refused.code, refused.about) == ("not_valid", "rules")
    assert refused.reason == "ring will not act: no idea" and acting(guest) == [(1, SAVED)]
    workers.loading, workers.answer = None, fail
    guest.say(protocol.Rules(rules[:1]))
    await until(lambda: len(guest.heard(protocol.Refused)) == 2 and len(acting(guest)) == 4)
    assert acting(guest)[2:] == [(0, "auto:ring"), (None, "")], "it is tried again with other rules, and fails"


async def test_an_answer_that_comes_when_its_rule_acts_no_more_is_nobodys(hall, guest):
    gate, asked = asyncio.Event(), []

    async def answer(seat):
        asked.append(seat)
        await gate.wait()
        return np.eye(10)

    hall.context.workers.answer = answer
    guest.say(protocol.Rules([Rule(SILENT, Response(policy="ring"))]))
    await until(lambda: asked)
    guest.say(protocol.CommandMessage(1, density=EVEN))
    await until(lambda: len(acting(guest)) == 2)
    guest.say(protocol.Rules([]))
    gate.set()
    tick = hall.room().session.game.tick
    await until(lambda: hall.room().session.game.tick > tick + 9)
    assert [one.sender for one in guest.heard(protocol.InForceMessage)] == [""]


async def test_rules_with_one_that_cannot_be_are_refused_and_nothing_changes(hall, guest):
    fine = Rule(SILENT, Response(density=EVEN))
    guest.say(protocol.Rules([fine]))
    await until(lambda: acting(guest))
    cases = (
        (Response(policy="nobody"), "unknown"),
        (Response(density=[[1.0]]), "not_valid"),
        (Response(command=[[1.0, 2.0]]), "not_valid"),
        (Response(strokes=[protocol.StrokeMessage("attract", 9.0, [(0.5, 0.5)])]), "not_valid"),
        (Response(), "not_valid"),
    )
    for count, (do, code) in enumerate(cases, 1):
        guest.say(protocol.Rules([fine, Rule(SILENT, do)]))
        refused = await guest.refused(count)
        assert (refused.code, refused.about) == (code, "rules") and acting(guest) == [(0, SAVED)]
    watcher = Guest(hall)
    watcher.say(protocol.Join(hall.room().code))
    assert watcher.say(protocol.Rules([])) == "out_of_turn"
