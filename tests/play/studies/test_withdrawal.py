"""A withdrawal deletes all data of the participant, and nothing of anybody else."""

import contextlib
import itertools
import json
import shutil
from pathlib import Path

import pytest

from swarm_pz.errors import ConfigError, OutputError
from swarm_pz.play.studies.reading import read_study
from swarm_pz.play.studies.report import counted_games
from swarm_pz.play.studies.withdrawal import withdraw
from tests.play.recordings.games import record
from tests.play.studies.playing import begun, walk

PLAN = """
title = "Two of two"
participants = 4
codes = ["ann", "bob", "cid", "dot"]
games = 2
practice = { wins = 1, most = 1 }

[[conditions]]
title = "together"
opponent = "person"

[[conditions]]
title = "alone"

[[forms]]
name = "sus"
"""


def tree(path):
    """Return the files of a study's folder, without the times of withdrawals."""
    files = {str(one.relative_to(path)): one.read_bytes() for one in path.rglob("*") if one.is_file()}
    for name, content in files.items():
        first = json.loads(content.split(b"\n")[0]) if name.startswith("participants/P") else {}
        if "withdrawn" in first:
            files[name] = sorted(first), content.count(b"\n")
    return files


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Give the folder of a study in which one pair is midway, and one member of another pair has come."""
    place = tmp_path_factory.mktemp("whole")
    with begun(place, PLAN) as folder:
        for number in (0, 1):
            walk(folder, number, until="block1.game2")
        walk(folder, 2, until="block1.game1")
    for game in ("game2", "practice1"):
        record(place / "data" / "interrupted" / f"P01.block1.{game}.1.jsonl", ticks=30, outcome="stopped")
    return place


@pytest.fixture
def ran(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "ran") / "data"


@pytest.mark.parametrize(("code", "own", "other"), [("ann", "P01", "P02"), ("BOB", "P02", "P01")])
def test_of_a_pair_one_withdraws_and_the_other_keeps_what_is_theirs(code, own, other, ran):
    """A recording left behind would show who withdrew; the partner must keep their result and not wait for ever."""
    before = tree(ran)
    done = withdraw(ran, code)
    after = tree(ran)
    gone = {name for name in before if name not in after}
    both = {"games/P01.block1.game1.jsonl", "interrupted/P01.block1.game2.1.jsonl"}
    aside = {"interrupted/P01.block1.practice1.1.jsonl"} if own == "P01" else set()
    assert gone == both | aside | {f"games/{own}.block1.practice1.jsonl"} and done == (own, len(gone))
    kept = {name: content for name, content in after.items() if name != f"participants/{own}.jsonl"}
    assert all(before[name] == content for name, content in kept.items())
    assert after[f"participants/{own}.jsonl"] == (["number", "seed", "study", "type", "withdrawn"], 1)

    data = read_study(ran)
    assert data.faults == []
    row = next(one for one in data.participants if one.participant == own)
    assert row.withdrawn and not row.finished
    assert [one.participant for one in data.remaining] == [other, "P03"]
    rows = [getattr(data, name) for name in ("games", "commands", "captures", "forms")]
    assert own not in {one.participant for table in rows for one in table}
    (game,) = [one for one in data.games if one.participant == other and not one.practice]
    assert (game.won, game.outcome) == ((False, "loss") if other == "P02" else (True, "win"))
    assert (game.left_out, game.commands, game.ended_by) == ("partner withdrew", None, "time")
    assert other in {one.participant for one in counted_games(data)}, "how it ended is the partner's, too"

    with begun(ran.parent, PLAN) as folder:
        number = int(other[1:]) - 1
        walk(folder, number)
        steps = [*folder.progress(number).done]
        assert folder.summary(number)["step"] == "all done" and folder.summary(number ^ 1)["step"] == "withdrawn"
    assert steps[:2] == ["block1.practice1", "block1.game1"] and steps[2].startswith("block2.") and len(steps) == 6
    assert next(one for one in read_study(ran).participants if one.participant == other).finished
    with pytest.raises(ConfigError, match="withdrawn already"):
        withdraw(ran, code)


def test_a_game_of_two_that_was_over_is_written_down_for_the_other_before_it_goes(ran):
    """After a power failure, only the recording shows how the partner's game ended."""
    file = ran / "participants" / "P02.jsonl"
    file.write_text("".join(line for line in file.read_text().splitlines(keepends=True) if ".game1" not in line))
    withdraw(ran, "ann")
    assert withdraw(ran, "dot") == ("P04", 0)  # who never came
    with begun(ran.parent, PLAN) as folder:
        assert folder.progress(1).done["block1.game1"]["outcome"] == "loss"
        assert "block2.game1" not in [step.id for step in folder.progress(2).steps], "the other goes on without them"


def test_who_is_not_there_or_may_be_in_session_is_refused(ran):
    for path, code, message in (
        (ran, "bobb", r"compare it with .*codes\.txt"),
        (ran, "../P01", "code must"),
        (ran / "games", "ann", "no study has run"),
    ):
        with pytest.raises(ConfigError, match=message):
            withdraw(path, code)
    before = tree(ran)
    with begun(ran.parent, PLAN), pytest.raises(OutputError, match="may be in session"):
        withdraw(ran, "ann")
    assert tree(ran) == before


class Killed(BaseException):
    """The process ends here."""


def kill_at(patch, step):
    """End the process just before its `step`-th removal or replacement of a file, counted from 0."""
    count = itertools.count()

    def counted(act):
        def one(path, *given, **more):
            if path.name != ".holder" and next(count) >= step:  # the lock's own file
                raise Killed
            return act(path, *given, **more)

        return one

    for name in ("unlink", "replace"):
        patch.setattr(Path, name, counted(getattr(Path, name)))


def test_a_withdrawal_that_is_killed_anywhere_is_done_by_calling_it_again(ran, whole, monkeypatch):
    """Otherwise, recordings of a withdrawn participant might never be deleted."""
    withdraw(ran, "ann")
    goal = tree(ran)
    for step in range(100):
        shutil.rmtree(ran)
        shutil.copytree(whole / "data", ran)
        with monkeypatch.context() as patch, contextlib.suppress(Killed):
            kill_at(patch, step)
            withdraw(ran, "ann")
            break
        if (ran / "participants" / "P01.jsonl").read_bytes().count(b"\n") == 1:
            assert [one.participant for one in read_study(ran).remaining] == ["P02", "P03"]
        withdraw(ran, "ann")
        assert tree(ran) == goal
    assert step > 4, "the file, and every recording"
