"""Checks a report: its files, its figures, and a sample of its games, which is played again."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config.base import check_count
from swarm_pz.errors import ConfigError, ResultsError, SwarmError
from swarm_pz.evaluation.bundles import MOST_BYTES
from swarm_pz.evaluation.provenance import versions
from swarm_pz.evaluation.workers import silent
from swarm_pz.kernels.cache import processor
from swarm_pz.policy import Player, registered, sort_of
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard import report as files
from swarm_pz.standard.figures import ROBUST
from swarm_pz.standard.games import LEARNED, Line, PlayerFactory, check_flies, play_again, siege_of
from swarm_pz.standard.page import render
from swarm_pz.standard.protocol import Protocol
from swarm_pz.standard.running import Entry, cost_of, describe

SAMPLE, LARGER = 40, 6
"""Games that are played again; more of them, by this factor, on another processor, where only shares compare."""
_SURE = 3.3
"""Standard errors by which shares may differ: chance alone exceeds it once in a thousand reports."""


@dataclass(frozen=True)
class Verdict:
    """What was checked: the report, in words which check its games have passed, and the seed of the sample."""

    report: dict[str, Any]
    check: str
    seed: int

    @property
    def is_try(self) -> bool:
        """Whether the report is a try, with few and short games."""
        return files.is_try(self.report)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """In words, what the folder holds and the check has not looked at."""
        found = []
        if not _is_of_this_version(self.report):
            found.append(f"{files.PAGE}, since another version wrote it: show one that is made of {files.REPORT} anew")
        if "improvement" in self.report["figures"]:
            found.append("how it compares with another report, whose games are not here")
        return tuple(found)


def verify(
    folder: Path,
    policies: Sequence[str] = (),
    *,
    games: int = SAMPLE,
    seed: int | None = None,
    protocol: Protocol | None = None,
    say: Callable[[str], None] = silent,
) -> Verdict:
    """Check a report.

    Only installed policies and files in the report's own folder are loaded. Attacks are not searched for again.

    Parameters
    ----------
    folder : Path
    policies : sequence of str
        The entry's policies, if they are neither in the folder nor installed by their names.
    games : int
        Of the sample, one of each track at least.
    seed : int, optional
        Of the sample; a fresh one if not given.
    protocol : Protocol, optional
        The current one if not given; of a try, its quick form.
    say : callable, optional
        Takes lines about what is being checked.

    Raises
    ------
    ResultsError
        If a file was changed, figures do not follow from the games, the policies are others, or games come out
        differently.
    """
    check_count(games, "games", 1, 10_000)
    protocol = protocol if protocol is not None else Protocol.read()
    seed = secrets.randbits(64) if seed is None else seed
    say("checking files, figures and policies")
    report, lines = files.read(folder)
    try:
        if files.is_try(report):
            protocol = protocol.quick()
        _check_protocol(report, protocol)
        _check_figures(report, lines, protocol, folder)
        factory = _factory(report, folder, policies, protocol)
        return Verdict(report, _play_sample(report, lines, protocol, factory, games, seed, say), seed)
    except SwarmError:
        raise
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise ResultsError(f"{folder} holds no whole report: {error!r}") from error


def _check_protocol(report: dict[str, Any], protocol: Protocol) -> None:
    told = report["protocol"]
    if told != {"version": protocol.version, "digest": protocol.digest}:
        raise ResultsError(
            f"the report is of protocol {told['version']!r} ({told['digest']!r}), this swarm-pz has "
            f"{protocol.version!r} ({protocol.digest!r}): verify it with the version that made it, "
            f"{report['versions'].get('swarm-pz')}"
        )
    protocol.check()


def _check_figures(report: dict[str, Any], lines: list[Line], protocol: Protocol, folder: Path) -> None:
    numbers = range(len(report["policies"]))
    try:
        Entry(policies=tuple(map(str, numbers)), name=report["name"])
    except ConfigError as error:
        raise ResultsError(f"{folder / files.REPORT} is of no entry: {error}") from error
    if {line.policy for line in lines} != set(numbers) or [one["policy"] for one in report["attacks"]] != [*numbers]:
        raise ResultsError(f"the policies and attacks in {folder / files.REPORT} are not those in {files.GAMES}")
    again = describe(report["name"], report["policies"], report["attacks"], lines, protocol)
    said = {name: value for name, value in report["figures"].items() if name != "improvement"}
    if again["figures"] != said or again["games"] != report["games"] or again["seeds"] != report["seeds"]:
        raise ResultsError(f"the figures in {folder / files.REPORT} do not follow from the games in {files.GAMES}")
    hashes = {"config_hash": protocol.game.hash, "rules_hash": protocol.game.rules_hash}
    if {name: report[name] for name in hashes} != hashes:
        raise ResultsError(f"the hashes in {folder / files.REPORT} are not those of protocol {protocol.version}")
    if _is_of_this_version(report) and files.page_of(folder) != render(report):
        raise ResultsError(f"{folder / files.PAGE} was changed after it was written: it does not show {files.REPORT}")


def _is_of_this_version(report: dict[str, Any]) -> bool:
    return bool(report["versions"].get("swarm-pz") == versions().get("swarm-pz"))


def _factory(report: dict[str, Any], folder: Path, given: Sequence[str], protocol: Protocol) -> PlayerFactory:
    """Return the players, all checked to be those of the report."""
    if given and len(given) != len(report["policies"]):
        raise ResultsError(f"the report is of {len(report['policies'])} policies, got {len(given)}: {', '.join(given)}")
    policies = []
    for number, told in enumerate(report["policies"]):
        place = given[number] if given else _inside(folder, told["kept"], "policies", number)
        place = place if place is not None else _installed(told["name"])
        player = check_flies(place, protocol)
        found = identity_of(place, player)
        if found != told["digest"]:
            raise ResultsError(f"policy {place} is not the report's: expected digest {told['digest']!r}, got {found!r}")
        if told["kind"] != (kind := sort_of(player)):
            raise ResultsError(f"policy {place} is {kind}, the report says {str(told['kind'])[:70]!r}")
        if (cost := report["cost"]["policies"][number]) != cost_of(player):
            raise ResultsError(f"the report says that policy {place} cost {cost}, its card {cost_of(player)}")
        policies.append(place)
    exploiters: list[str] = []
    each = protocol.robust.exploiters_each(len(policies))
    for attack in report["attacks"]:
        if len(attack["learned"]) != each:
            raise ResultsError(f"expected {each} exploiters a policy, got {attack['learned']}")
        for seed, digest in enumerate(attack["learned"]):
            place = _inside(folder, f"exploiters/{len(exploiters)}", "exploiters", len(exploiters))
            player = check_flies(str(place), protocol)
            if (found := identity_of(str(place), player)) != digest:
                raise ResultsError(f"{place} is not the report's exploiter: expected {digest!r}, got {found!r}")
            _check_exploiter(player, seed, protocol, str(place))
            exploiters.append(str(place))
        siege_of(attack["searched"])
    return PlayerFactory(tuple(policies), (), tuple(exploiters))


def _check_exploiter(player: Player, seed: int, protocol: Protocol, place: str) -> None:
    """Check that an exploiter's card says that it was trained as by the protocol."""
    card = getattr(player, "card", None)
    told = card if isinstance(card, dict) else {}
    training = told.get("training", {})
    expected = (protocol.robust.steps, seed)
    found = (training.get("total_steps"), training.get("seed"))
    if found != expected or not told.get("steps", 0) >= protocol.robust.steps:
        raise ResultsError(
            f"{place} was not trained as the protocol says: expected {expected[0]} commands and seed {expected[1]}, "
            f"got {told.get('steps')} of {found[0]} and {found[1]}"
        )


def _installed(name: object) -> str:
    """Return the name of an installed policy; a name in a report must not lead to a folder."""
    if str(name).split(":", 1)[0] not in registered() or Path(str(name)).name != name:
        raise ResultsError(
            f"policy {str(name)[:70]!r} is neither in the report's folder nor installed: name it, or its folder, "
            "before --verify"
        )
    return str(name)


def _inside(folder: Path, told: object, where: str, number: int) -> str | None:
    """Return a folder inside the report; nothing else that a report names is opened."""
    if told is None:
        return None
    place = folder / where / str(number)
    if told != f"{where}/{number}" or place.is_symlink() or place.parent.is_symlink() or not place.is_dir():
        raise ResultsError(f"expected {where}/{number} in {folder}, the report names {str(told)[:70]!r}")
    for path in place.iterdir():
        if path.is_symlink() or path.stat().st_size > MOST_BYTES:
            raise ResultsError(f"{path} must be a file of {MOST_BYTES:,} bytes or fewer, and no link")
    return str(place)


def _play_sample(
    report: dict[str, Any],
    lines: list[Line],
    protocol: Protocol,
    factory: PlayerFactory,
    games: int,
    seed: int,
    say: Callable[[str], None],
) -> str:
    searched = {attack["policy"]: attack["searched"] for attack in report["attacks"]}
    for line in lines:  # figures are right by now, so each exploiter has played its own policy
        if line.track == ROBUST and not line.opponent.startswith(LEARNED) and line.opponent != searched[line.policy]:
            raise ResultsError(f"{line.opponent!r} in {files.GAMES} is no attack that the report names")
    sample = _choose(lines, games, seed)
    again = play_again(sample, protocol, factory, say)
    different = [(old, new) for old, new in zip(sample, again, strict=True) if old != new]
    if not different:
        return f"{len(sample)} games played again are the same games"
    here, there = processor(), str(report["cost"]["processor"])
    same_versions = all(report["versions"].get(name) == version for name, version in versions().items())
    old, new = different[0]
    first = (
        f"game {old.number} of policy {old.policy} against {old.opponent!r} in track {old.track}: the report has "
        f"{old.outcome} after {old.seconds:g} s, here it is {new.outcome} after {new.seconds:g} s"
    )
    if here == there and same_versions:
        raise ResultsError(f"{len(different)} of {len(sample)} games came out differently: {first} (seed {seed})")
    larger = _choose(lines, LARGER * games, seed)
    say(f"games differ, on {there} and here on {here} or with other versions: comparing shares")
    differences = [
        float(again.outcome == "win") - float(line.outcome == "win")
        for line, again in zip(larger, play_again(larger, protocol, factory, say), strict=True)
    ]
    mean = float(np.mean(differences))
    error = max(float(np.std(differences)), 0.5 / len(differences) ** 0.5) / len(differences) ** 0.5
    if abs(mean) > _SURE * error:
        raise ResultsError(
            f"over {len(larger)} games the entry's share of games won differs by {mean:+.3f}, more than chance does "
            f"({_SURE * error:.3f}); for one, {first} (seed {seed})"
        )
    return (
        f"games differ here ({here}, the report was made on {there}, or with other versions), as chaotic games do; "
        f"over {len(larger)} of them the share of games won differs by {mean:+.3f}, no more than chance does"
    )


def _choose(lines: list[Line], count: int, seed: int) -> list[Line]:
    """Return a sample of games, as many of each track."""
    generator = np.random.default_rng(seed)
    tracks = list(dict.fromkeys(line.track for line in lines))
    chosen = []
    for track in tracks:
        rows = [line for line in lines if line.track == track]
        picked = generator.choice(len(rows), size=min(max(count // len(tracks), 1), len(rows)), replace=False)
        chosen += [rows[place] for place in sorted(picked.tolist())]
    return chosen
