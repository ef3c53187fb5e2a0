"""A study's plan, and a folder in which participants have done part of it, with recordings of short games."""

import contextlib

from swarm_pz.config import TEAM_NAMES
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import Delay, SeatDelays
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.folder import StudyFolder
from tests.play.recordings.games import record

PLAIN = """
title = "Two interfaces"
participants = 4
games = 2
seed = 7
consent = "consent.md"
rules = { time_limit = 6.0, drones_per_team = 3, capture = { threshold = 0.5 } }

[practice]
wins = 1
most = 3

[[conditions]]
title = "drawing"

[[conditions]]
title = "late"
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


def written(folder, text=PLAIN):
    """Write a study's file and its text, and return the study."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "consent.md").write_text("# Will you?")
    (folder / "study.toml").write_text(text)
    return Study.read(folder / "study.toml")


def begun(folder, text=PLAIN):
    """Begin a study in the folder `data`, or go on with it."""
    written(folder / "plan", text)
    return contextlib.closing(StudyFolder.begin(folder / "plan" / "study.toml", folder / "data"))


def answers_to(step):
    """Return a participant's answers in a step that is no game."""
    return {"answers": ANSWERS[step.form.name]} if step.form is not None else {}


def walk(folder, number, until=None, ticks=30, outcome="red"):
    """Let a participant do all steps before `until`, and return the next one; games have `ticks` and an outcome."""
    progress = folder.progress(number)
    while (step := progress.next) is not None and step.id != until:
        if not step.is_game:
            progress.finish(step, **answers_to(step))
            continue
        config = TableConfig(game=step.played.game(folder.study.rules), speed=step.played.speed)
        own, path = TEAM_NAMES.index(folder.side_of(number, step)), folder.recording(number, step)
        command = Delay(step.played.command_delay_ms, got_ms=301.5, count=3)
        shown = [Delay(step.played.display_delay_ms, got_ms=None, count=team) for team in range(2)]
        delays = tuple(SeatDelays(command, one) for one in shown)
        if not path.exists():
            seed = folder.seed_of(step)
            record(path, ticks, seed, outcome, config=config, own=own, both=True, player="uniform", delays=delays)
        folder.settle(number)
    return step
