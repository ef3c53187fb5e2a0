"""Automatic responses: rules that command in a player's place while a condition holds (the paper's section IV-C)."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import CommandError
from swarm_pz.play import protocol
from swarm_pz.play.commands import Command
from swarm_pz.play.game import LiveGame
from swarm_pz.play.server.incoming_commands import IncomingCommands
from swarm_pz.play.server.policy_workers import SeatPolicy

SAVED = "auto:saved"
"""The sender of a saved command."""
MOST_POLICIES = 3
"""Policies that the responses of a seat may name: each takes memory."""


@dataclass(frozen=True)
class ReadyRule:
    """A rule, and the command that it saved; None if it has a policy."""

    rule: protocol.Rule
    command: Command | None

    @property
    def sender(self) -> str:
        """The sender of its commands."""
        return SAVED if self.rule.do.policy is None else f"auto:{self.rule.do.policy}"


class Acting(NamedTuple):
    """Index of the rule that acts, and its sender."""

    rule: int | None = None
    sender: str = ""


def check_rules(rules: Sequence[protocol.Rule]) -> None:
    """Check that each rule has one condition and one answer, and that they do not name too many policies.

    Raises CommandError if not; the rule is named by its place, from 1.
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
class TeamView:
    """A team's side of a game at one moment; `sent` is the tick of its player's latest command."""

    game: LiveGame
    team: int
    sent: int

    @functools.cached_property
    def nearest(self) -> float:
        """Least distance between own and opposing drones, in map widths; infinite without opponents."""
        positions, teams = self.game.simulator.positions[0], self.game.simulator.teams[0]
        own, others = (positions[teams == side].astype(np.float64) for side in (self.team, 1 - self.team))
        x, y = (np.subtract.outer(own[:, axis], others[:, axis]) for axis in range(2))
        return float(np.sqrt((x * x + y * y).min(initial=np.inf)))

    def fits(self, when: protocol.When) -> bool:
        """Return true if a condition holds."""
        if when.fewer is not None:
            return self.game.sizes[self.team] < when.fewer
        if when.silent_s is not None:
            return self.game.tick - self.sent >= when.silent_s * TICKS_PER_SECOND
        return when.nobody_within is not None and self.nearest > when.nobody_within


class Responses:
    """The automatic responses of a seat, from game to game.

    - `load`: loads a policy of this name, and calls its second argument when that is done or has failed.
    - `changed`: called when `acting` has changed.
    - `failed`: called with the reason why a rule does not act.
    """

    def __init__(
        self,
        team: int,
        load: Callable[[str, Callable[[], None]], SeatPolicy],
        changed: Callable[[], None],
        failed: Callable[[str], None],
    ) -> None:
        self._team, self._load, self._changed, self._failed = team, load, changed, failed
        self.acting = Acting()
        self._rules: list[ReadyRule] = []
        self._policies: dict[str, SeatPolicy] = {}
        self._broken: set[str] = set()  # policies that failed: they act no more until other rules come
        self._counts: dict[str, itertools.count[int]] = {}
        self._asked: int | None = None  # tick of the latest question to the policy that acts
        self._seed = np.random.SeedSequence()  # of that policy

    @property
    def policies(self) -> int:
        """Number of its policies."""
        return len(self._policies)

    def replace(self, rules: list[ReadyRule]) -> None:
        """Replace the rules; the same ones change nothing."""
        if [one.rule for one in rules] == [one.rule for one in self._rules]:
            return
        self.rest()
        self._rules = rules
        named = {one.rule.do.policy for one in rules if one.rule.do.policy is not None}
        for policy in [policy for policy in self._policies if policy not in named or policy in self._broken]:
            self._forget(policy)
        for policy in named - set(self._policies):
            self._policies[policy] = self._load(policy, functools.partial(self._loaded, policy))

    def _loaded(self, policy: str) -> None:
        if self._policies[policy].state == "failed":
            self._give_up(policy, self._policies[policy].reason)

    def _give_up(self, policy: str, reason: str) -> None:
        self._broken.add(policy)
        self._failed(f"{policy} will not act: {reason}")

    def _forget(self, policy: str) -> None:
        self._broken.discard(policy)
        self._policies.pop(policy).close()

    def close(self) -> None:
        """End all responses."""
        self.rest()
        self._rules = []
        for policy in list(self._policies):
            self._forget(policy)

    def rest(self) -> None:
        """Act no more until a condition is checked again and holds."""
        self._act(Acting())

    def _act(self, acting: Acting) -> None:
        if acting == self.acting:
            return
        if self.acting.rule is not None and (policy := self._rules[self.acting.rule].rule.do.policy) is not None:
            self._policies[policy].rest()
        self._asked = None
        self.acting = acting
        self._changed()

    def _can_act(self, rule: protocol.Rule, view: TeamView) -> bool:
        policy = rule.do.policy
        is_able = policy is None or (policy not in self._broken and self._policies[policy].state == "loaded")
        return is_able and view.fits(rule.when)

    def look(self, game: LiveGame, commands: IncomingCommands) -> None:
        """Check all conditions; the first rule whose condition holds acts."""
        view = TeamView(game, self._team, commands.sent[self._team])
        able = (place for place, one in enumerate(self._rules) if self._can_act(one.rule, view))
        place, before = next(able, None), self.acting
        if place is None:
            self.rest()
            return
        one = self._rules[place]
        self._act(Acting(place, one.sender))
        if one.command is None:
            self._ask(game, commands, str(one.rule.do.policy))
        elif self.acting != before:
            try:
                game.check_size(one.command)
                commands.submit(replace(one.command, number=self._count(one.sender)))
            except CommandError as error:
                self._failed(f"rule {place + 1} commands nothing: {error}")

    def _count(self, sender: str) -> int:
        return next(self._counts.setdefault(sender, itertools.count(1)))

    def _ask(self, game: LiveGame, commands: IncomingCommands, policy: str) -> None:
        """Ask the policy that acts, once a command period."""
        if self._asked is None:
            self._seed = np.random.SeedSequence()
        elif game.tick - self._asked < game.config.game.step_ticks:
            return
        self._asked, sender = game.tick, self.acting.sender
        self._policies[policy].ask(
            game.simulator,
            self._seed,
            lambda answer: commands.take_answer(self._team, self._count(sender), answer, sender),
            functools.partial(self._give_up, policy),
        )
