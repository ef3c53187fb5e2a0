"""Folders of studies as they are when they have run, with real recordings of short games."""

import json

import numpy as np

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play.game import TableConfig
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.progress import Progress
from tests.play.recordings.test_format import record

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


def run(folder, study, number, until=None):
    """Let a participant do all steps of a study, or all up to one."""
    own = study.name_of(number)
    progress = Progress(study, folder / "participants" / f"{own}.jsonl", number)
    while (step := progress.next) is not None and step.id != until:
        told = {}
        if step.form is not None:
            told["answers"] = ANSWERS[step.form.name]
        elif step.is_game:
            side, name = step.played.side, f"games/{own}.{step.id}.jsonl"
            config = TableConfig(game=step.played.game(study.rules), speed=step.played.speed)
            seed = study.seed_of(step.game, practice=step.kind == "practice")
            team = TEAM_NAMES.index(side)
            game = record(folder / name, 1000, seed, player="uniform", config=config, own=team, both=True)
            told = {
                "condition": step.played.title,
                "system": step.played.system,
                "opponent": "uniform",
                "side": side,
                "seed": seed,
                "outcome": "draw" if game.outcome == "draw" else "win" if game.outcome == side else "loss",
                "won": game.outcome == side,
                "seconds": game.tick / 30,
                "recording": name,
                "delays": {"command": {"asked_ms": step.played.command_delay_ms, "got_ms": 301.5, "count": 3}},
            }
        progress.finish(step, **told)


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
