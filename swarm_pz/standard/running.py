"""Play the whole standard for an entry and write its report; a stopped run continues."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from swarm_pz.bench import machine
from swarm_pz.config.base import check
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.provenance import versions
from swarm_pz.evaluation.workers import BackgroundTasks, SerialExecutor, never, silent
from swarm_pz.files import check_folder, draft_of
from swarm_pz.kernels.cache import processor
from swarm_pz.policy import Player, sort_of
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard import attacks
from swarm_pz.standard.figures import Results, figures
from swarm_pz.standard.games import (
    ITSELF,
    LEARNED,
    PlayerFactory,
    TrackGames,
    check_flies,
    choice_of,
    robust_of,
    worst_attackers,
)
from swarm_pz.standard.page import render
from swarm_pz.standard.protocol import Protocol, Track
from swarm_pz.standard.report import COST, FORMAT, write

WORK, EXPLOITERS = "work", "exploiters"
_ENTRY = "entry.json"
Say = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A method: the names or folders of its policies, one for each training seed."""

    policies: tuple[str, ...]
    name: str

    def __post_init__(self) -> None:
        check(0 < len(self.policies) <= 100, "policies", self.policies, "one to 100 names or folders")
        distinct = len(set(self.policies)) == len(self.policies)
        check(distinct, "policies", self.policies, "different ones, one of each training seed")
        named = isinstance(self.name, str) and 0 < len(self.name) <= 60 and self.name.isprintable()
        check(named, "name", self.name, "1 to 60 characters on one line")


def run(
    entry: Entry,
    out: Path,
    *,
    protocol: Protocol | None = None,
    attackers: Mapping[str, str] = MappingProxyType({}),
    pool: Executor | None = None,
    progress: attacks.Show = lambda *_: None,
    should_stop: Callable[[], bool] = never,
    say: Say = silent,
    command: str = "",
) -> dict[str, Any]:
    """Play the missing games of the standard, write the report, and return what ``report.json`` holds.

    Unfinished work is in ``out/work``. `attackers` maps names to policies that attack the entry in addition to the
    protocol's attackers. Apart from costs, the report does not depend on the `pool`.

    Raises
    ------
    Stopped
        If `should_stop` returns True; unfinished work is kept.
    ResultsError
        If an opponent is not the one that the protocol names, or the folder holds another entry's work.
    PolicyError
        If a policy is unknown, its commands are not densities, or (a ForfeitError) it is a program that fails.
    WorkerError
        If a worker died, or has other policies; finished work is kept.
    """
    protocol = protocol if protocol is not None else Protocol.read()
    began = time.monotonic()
    protocol.check()
    players = [check_flies(policy, protocol) for policy in entry.policies]
    check_folder(out)
    work = out / WORK
    with folder_lock(work):
        identities = [
            {"name": Path(policy).name, "kind": sort_of(player), "digest": identity_of(policy, player)}
            for policy, player in zip(entry.policies, players, strict=True)
        ]
        digests = [one["digest"] for one in identities]
        _claim(work / _ENTRY, {"protocol": protocol.digest, "policies": digests})
        policies = entry.policies
        each = protocol.robust.exploiters_each(len(policies))
        exploiters = tuple(str(out / EXPLOITERS / str(number)) for number in range(each * len(policies)))
        execution: dict[str, Any] = {"pool": pool if pool is not None else SerialExecutor(), "should_stop": should_stop}
        played: list[TrackGames] = []

        def play(track: Track, players: PlayerFactory, **keywords: Any) -> None:
            games = TrackGames(track, protocol, players, work / track.name, command=command, **keywords)
            games.play(progress=progress, **execution)
            played.append(games)

        with BackgroundTasks(execution["pool"]) as background:
            # Exploiters begin first: each occupies one worker for long, while the other workers play.
            learning = []
            for number, place in enumerate(exploiters):
                of, seed = divmod(number, each)
                say(f"track robust: learning to beat {identities[of]['name']}, {protocol.robust.steps:,} commands")
                more = (work, Path(place), policies[of], seed, should_stop)
                learning.append(attacks.begin_learning(background, protocol, *more))
            for track in protocol.tracks:
                background.check()  # raises exploiters' errors before hours of games
                if track.games:
                    say(f"track {track.name}: {track.games} games against each of {len(track.trials)}")
                    for one in (track, track.late):
                        play(one, PlayerFactory(policies, track.trials))
            searched = []
            for number, policy in enumerate(policies):
                say(f"track robust: searching for what beats {identities[number]['name']}")
                searched.append(attacks.find(policy, number, protocol, work, show=progress, **execution))
            digested = [end() for end in learning]
            say("track robust: games of all attackers")
            choice = choice_of(protocol)
            factory = PlayerFactory(policies, choice.trials, exploiters, tuple(attackers.items()))
            names = [[f"{ITSELF} {number}", *searched[number]] for number in range(len(policies))]
            for number in range(len(exploiters)):
                names[number // each].append(f"{LEARNED} {number}")
            public = [*(trial.name for trial in choice.trials), *attackers]
            play(
                choice, factory, meetings=[(number, name) for number, own in enumerate(names) for name in own + public]
            )
            play(robust_of(protocol), factory, meetings=list(worst_attackers(played[-1].lines()).items()))
            attacked = [
                {"learned": digested[each * number : each * (number + 1)], "searched": searched[number]}
                for number in range(len(policies))
            ]
        lines = [line for games in played for line in games.lines()]
        summary = figures(Results(lines, protocol, len(policies)))
        report = {
            "format": FORMAT,
            "protocol": {"version": protocol.version, "digest": protocol.digest},
            "name": entry.name,
            "policies": identities,
            "attacks": attacked,
            "seeds": {track.name: track.seed for track in protocol.tracks} | {"robust": protocol.robust.seed},
            "config_hash": protocol.game.hash,
            "rules_hash": protocol.game.rules_hash,
            "versions": versions(),
            "games": len(lines),
            "figures": summary,
            COST: {
                "policies": [cost_of(player) for player in players],
                "ms_a_command": round(float(np.mean([ms for games in played for ms in games.thinking_ms()])), 3),
                "measured_on": machine()["processor"],
                "processor": processor(),
                "processes": getattr(execution["pool"], "count", None),
                "seconds_of_this_sitting": round(time.monotonic() - began, 1),
                "command": command,
            },
        }
        write(out, report, lines, render(report))
    return report


def _claim(path: Path, digests: dict[str, Any]) -> None:
    """Write the entry's digests to a file; raise a ResultsError if it holds others."""
    if path.exists():
        try:
            before = json.loads(path.read_text())
        except (OSError, ValueError, RecursionError) as error:
            raise ResultsError(f"{path} is corrupt or foreign ({error!r}); use another folder") from error
        if before != digests:
            raise ResultsError(
                f"{path.parent.parent} holds the report of other policies or of another protocol; use another folder"
            )
    with draft_of(path) as draft:
        draft.write_text(json.dumps(digests) + "\n")


def cost_of(player: Player) -> dict[str, Any]:
    """Return the cost of a policy: commands and seconds of its and all its ancestors' training, and its parameters.

    A number is None if the card has it for no training; `at_least` names those that are missing for some.
    """
    from swarm_pz.policies.learned import lineage

    card = getattr(player, "card", None)
    fields = card if isinstance(card, dict) else {}
    weights = getattr(player, "weights", None)
    parameters = sum(int(np.prod(values.shape)) for values in weights().values()) if weights is not None else None
    trainings, sums, at_least = lineage(fields), {}, []
    for name, field in (("commands", "steps"), ("seconds", "seconds")):
        known = [one[field] for one in trainings if one[field] is not None]
        sums[name] = round(sum(known), 1) if known else None
        if 0 < len(known) < len(trainings):
            at_least.append(name)
    return {**sums, "at_least": at_least, "processor": fields.get("processor"), "parameters": parameters}
