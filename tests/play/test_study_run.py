"""The example study, run by four scripted participants while the power fails three times."""

import itertools
import shutil
import time
from collections import Counter
from pathlib import Path

import numpy as np

from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.studies.export import export
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import steps_of
from tests.play.studying import PATIENCE_S, Participant, StudyTable, walk_all

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "study"
SHORT = {  # so that nothing takes long
    "participants = 8": "participants = 4",
    "games = 4 ": "games = 2 ",
    "break_s = 60.0": "break_s = 0.1",
    "drones_per_team = 10": "drones_per_team = 3",
    "time_limit = 120.0": "time_limit = 1.0",
    "wins = 1\nmost = 3": "wins = 1\nmost = 1",
    'opponent = "ring"': 'opponent = "ring"\nspeed = 2.0',
}


def shortened(folder):
    """Copy the example, of two interfaces in balanced order, to a folder, with short games; return its file."""
    shutil.copytree(EXAMPLE, folder)
    text = (folder / "study.toml").read_text()
    for before, after in SHORT.items():
        assert before in text
        text = text.replace(before, after)
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


def test_a_study_that_is_killed_three_times_ends_with_exactly_what_was_planned(tmp_path):
    with StudyTable(shortened(tmp_path / "plan"), tmp_path / "data") as table:
        participants = [Participant(table, code) for code in table.kept.codes]
        walk_all(participants, lambda: fail(table, tmp_path / "data"))
        assert "Traceback" not in table.end()

    folder = StudyFolder(tmp_path / "data")
    study, recordings, seeds = folder.study, set(), Counter()
    for number, one in enumerate(participants):
        done = list(folder.progress(number).done.values())
        assert [line["step"] for line in done] == [
            step.id for step in steps_of(study, number, folder.progress(number).done)
        ]
        assert [line["at"] for line in done] == sorted(line["at"] for line in done)
        assert sum("practice" in line["step"] for line in done) == 2
        games = [line for line in done if ".game" in line["step"]]
        assert [line["condition"] for line in games] == [
            condition.title for condition in study.order_of(number) for _ in range(study.games)
        ]
        for line in done:
            if "recording" in line:
                recordings.add(line["recording"])
                check_game(folder, line)
        seeds.update((line["condition"], line["seed"]) for line in games)
        blocks = [line["scores"] for line in done if line["step"].startswith("block") and ".form." in line["step"]]
        assert blocks == [{"tlx_raw": 0.0, "tlx": 0.0}, {"sus": 50.0}] * 2
        assert set(one.done) <= {line["step"] for line in done}
    assert Counter(study.order_of(number)[0].title for number in range(4)) == {"drawing": 2, "attractors": 2}
    titles = [condition.title for condition in study.conditions]
    assert seeds == dict.fromkeys(itertools.product(titles, map(study.seed_of, range(study.games))), 4)
    assert {f"games/{path.name}" for path in (tmp_path / "data" / "games").glob("*.jsonl")} == recordings
    published = export(tmp_path / "data", tmp_path / "out").data
    assert all("broken off" in fault for fault in published.faults), "the power may go before a file's first line"
    assert len(published.games) == len(recordings)
    assert [one.finished for one in published.participants] == [True] * 4


def fail(table, folder):
    """Kill a study three times, in the middle of games, and start it again."""
    chance = np.random.default_rng(21)
    for least in (12, 28, 44):  # of some 65 steps, most of them games; before the first one nobody plays
        reached = least + chance.integers(8)
        end = time.monotonic() + PATIENCE_S
        while not is_in_play(folder, reached) and time.monotonic() < end:
            time.sleep(0.02)
        time.sleep(chance.uniform(0.0, 0.5))
        table.kill()
        table.start()


def is_in_play(folder, reached):
    """Return whether so many steps are done by all together, and there is a game that is not written down yet."""
    kept = "".join(path.read_text() for path in (folder / "participants").glob("*.jsonl"))
    return kept.count('"step"') >= reached and any(path.name not in kept for path in (folder / "games").glob("*.jsonl"))


def check_game(folder, line):
    """Check that a line says what stands in its recording, and that this is a whole game of its condition."""
    study, recording = folder.study, Recording.read(folder.path / line["recording"])
    condition = next(one for one in study.conditions if one.title == line["condition"])
    assert recording.header.seed == line["seed"] and recording.config.game == condition.game(study.rules)
    assert recording.config.speed == 2.0
    opponent = study.practice.opponent if ".practice" in line["step"] else condition.opponent
    assert (recording.header.red.kind, recording.header.blue.policy) == ("person", opponent)
    assert recording.header.red.label == ""
    outcome = {"win": "red", "loss": "blue", "draw": "draw"}[line["outcome"]]
    assert recording.end.outcome == outcome and line["won"] == (line["outcome"] == "win")
    assert line["seconds"] == recording.end.tick / 30
    assert len([one for one in recording.of(CommandLine) if one.team == 0]) <= 1
