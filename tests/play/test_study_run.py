"""The example study, run by scripted participants while the server is killed in the middle of a game."""

import itertools
import shutil
import time
from collections import Counter
from pathlib import Path

from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import outcome_of
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import steps_of
from swarm_pz.play.studies.reading import read_study
from tests.play.studying import PATIENCE_S, Participant, StudyTable, walk_all

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "study"
SHORT = {  # so that nothing takes long
    "participants = 8": 'order = [["drawing", "attractors"]]\nparticipants = 2',
    "games = 4 ": "games = 1 ",
    "break_s = 60.0": "break_s = 0.1",
    "drones_per_team = 10": "drones_per_team = 3",
    "time_limit = 120.0": "time_limit = 1.0",
    "wins = 1\n": "wins = 0\n",
    'opponent = "ring"': 'opponent = "person"\nspeed = 2.0',  # no process of a policy has to start
}


def test_a_study_that_is_killed_ends_with_exactly_what_was_planned(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path / "plan")
    text = (tmp_path / "plan" / "study.toml").read_text()
    for before, after in SHORT.items():
        assert before in text
        text = text.replace(before, after)
    (tmp_path / "plan" / "study.toml").write_text(text)
    with StudyTable(tmp_path / "plan" / "study.toml", tmp_path / "data") as table:
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
        games = [line for line in done if "recording" in line]
        assert [line["condition"] for line in games] == [condition.title for condition in study.order_of(number)]
        for line in games:
            recording = Recording.read(folder.path / line["recording"])
            assert line["outcome"] == outcome_of(recording.end, line["side"])
            assert recording.header.seed == line["seed"] and line["seconds"] == recording.end.tick / 30
        recordings |= {line["recording"] for line in games}
        seeds.update((line["condition"], line["seed"]) for line in games)
        assert set(one.done) <= {line["step"] for line in done}, "what was confirmed is kept"
    assert seeds == dict.fromkeys(itertools.product(("drawing", "attractors"), [study.seed_of(0)]), 2)
    assert {f"games/{path.name}" for path in (tmp_path / "data" / "games").glob("*.jsonl")} == recordings
    published = read_study(tmp_path / "data")
    assert all("broken off" in fault for fault in published.faults), "the power may go before a file's first line"
    assert len(published.games) == 2 * len(recordings)
    assert [one.finished for one in published.participants] == [True] * 2


def fail(table, folder):
    """Kill a study in the middle of a game, and start it again."""
    end = time.monotonic() + PATIENCE_S
    while not is_in_play(folder) and time.monotonic() < end:
        time.sleep(0.02)
    table.kill()
    table.start()


def is_in_play(folder):
    """Return true if a recorded game is not in any participant's file yet."""
    kept = "".join(path.read_text() for path in (folder / "participants").glob("*.jsonl"))
    return any(path.name not in kept for path in (folder / "games").glob("*.jsonl"))
