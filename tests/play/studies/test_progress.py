"""A participant's way through a study, over reloads, crashes and power cuts."""

import json
import os

import numpy as np
import pytest

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play.studies.progress import Progress
from tests.play.studies.test_design import PLAIN, written

SUS = {f"sus_{place}": 3 for place in range(1, 11)}


def told(step, won=False):
    """Return what a participant without opinions tells in a step."""
    if step.form is not None:
        return {"answers": SUS if step.form.name == "sus" else {"age": 40}}
    return {"recording": f"{step.id}.jsonl", "won": won or step.game == 1} if step.is_game else {}


def walk(progress):
    """Do all that is left; return the steps' names."""
    done = []
    while (step := progress.next) is not None:
        progress.finish(step, **told(step))
        done.append(step.id)
    return done


BLOCK = ("practice1", "practice2", "game1", "game2", "form.sus")


def test_a_participant_does_everything_in_turn(tmp_path):
    progress = Progress(written(tmp_path), tmp_path / "p.jsonl", 0)
    planned = len(progress.steps)
    steps = [f"block{block}.{step}" for block in (1, 2) for step in BLOCK]
    assert walk(progress) == ["consent", "start.form.background", *steps]
    again = Progress(progress.study, tmp_path / "p.jsonl", 0)
    assert again.next is None and len(again.steps) == len(again.done) == planned + 2, (
        "a second game of practice a block"
    )
    assert again.done["block1.form.sus"]["scores"] == {"sus": 50.0}


def test_texts_breaks_and_forms_come_where_they_belong(tmp_path):
    plan = PLAIN.replace("seed = 7", 'seed = 7\nbreak_s = 30.0\nwelcome = "consent.md"').replace("wins = 1", "wins = 0")
    plan = plan.replace('title = "late"', 'title = "late"\ntext = "consent.md"')
    plan += '[[forms]]\nname = "after"\nwhen = "end"\nitems = [{ id = "age", text = "And now?", most = 99 }]\n'
    assert walk(Progress(written(tmp_path, plan), tmp_path / "p.jsonl", 0)) == [
        "consent",
        "start.form.background",
        "welcome",
        *("block1.game1", "block1.game2", "block1.form.sus"),
        *("block2.break", "block2.text", "block2.game1", "block2.game2", "block2.form.sus"),
        "end.form.after",
    ]


@pytest.mark.parametrize(("is_won", "games"), [(True, 1), (False, 3)])
def test_practice_ends_when_it_is_won_or_has_been_enough(is_won, games, tmp_path):
    progress = Progress(written(tmp_path), tmp_path / "p.jsonl", 0)
    played = []
    while (step := progress.next).kind != "game":
        progress.finish(step, **told(step) | {"won": is_won})
        played.append(step.kind)
    assert played.count("practice") == games


def test_whatever_ends_the_program_nothing_is_asked_twice_and_nothing_is_lost(tmp_path):
    study = written(tmp_path)
    whole = walk(Progress(study, tmp_path / "whole.jsonl", 1))
    path = tmp_path / "torn.jsonl"
    asked, chance = [], np.random.default_rng(0)
    while True:
        progress = Progress(study, path, 1)
        for _ in range(chance.integers(3)):
            if (step := progress.next) is not None:
                progress.finish(step, **told(step))
                asked.append(step.id)
        if progress.next is None:
            break
        with path.open("ab") as file:  # the power goes while a line is written
            file.write(json.dumps({"step": progress.next.id}).encode()[: chance.integers(8)])
    assert asked == whole
    lines = path.read_bytes()
    for size in range(0, len(lines), 7):
        path.write_bytes(lines[:size])
        progress = Progress(study, path, 1)
        assert len(progress.done) == max(lines[:size].count(b"\n") - 1, 0)
        assert lines.startswith(path.read_bytes()) and path.read_bytes().endswith(b"\n")


def test_a_step_out_of_turn_or_with_wrong_answers_changes_nothing(tmp_path):
    progress = Progress(written(tmp_path), tmp_path / "p.jsonl", 0)
    consent, later = progress.steps[:2]
    with pytest.raises(ConfigError, match=r"consent, got start\.form"):
        progress.finish(later, answers={"age": 40})
    progress.finish(consent)
    with pytest.raises(ConfigError, match="next step is start"):
        progress.finish(consent)
    before = (tmp_path / "p.jsonl").read_bytes()
    with pytest.raises(ConfigError, match="age must"):
        progress.finish(later, answers={"age": 7})
    assert (tmp_path / "p.jsonl").read_bytes() == before and progress.next == later
    read = iter(progress.done.items())  # by another thread, which comes no further for now
    progress.finish(later, answers={"age": 40})
    assert [step for step, _ in read] == ["consent"] and len(progress.done) == 2


@pytest.mark.parametrize("change", [{"number": 1}, {"study": "another"}, {"seed": 8}])
def test_a_file_of_another_study_or_participant_is_refused(change, tmp_path):
    study, path = written(tmp_path), tmp_path / "p.jsonl"
    Progress(study, path, 0)
    path.write_text(json.dumps(json.loads(path.read_text()) | change) + "\n")
    with pytest.raises(RecordingError, match="another study or participant"):
        Progress(study, path, 0)


@pytest.mark.parametrize(
    "line",
    [
        "{",
        "[]",
        '{"at": 1}',
        '{"step": ["consent"]}',
        '{"step": "consent", "at": "now"}',
        '{"step": "consent", "at": NaN}',
        '{"step": "consent", "at": 1e400}',
        '{"step": "consent", "at": 1' + "0" * 400 + "}",
        '{"step": "consent", "answers": []}',
        '{"step": "consent", "answers": {"hand": {}}}',
        '{"step": "consent", "answers": {"hand": "\\ud800"}}',
        '{"step": "consent", "scores": {"sus": "all"}}',
        '{"step": "block1.game1", "side": "green"}',
        '{"step": "block1.game1", "outcome": "triumph"}',
        '{"step": "block1.game1", "seconds": -1}',
        '{"step": "block1.game1", "delays": []}',
        '{"step": "consent", "more": ' + "[" * 100_000 + "}",
    ],
)
def test_a_corrupt_line_is_named(line, tmp_path):
    study, path = written(tmp_path), tmp_path / "p.jsonl"
    Progress(study, path, 0)
    with path.open("a") as file:
        file.write(line + "\n")
    with pytest.raises(RecordingError, match=r"line 2 of .* is corrupt"):
        Progress(study, path, 0)


def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "p.jsonl")
    with pytest.raises(RecordingError, match="a regular file"):
        Progress(written(tmp_path), tmp_path / "p.jsonl", 0)
