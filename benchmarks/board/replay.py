"""One game of an entry, small enough for a page: where the drones were five times a second, and who took which.

It is always the same one, so that nobody chooses and entries can be compared: the first game of the first policy
against the last opponent of the field that it meets and that is another player.
"""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.standard.games import Line, PlayerFactory, config_of, entry_name, with_trial
from swarm_pz.standard.protocol import Protocol

FILE = "replay.json"
FORMAT = 1
EVERY = 2
"""Control periods between two moments."""
_STEPS = 65535
"""A side of the arena in the numbers of a file, of 16 bits."""


def choose(lines: Sequence[Line], report: dict[str, Any], protocol: Protocol) -> Line:
    """Return the game of a report that is shown."""
    track = next(track for track in protocol.tracks if track.name == "field")
    met = {line.opponent for line in lines if line[:2] == (track.name, 0)}
    met = met - {one["name"] for one in report["policies"]} or met
    opponent = [trial.name for trial in track.trials if trial.name in met][-1]
    for line in lines:
        if line[:3] == (track.name, 0, opponent) and not line.forfeit:
            return line
    raise ResultsError(f"shows no game: all those against {opponent} were forfeited")


def record(folder: Path, report: dict[str, Any], line: Line, protocol: Protocol) -> tuple[dict[str, Any], str]:
    """Play a game of an entry, and return it as its file holds it, and the fingerprint that it has here."""
    track = next(track for track in protocol.tracks if track.name == line.track)
    trial = next(trial for trial in track.trials if trial.name == line.opponent)
    policies = tuple(
        str(folder / one["kept"]) if one["kept"] is not None else str(one["name"]) for one in report["policies"]
    )
    factory = PlayerFactory(policies, track.trials)
    rules = with_trial(config_of(track, protocol), trial).game
    players = factory(entry_name(line.policy), rules), factory(line.opponent, rules)
    moments: list[np.ndarray] = []
    teams: list[np.ndarray] = []
    count = 0

    def look(game: Rollout) -> None:
        nonlocal count
        if count % EVERY == 0:
            keep(game)
        count += 1

    def keep(game: Rollout) -> None:
        moments.append(np.round(game.simulator.positions[0].clip(0.0, 1.0) * _STEPS).astype("<u2"))
        teams.append(game.simulator.teams[0].astype(int))

    with closing(Rollout(*players, [line.number], seed=track.seed, config=rules)) as game:
        look(game)
        game.play(after_control_period=look)
        if (count - 1) % EVERY:
            keep(game)
        fingerprint = hashlib.sha256(game.games()[0].fingerprint).hexdigest()[:16]
    shown = {
        "format": FORMAT,
        "track": line.track,
        "policy": line.policy,
        "opponent": line.opponent,
        "number": line.number,
        "every_s": round(EVERY * CONTROL_PERIOD, 6),
        "begin": teams[0].tolist(),
        "captures": [
            [moment, int(drone), int(after[drone])]
            for moment, (before, after) in enumerate(itertools.pairwise(teams), 1)
            for drone in np.flatnonzero(before != after)
        ],
        "positions": base64.b64encode(np.stack(moments).tobytes()).decode(),
    }
    return shown, fingerprint


def encode(shown: dict[str, Any]) -> str:
    """Return a game as its file holds it."""
    return json.dumps(shown, indent=1) + "\n"


def line_of_game(shown: dict[str, Any], lines: Sequence[Line]) -> Line:
    """Return the line of the game that is shown."""
    key = tuple(shown[name] for name in ("track", "policy", "opponent", "number"))
    return next(line for line in lines if line[:4] == key)


def command_of(folder: str, line: Line, report: dict[str, Any], protocol: Protocol) -> str:
    """Return the command line that films the game, from the root of a clone."""
    kept = report["policies"][line.policy]["kept"]
    policy = f"docs/board/entries/{folder}/{kept}" if kept is not None else report["policies"][line.policy]["name"]
    seed = next(track.seed for track in protocol.tracks if track.name == line.track)
    return (
        f"swarm-pz render {policy} {line.opponent} --seed {seed} --pair {line.number // 2} "
        f"--side {TEAM_NAMES[line.number % 2]} --out game.mp4"
    )


def read(folder: Path, protocol: Protocol, report: dict[str, Any], lines: Sequence[Line]) -> dict[str, Any]:
    """Read the game of an entry, and check that it is the one to show, and ends as the report says."""
    path = folder / FILE
    try:
        shown = json.loads(path.read_bytes())
        expected = choose(lines, report, protocol)
        _check(shown, expected, protocol)
    except ResultsError as error:
        raise ResultsError(f"{path} {error}") from error
    except (AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise ResultsError(f"{path} is corrupt: {error!r}") from error
    return dict(shown)


def _check(shown: dict[str, Any], line: Line, protocol: Protocol) -> None:
    fields = {"format": FORMAT, "track": line.track, "policy": line.policy, "opponent": line.opponent}
    fields |= {"number": line.number, "every_s": round(EVERY * CONTROL_PERIOD, 6)}
    for name, value in fields.items():
        if shown[name] != value or type(shown[name]) is not type(value):
            raise ResultsError(f"shows another game: expected {name} {value!r}, got {str(shown[name])[:70]!r}")
    if set(shown) != set(fields) | {"begin", "captures", "positions"}:
        raise ResultsError(f"has other fields: {sorted(shown)}"[:300])
    drones = 2 * protocol.game.drones_per_team
    positions = np.frombuffer(base64.b64decode(shown["positions"], validate=True), "<u2").reshape(-1, drones, 2)
    teams = [*shown["begin"]]
    if teams != [0] * (drones // 2) + [1] * (drones // 2):
        raise ResultsError("does not begin with two teams of the same size")
    last = 0
    for moment, drone, team in shown["captures"]:
        whole = all(type(value) is int for value in (moment, drone, team))
        if not (whole and last <= moment < len(positions) and 0 <= drone < drones and team in (0, 1)):
            raise ResultsError(f"holds a capture that cannot be: {[moment, drone, team]}"[:200])
        teams[drone], last = team, moment
    share = teams.count(line.number % 2) / drones
    length = (len(positions) - 1) * EVERY * CONTROL_PERIOD
    if share != line.share or not abs(length - line.seconds) < EVERY * CONTROL_PERIOD:
        raise ResultsError(
            f"does not end as the report says: expected {line.share:g} of the drones after {line.seconds:g} s, got "
            f"{share:g} after {length:.1f} s"
        )
