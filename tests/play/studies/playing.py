"""Folders of studies as they are when they have run, with real recordings of short games."""

import json
import time

import numpy as np

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play.game import Captured, InForce, LiveGame, TableConfig
from swarm_pz.play.protocol import Timing
from swarm_pz.play.recordings.format import (
    VERSION,
    CapturedLine,
    CommandLine,
    EndLine,
    Header,
    InForceLine,
    PaintedLine,
    RecordedSeat,
    frame_line,
    reason_of_end,
)
from swarm_pz.play.recordings.recorder import Recorder
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.progress import Progress
from tests.play.recordings.test_format import shown

TEXT = """
title = "Two interfaces, tried"
participants = 2
games = 2
seed = 7
consent = "consent.md"
consent_version = "2026-03"
rules = { time_limit = 6.0, drones_per_team = 3, capture = { threshold = 0.5 } }

[practice]
wins = 1
most = 1

[[conditions]]
title = "drawing"

[[conditions]]
title = "late (300 ms)"
command_delay_ms = 300
display_delay_ms = 100
side = "blue"
speed = 2.0
rules = { drones_per_team = [4, 3] }

[[forms]]
name = "sus"

[[forms]]
name = "background"
when = "start"
items = [
    { id = "age", text = "Your age?", kind = "number", least = 18, most = 99 },
    { id = "words", text = "Anything else?", kind = "text", optional = true },
]
"""
ANSWERS = {
    "sus": {f"sus_{place}": 4 if place % 2 else 2 for place in range(1, 11)},
    "background": {"age": 40, "words": '=1+1, "quoted", ünï\n| <b>'},
}


def begin(folder, text=TEXT):
    """Write a study's files as they are kept in its folder, and return the study."""
    (folder / "study").mkdir(parents=True)
    (folder / "study" / "consent.md").write_text("# Will you?")
    (folder / "study" / "study.toml").write_text(text)
    study = Study.read(folder / "study" / "study.toml")
    (folder / "codes.txt").write_text("".join(f"{study.name_of(n)} CODE{n}\n" for n in range(study.participants)))
    return study


def play(path, config, seed, side):
    """Record a game in which both sides command now and then; return how it ended."""
    game, own = LiveGame(config, seed), TEAM_NAMES.index(side)
    seats = [RecordedSeat(kind="policy", policy="uniform"), RecordedSeat(kind="person")]
    header = Header(
        version=VERSION,
        software="test",
        started="2026-01-01T00:00:00.000+00:00",
        table=config.to_dict(),
        config_hash=config.hash,
        seed=seed,
        rules_hash=config.game.rules_hash,
        red=seats[own == 0],
        blue=seats[own == 1],
    )
    path.parent.mkdir(exist_ok=True)
    recorder = Recorder(path, header)
    recorder.write(frame_line(shown(game), 0))
    while not game.over:
        ms = 1000.0 * game.tick / 30 / config.speed
        if game.tick % 60 == 0:
            for team in range(2):
                density = np.full((10, 10), 0.5 * (team != own))
                density[3, (game.tick // 60 + 7) % 10] = 1.0
                command = game.submit(team, game.tick // 60, density)
                timing = Timing(input_ms=5.0, sent_ms=6.0, round_trip_ms=2.0, drawing_ms=500.0)
                recorder.write(
                    CommandLine(
                        team=team,
                        number=command.number,
                        density=command.values.tolist(),
                        received_ms=ms,
                        timing=timing if team == own else None,
                        tick=game.tick,
                    )
                )
        for event in game.advance():
            if isinstance(event, InForce):
                number, team = event.command.number, event.command.team
                recorder.write(InForceLine(team=team, number=number, tick=event.tick, ms=ms + 20.0))
                if team == own:
                    recorder.write(PaintedLine(team=team, number=number, ms=ms + 48.0))
            elif isinstance(event, Captured):
                recorder.write(CapturedLine(tick=event.tick, drone=event.drone, team=event.team))
        if game.tick % 3 == 0 or game.over:
            recorder.write(frame_line(shown(game), game.tick))
    ended_by = reason_of_end(game.outcome, away=False)
    recorder.write(EndLine(outcome=game.outcome, tick=game.tick, sizes=game.sizes, ms=ms, ended_by=ended_by))
    recorder.close()
    while not recorder.written:
        time.sleep(0.001)
    return game


def run(folder, study, number, until=None):
    """Let a participant do all steps of a study, or all up to one, and return the participant's name."""
    own = study.name_of(number)
    progress = Progress(study, folder / "participants" / f"{own}.jsonl", number)
    while (step := progress.next) is not None and step.id != until:
        told = {}
        if step.form is not None:
            told["answers"] = ANSWERS[step.form.name]
        elif step.kind in ("practice", "game"):
            condition = step.condition
            seed = study.seed_of(step.game, practice=step.kind == "practice")
            name = f"games/{own}.{step.id}.jsonl"
            config = TableConfig(game=condition.game(study.rules), speed=condition.speed)
            game = play(folder / name, config, seed, condition.side)
            told = {
                "condition": condition.title,
                "system": condition.system,
                "opponent": "uniform",
                "side": condition.side,
                "seed": seed,
                "outcome": "draw" if game.outcome == "draw" else "win" if game.outcome == condition.side else "loss",
                "won": game.outcome == condition.side,
                "seconds": game.tick / 30,
                "recording": name,
                "delays": {"command": {"asked_ms": condition.command_delay_ms, "got_ms": 301.5, "count": 3}},
            }
        progress.finish(step, **told)
    return own


def simulate(folder, study, gain, seed):
    """Write the progress of participants who win more often in the first condition, by `gain`; without recordings."""
    chance = np.random.default_rng(seed)
    first = study.conditions[0].title
    (folder / "participants").mkdir(exist_ok=True)
    for number in range(study.participants):
        skill = chance.uniform(0.2, 0.6)
        lines = [{"type": "participant", "number": number, "study": study.title, "seed": study.seed}]
        for block, condition in enumerate(study.order_of(number), 1):
            for game in range(1, study.games + 1):
                won = bool(chance.random() < skill + gain * (condition.title == first))
                seconds = float(np.clip(chance.exponential(60.0 if won else 200.0), 1.0, 300.0))
                outcome = "draw" if seconds == 300.0 else "win" if won else "loss"
                lines.append({"step": f"block{block}.game{game}", "outcome": outcome, "seconds": seconds})
        path = folder / "participants" / f"{study.name_of(number)}.jsonl"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
