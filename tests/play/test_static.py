"""The page's modules in Node: `static/*.test.js`, with fixtures from the server's code.

The server's code also decodes the messages that the modules send in those tests.
"""

import base64
import gzip
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import swarm_pz.play
from benchmarks.page_levels import IDEAS, drawing
from swarm_pz.cli.play import site_files
from swarm_pz.config import GRID_CELLS, CaptureConfig, GameConfig
from swarm_pz.kernels.observation import CAPTURES_FROM
from swarm_pz.play import protocol
from swarm_pz.play.forms import commands_of, read_form
from swarm_pz.play.frames import decode_frame, decode_target, encode_frame, encode_target
from swarm_pz.play.game import TableConfig
from swarm_pz.play.opponents import LEARNED
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.server.views import capture_fields, target_picture
from swarm_pz.play.site import files_of
from swarm_pz.play.strokes import MOST_POINTS, NARROWEST, WIDEST, Stroke, density_of
from tests.play.recordings.games import record
from tests.play.test_frames import GOLDEN, GOLDEN_HIDDEN, GOLDEN_TARGET, random_frame

STATIC = Path(swarm_pz.play.__file__).parent / "static"
TESTS = Path(__file__).parent / "static"
ENGINE = "engine.test.js"
"""Run by `test_engine`, on other games."""
SYSTEMS = ("ergodic", "direct", "flocking", "formation", "leader_follower", "potential_field")
GAMES = {name: GameConfig(drones_per_team=2, controllers=name) for name in SYSTEMS}


def as_json(message):
    """Return a message as the page reads it."""
    return json.loads(protocol.encode(message))


def numbers(values):
    """Return numbers for JSON, with None for NaN."""
    return [None if np.isnan(value) else float(value) for value in np.ravel(values)]


def frames():
    """Yield encoded frames, with their contents as the server decodes them."""
    made = [random_frame(n, n, keyframe=n != 7, with_fields=n != 7) for n in (0, 7, 8, 400)]
    for data in (GOLDEN, GOLDEN_HIDDEN, *map(encode_frame, made)):
        frame = decode_frame(data)
        yield {
            "bytes": base64.b64encode(data).decode(),
            "sequence": frame.sequence,
            "tick": frame.tick,
            "serverMs": frame.server_ms,
            "teams": frame.teams.tolist(),
            "positions": numbers(frame.positions),
            "velocities": numbers(frame.velocities),
            "fields": None if frame.fields is None else [field.ravel().tolist() for field in frame.fields],
        }


def targets():
    """Yield encoded targets, with their contents as the server decodes them."""
    ring = np.hypot(*np.meshgrid(np.linspace(-1, 1, 50), np.linspace(-1, 1, 50)))
    for data in (GOLDEN_TARGET, encode_target(0, 4, (255 * np.clip(1 - ring, 0, 1)).astype(np.uint8))):
        target = decode_target(data)
        yield {
            "bytes": base64.b64encode(data).decode(),
            "team": target.team,
            "number": target.number,
            "picture": target.picture.ravel().tolist(),
        }


def seated(name):
    """Return the server's message to a client who takes a seat that a control system flies."""
    (system, _), game = GAMES[name].team_systems, GAMES[name]
    return as_json(protocol.Seated(room="ABCD", seat="red", token="0" * 32, commands=commands_of(system, game)))


def room():
    """Return the server's message about a room where a game runs."""
    person = protocol.SeatState(kind="person", connected=True, ready=True)
    policy = protocol.SeatState(kind="policy", name="blind_ring", connected=True, ready=True, policy_state="loaded")
    state = protocol.RoomState("ABCD", "playing", protocol.Settings(), person, policy, [(10, 10)])
    return as_json(state)


def recorded(folder, name, config, within, *, has_fields):
    """Return a recorded game's text, moments of it from the simulator, and the tolerance of positions."""
    path = folder / f"{name}.jsonl"
    record(path, ticks=150, config=config, both=True, every=90)
    playback, moments = Playback(Recording.read(path)), []
    for tick in (0, 1, 30, 31, 100, 149, 150):
        playback.seek(tick)
        simulator = playback.game.simulator
        pictures = [target_picture(simulator.games.coefficients[0, team]).ravel().tolist() for team in (0, 1)]
        moments.append(
            {
                "tick": tick,
                "positions": numbers(simulator.positions[0]),
                "teams": simulator.teams[0].tolist(),
                "fields": [field.ravel().tolist() for field in capture_fields(simulator)] if has_fields else None,
                "pictures": pictures if has_fields else None,
            }
        )
    return {"text": path.read_text(), "moments": moments, "within": within}


@pytest.fixture(scope="module")
def fixtures(tmp_path_factory):
    """Give data from the server's code for tests of the page's modules."""
    constants = {
        "cells": GRID_CELLS,
        "captures": CAPTURES_FROM,
        "subprotocol": protocol.SUBPROTOCOL,
        "points": MOST_POINTS,
        "widths": [NARROWEST, WIDEST],
    }
    folder, default = tmp_path_factory.mktemp("recorded"), GameConfig(drones_per_team=12)
    other = default.replace(controllers="flocking", capture=CaptureConfig(threshold=0.5))
    return constants | {
        "frames": list(frames()),
        "targets": list(targets()),
        "seats": {name: seated(name) for name in SYSTEMS},
        "factors": as_json(protocol.SeatFactors(["opponents", "trails"], 10, "blind_ring", 0.5)),
        "room": room(),
        "recorded": {
            "default": recorded(folder, "default", TableConfig(game=default), 2e-5, has_fields=True),
            "other rules": recorded(folder, "other", TableConfig(game=other), 2e-2, has_fields=False),
        },
        "ideas": {name: drawing(idea, 1, np.array([0.3, 0.6])).tolist() for name, idea in IDEAS.items()},
        "told": json.loads(site_files()["static/engine/table.json"]),
    }


@pytest.mark.parametrize("name", sorted({path.name for path in TESTS.glob("*.test.js")} - {ENGINE}))
def test_in_node(name, node, fixtures, tmp_path):
    """The module tests pass, and the server decodes all messages that the modules send."""
    (tmp_path / "fixtures.json").write_text(json.dumps(fixtures))
    ran = subprocess.run(  # noqa: S603
        [node, "--test-reporter=spec", str(TESTS / name)],
        env=os.environ | {"SWARM_PZ_FIXTURES": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    requests = tmp_path / "said.jsonl"
    for line in requests.read_text().splitlines() if requests.exists() else ():
        flown, text = line.split(" ", 1)
        message = protocol.decode_client(text)
        if isinstance(message, protocol.CommandMessage) and message.command is not None:
            (system, _), game = GAMES[flown].team_systems, GAMES[flown]
            assert np.isfinite(read_form(message.command, system, game, "command")).all()
        if isinstance(message, protocol.CommandMessage) and message.strokes is not None:
            strokes = [Stroke(brush=one.brush, width=one.width, points=tuple(one.points)) for one in message.strokes]
            assert np.isfinite(density_of(strokes, GRID_CELLS)).all()
    replies = tmp_path / "told.jsonl"
    for line in replies.read_text().splitlines() if replies.exists() else ():
        protocol.decode_server(line)
    for path in tmp_path.glob("*Z-*.jsonl"):
        result = Playback(Recording.read(path)).verify()
        assert result.verified and result.in_page, (path.name, result)


def needed(name, files, found=()):
    """Return the paths of a module and of all modules that it imports statically."""
    if name in found:
        return found
    found = (*found, name)
    for other in re.findall(r'^import .*"(\.{1,2}/[\w./]+)";$', files[name].decode(), re.MULTILINE):
        found = needed(os.path.normpath(Path(name).parent / other), files, found)
    return found


def test_the_page_is_light():
    """Files before a first game stay small, from a server (compressed) and without one (as they are)."""
    files = {f"static/{path.name}": path.read_bytes() for path in STATIC.iterdir() if path.is_file()}
    first = {"static/index.html", "static/icon.svg", "static/style.css", *needed("static/main.js", files)}
    assert sum(len(gzip.compress(files[name])) for name in first) < 60_000
    site, first = site_files(), {"index.html", "static/icon.svg", "static/style.css", "static/engine/table.json"}
    for name in ("static/main.js", "static/engine/table.js", "static/engine/worker.js"):
        first |= {*needed(name, site)}
    assert sum(len(site[name]) for name in first) < 200_000


def test_a_site_is_kept_anew_with_any_other_file_and_asks_nobody_else(tmp_path):
    files, zoo = site_files("https://lab.example/a&b/"), Path(__file__).parents[2] / "policies" / "zoo"
    assert b"""content="default-src 'none';""" in files["index.html"]
    assert b'property="og:image" content="https://lab.example/a&amp;b/static/picture.png"' in files["index.html"]
    for name in LEARNED:
        weights = (zoo / name / "policy.safetensors").read_bytes()
        assert files[f"static/engine/{name}.safetensors"] == weights

    def kept(weights):
        (tmp_path / "weights").write_bytes(weights)
        made = files_of({}, {}, {"hunter": tmp_path / "weights"})
        version, names = re.search(r'VERSION = "(\w+)", FILES = (.*);', made["sw.js"].decode()).groups()
        assert set(json.loads(names)) == set(made) - {"sw.js", "index.html", "static/picture.png"} | {"./"}
        return version

    assert kept(b"1") == kept(b"1") != kept(b"2")


DAY, NIGHT = (
    dict(re.findall(r"--([\w-]+): (#\w{6})", colours))
    for colours in re.findall(r":root {(.*?)}", (STATIC / "style.css").read_text(), re.DOTALL)
)


@pytest.mark.parametrize("sight", ["", "protan", "deutan", "tritan"])
@pytest.mark.parametrize("look", [DAY, NIGHT], ids=["day", "night"])
def test_colours_differ_for_everybody(look, sight):
    """Nobody mistakes a drone for the ground, or for one of the other side."""
    from coloraide import Color  # takes a second, which other test processes need not spend

    def seen(name):
        colour = Color(look[name])
        return colour.filter(sight) if sight else colour

    pairs = [("red", "blue")]
    pairs += [(drone, ground) for drone in ("red", "blue") for ground in ("ground", "red-ground", "blue-ground")]
    for one, other in pairs:
        assert seen(one).delta_e(seen(other), method="2000") >= 20, (one, other)
    for ink in ("asked", "away", "ink", "line", "mark"):  # painted; axe checks only text
        assert seen(ink).contrast(seen("ground")) >= 3, ink
    for text in () if sight else ("ink", "dim", "asked", "away"):
        for below in ("ground", "panel", *(["note"] if text == "ink" else [])):
            assert seen(text).contrast(seen(below)) >= 4.5, (text, below)
