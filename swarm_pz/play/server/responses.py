"""Automatic responses: what commands in a player's place, whenever its condition holds.

The paper's section IV-C: a person commands while that is better, and a policy, or what the person prepared, when it
is not.
"""

from __future__ import annotations

import asyncio
import functools
import itertools
import logging
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from swarm_pz.config import TICKS_PER_SECOND, GameConfig
from swarm_pz.errors import CommandError, SwarmError
from swarm_pz.kernels.game import Games
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command
from swarm_pz.play.game import LiveGame
from swarm_pz.play.server.live_session import LiveSession
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers

SAVED = "auto:saved"
"""The sender of a saved command."""
MOST_POLICIES = 3
"""Policies among the responses of a seat: each is loaded, and takes memory."""
log = logging.getLogger("swarm_pz.play")


@dataclass(frozen=True)
class ReadyRule:
    """A rule, and the command that it saved; None if it has a policy."""

    rule: protocol.Rule
    command: Command | None

    @property
    def sender(self) -> str:
        """Who commands while it acts."""
        return SAVED if self.rule.do.policy is None else f"auto:{self.rule.do.policy}"


class Acting(NamedTuple):
    """Which rule acts, by its place, and who its sender is."""

    rule: int | None = None
    sender: str = ""


def check_rules(rules: Sequence[protocol.Rule]) -> None:
    """Refuse rules that say more or less than one condition and one answer, or name too many policies.

    Raises
    ------
    CommandError
        If one does; it is named by its place, from 1.
    """
    for place, rule in enumerate(rules, 1):
        when, do = rule.when, rule.do
        if [when.fewer, when.nobody_within, when.silent_s].count(None) != 2:
            raise CommandError(f"rule {place}: a condition must be one of fewer, nobody_within and silent_s")
        if [do.policy, do.strokes, do.density, do.command].count(None) != 3:
            raise CommandError(f"rule {place}: what to do must be one of policy, strokes, density and command")
    named = {rule.do.policy for rule in rules} - {None}
    if len(named) > MOST_POLICIES:
        raise CommandError(f"the rules of a seat may name {MOST_POLICIES} different policies, got {len(named)}")


@dataclass(frozen=True)
class Look:
    """A team's side of a game at one moment.

    Attributes
    ----------
    game : LiveGame
    team : int
    sent : int
        The tick at which its player last sent something.
    """

    game: LiveGame
    team: int
    sent: int

    @functools.cached_property
    def nearest(self) -> float:
        """Map widths between an own drone and the opponent nearest to it; infinite if there is none."""
        positions, teams = self.game.simulator.positions[0], self.game.simulator.teams[0]
        own, others = (positions[teams == side].astype(np.float64) for side in (self.team, 1 - self.team))
        x, y = (np.subtract.outer(own[:, axis], others[:, axis]) for axis in range(2))
        return float(np.sqrt((x * x + y * y).min(initial=np.inf)))

    def shows(self, when: protocol.When) -> bool:
        """Whether a condition holds."""
        if when.fewer is not None:
            return self.game.sizes[self.team] < when.fewer
        if when.silent_s is not None:
            return self.game.tick - self.sent >= when.silent_s * TICKS_PER_SECOND
        return when.nobody_within is not None and self.nearest > when.nobody_within


class Responses:
    """The automatic responses of a seat, from game to game.

    Parameters
    ----------
    key : hashable
        What no other seat has.
    game : GameConfig
    team : int
    workers : PolicyWorkers
        Where policies load and think.
    changed : callable
        Called when another rule acts, or none any more; see `acting`.
    failed : callable
        Told why a rule never acts.

    Attributes
    ----------
    acting : Acting
    """

    def __init__(
        self,
        key: Hashable,
        game: GameConfig,
        team: int,
        workers: PolicyWorkers,
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        self._key, self._game, self._team, self._workers = key, game, team, workers
        self._changed, self._failed = changed, failed
        self.acting = Acting()
        self._rules: list[ReadyRule] = []
        self._places: dict[str, PolicySeat] = {}
        self._loading: dict[str, asyncio.Task[None]] = {}
        self._able: set[str] = set()
        """Policies that are loaded."""
        self._counts: dict[str, itertools.count[int]] = {}
        self._thinking: asyncio.Task[None] | None = None
        self._asked: int | None = None
        """The tick at which the policy that acts was asked."""
        self._names = itertools.count()
        self._seed = np.random.SeedSequence()
        """Of the policy that acts; recordings hold what it said."""

    def replace(self, rules: list[ReadyRule]) -> None:
        """Take other rules; the same ones change nothing."""
        if [one.rule for one in rules] == [one.rule for one in self._rules]:
            return
        self.rest()
        self._rules = rules
        named = {one.rule.do.policy for one in rules if one.rule.do.policy is not None}
        for policy in list(self._places):
            has_failed = policy not in self._able and self._loading[policy].done()
            if policy not in named or has_failed:
                self._forget(policy)
        for policy in named - set(self._places):
            key = self._key, "auto", next(self._names)
            self._places[policy] = PolicySeat(key=key, policy=policy, game=self._game, team=self._team)
            self._loading[policy] = asyncio.create_task(self._load(policy))

    async def _load(self, policy: str) -> None:
        try:
            await self._workers.load(self._places[policy])
            self._able.add(policy)
        except SwarmError as error:
            self._give_up(policy, str(error))
        except Exception:
            log.exception("a policy was not loaded")
            self._give_up(policy, "it could not be loaded")

    def _give_up(self, policy: str, reason: str) -> None:
        self._able.discard(policy)
        self._failed(f"{policy} will not act: {reason}")

    def _forget(self, policy: str) -> None:
        self._loading.pop(policy).cancel()
        self._able.discard(policy)
        self._workers.forget(self._places.pop(policy))

    def close(self) -> None:
        """Let all of it go."""
        self.rest()
        self._rules = []
        if self._thinking is not None:
            self._thinking.cancel()
        for policy in list(self._places):
            self._forget(policy)

    def rest(self) -> None:
        """Act no more, until a condition is looked at and holds."""
        self._act(Acting())

    def _act(self, acting: Acting) -> None:
        if acting == self.acting:
            return
        if self.acting.rule is not None:
            policy = self._rules[self.acting.rule].rule.do.policy
            if policy in self._places:
                self._workers.pause(self._places[policy])
        self._asked = None
        self.acting = acting
        self._changed()

    def look(self, session: LiveSession) -> None:
        """See whether a condition holds, and let the first rule act whose does."""
        seen = Look(session.game, self._team, session.commands.sent[self._team])
        before, now = self.acting, Acting()
        for place, one in enumerate(self._rules):
            is_able = one.rule.do.policy is None or one.rule.do.policy in self._able
            if is_able and seen.shows(one.rule.when):
                now = Acting(place, one.sender)
                break
        self._act(now)
        if now.rule is None:
            return
        one = self._rules[now.rule]
        if one.command is None:
            self._ask(session, one)
        elif now != before:
            try:
                session.game.check_size(one.command)
                session.commands.submit(replace(one.command, number=self._count(one.sender)))
            except CommandError as error:
                self._failed(f"rule {now.rule + 1} commands nothing: {error}")

    def _count(self, sender: str) -> int:
        return next(self._counts.setdefault(sender, itertools.count(1)))

    def _ask(self, session: LiveSession, one: ReadyRule) -> None:
        """Ask the policy that acts, as often as policies are asked, and again only when it has answered."""
        is_free = self._thinking is None or self._thinking.done()
        is_due = self._asked is None or session.game.tick - self._asked >= self._game.step_ticks
        if is_free and is_due:
            begins = self._asked is None
            if begins:
                self._seed = np.random.SeedSequence()
            place, shown = self._places[str(one.rule.do.policy)], session.game.simulator.snapshot()
            self._thinking = asyncio.create_task(self._think(session, place, shown, self.acting, begins=begins))
            self._asked = session.game.tick

    async def _think(
        self, session: LiveSession, place: PolicySeat, shown: Games, acting: Acting, *, begins: bool
    ) -> None:
        try:
            answer = await self._workers.ask(place, shown, self._seed, begins=begins)
        except SwarmError as error:
            self._give_up(place.policy, str(error))
        except Exception:
            log.exception("an automatic response was not asked")
            self._give_up(place.policy, "it could not be asked")
        else:
            if self.acting is acting and not session.ended:  # else it comes too late
                session.commands.take_answer(self._team, self._count(acting.sender), answer, acting.sender)
