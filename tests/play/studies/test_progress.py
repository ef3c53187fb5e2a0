"""A participant's way through a study, over reloads, crashes and power cuts."""

import json

import numpy as np
import pytest

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play.studies.forms import KNOWN_FORMS, Form, Item
from swarm_pz.play.studies.progress import Progress, items_of
from tests.play.studies.playing import PLAIN, answers_to, written


def finish(progress, won=False):
    """Do the next step, if there is one; return its name."""
    if (step := progress.next) is None:
        return None
    progress.finish(step, **({"won": won or step.game == 1} if step.is_game else answers_to(step)))
    return step.id


def walk(progress):
    """Do all that is left; return the steps' names."""
    return list(iter(lambda: finish(progress), None))


def test_a_participant_does_everything_in_turn(tmp_path):
    plan = PLAIN.replace("seed = 7", 'seed = 7\nbreak_s = 30.0\nwelcome = "consent.md"')
    study = written(tmp_path, plan.replace('title = "late"', 'title = "late"\ntext = "consent.md"'))
    after = Form(name="after", when="end", items=(Item(id="age", text="?", optional=True),))
    progress = Progress(study.replace(forms=(*study.forms, after)), tmp_path / "p.jsonl", 0)
    planned, block = len(progress.steps), ("practice1", "practice2", "game1", "game2", "form.sus")
    progress.finish(progress.next)
    progress.finish(progress.next, **answers_to(progress.next))
    progress.finish(progress.next)
    whole = [f"block{number}.{step}" for number in (1, 2) for step in block]
    whole[5:5] = ["block2.break", "block2.text"]
    assert [*progress.done] == ["consent", "start.form.background", "welcome"]
    while progress.next.id != "end.form.after":
        finish(progress)
    progress.finish(progress.next, answers={})
    assert [*progress.done][3:] == [*whole, "end.form.after"]
    again = Progress(progress.study, tmp_path / "p.jsonl", 0)
    assert again.next is None and again.done == progress.done
    assert len(again.steps) == len(again.done) == planned + 2, "a second game of practice a block"
    assert again.done["block1.form.sus"]["scores"] == {"sus": 75.0}


@pytest.mark.parametrize(("is_won", "games"), [(True, 1), (False, 3)])
def test_practice_ends_when_it_is_won_or_has_been_enough(is_won, games, tmp_path):
    progress = Progress(written(tmp_path), tmp_path / "p.jsonl", 0)
    while (step := progress.next).kind != "game":
        progress.finish(step, **(answers_to(step) | {"won": is_won}))
    assert sum("practice" in name for name in progress.done) == games


QUIZ = Form(
    name="quiz",
    when="welcome",
    tries=2,
    items=(
        Item(id="goal", text="Your goal?", kind="choice", choices=("win", "lose"), correct="win"),
        Item(id="size", text="How many drones?", most=9, correct=3),
    ),
)
RIGHT, WRONG = {"answers": {"goal": "win", "size": 3}}, {"answers": {"goal": "win", "size": 4}}


@pytest.mark.parametrize("fails", ["exclude", "end"])
def test_a_form_with_right_answers_is_asked_again_beside_the_text_and_may_end_the_study(fails, tmp_path):
    study = written(tmp_path, 'welcome = "consent.md"\ndebriefing = "consent.md"\n' + PLAIN)
    study = study.replace(forms=(*study.forms, QUIZ.replace(fails=fails)))
    for answers, after in ((RIGHT, "block1.practice1"), (WRONG, "welcome.form.quiz.2")):
        progress = Progress(study, tmp_path / f"{after}.jsonl", 0)
        for _ in range(3):
            progress.finish(progress.next, **answers_to(progress.next))
        assert (progress.next.id, progress.next.text) == ("welcome.form.quiz", "")
        progress.finish(progress.next, **answers)
        assert progress.next.id == after
    assert progress.next.text == study.welcome
    progress.finish(progress.next, **WRONG)
    assert progress.next.id == ("debriefing" if fails == "end" else "block1.practice1")
    assert progress.has_ended_early == (fails == "end")
    assert Progress(study, tmp_path / f"{after}.jsonl", 0).next == progress.next


def test_who_stops_is_asked_nothing_more_and_is_debriefed(tmp_path):
    progress = Progress(written(tmp_path, 'debriefing = "consent.md"\n' + PLAIN), tmp_path / "p.jsonl", 0)
    assert not progress.may_stop, "nothing is kept before the consent"
    for _ in range(2):
        progress.finish(progress.next, **answers_to(progress.next))
    assert progress.may_stop
    progress.stop()
    progress.stop()
    assert (progress.next.id, progress.may_stop) == ("debriefing", False)
    progress.finish(progress.next)
    again = Progress(progress.study, tmp_path / "p.jsonl", 0)
    assert [*again.done] == ["consent", "start.form.background", "stop", "debriefing"] and again.next is None


def test_questions_in_a_random_order_are_the_same_again_and_differ_among_participants_and_steps(tmp_path):
    study = written(tmp_path).replace(forms=(KNOWN_FORMS["sus"].replace(shuffle=True),))
    first, second = (one for one in Progress(study, tmp_path / "p.jsonl", 0).steps if one.form is not None)
    asked = [(0, first), (0, first), (1, first), (2, first), (0, second)]
    orders = [tuple(item.id for item in items_of(study, number, step)) for number, step in asked]
    assert orders[0] == orders[1] and len({*orders}) == 4
    assert sorted(orders[0]) == sorted(item.id for item in first.form.items)


def test_whatever_ends_the_program_nothing_is_asked_twice_and_nothing_is_lost(tmp_path):
    study = written(tmp_path)
    whole = walk(Progress(study, tmp_path / "whole.jsonl", 1))
    path = tmp_path / "torn.jsonl"
    names, chance = [], np.random.default_rng(0)
    while (progress := Progress(study, path, 1)).next is not None:
        names += filter(None, (finish(progress) for _ in range(chance.integers(3))))
        if progress.next is not None:
            with path.open("ab") as file:  # the power goes while a line is written
                file.write(json.dumps({"step": progress.next.id}).encode()[: chance.integers(8)])
    assert names == whole
    lines = path.read_bytes()
    for size in range(0, len(lines), 31):
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
    read = iter(progress.done.items())  # as another thread reads it, paused here
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
        '{"step": "consent", "at": "now"}',
        '{"step": "consent", "at": NaN}',
        '{"step": "consent", "at": 1' + "0" * 400 + "}",
        '{"step": "consent", "answers": {"hand": {}}}',
        '{"step": "consent", "answers": {"hand": "\\ud800"}}',
        '{"step": "block1.game1", "side": "green"}',
        '{"step": "block1.game1", "seconds": -1}',
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
