"""A study's folder: what it keeps, and how it goes on after an interruption."""

import contextlib

import pytest

from swarm_pz.errors import ConfigError, OutputError, RecordingError, ResultsError
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Progress
from tests.play.recordings.games import record
from tests.play.studies.playing import PLAIN, begun, walk

PAIR = """
title = "Each other"
participants = 2
games = 1

[practice]
wins = 1

[[conditions]]
title = "together"
opponent = "person"
"""


@pytest.fixture
def folder(tmp_path):
    with begun(tmp_path, PLAIN.replace("wins = 1", "wins = 0")) as opened:
        yield opened


def test_a_study_is_what_it_was_when_it_began(folder, tmp_path):
    file, path = tmp_path / "plan" / "study.toml", tmp_path / "data"
    with pytest.raises(ResultsError, match="being played in"):
        StudyFolder.begin(file, path)
    folder.close()
    for again in (file, path / "study" / "study.toml"):
        StudyFolder.begin(again, path).close()
    (tmp_path / "plan" / "consent.md").write_text("# Won't you?")
    with pytest.raises(ConfigError, match=r"another consent\.md"):
        StudyFolder.begin(file, path)
    file.write_text("title = 7")
    with pytest.raises(ConfigError):
        StudyFolder.begin(file, tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_codes_are_drawn_once_and_open_what_has_another_name(folder, tmp_path):
    """Numbered codes would let anybody take over sessions; new codes after a restart would lock everybody out."""
    file, path = tmp_path / "plan" / "study.toml", tmp_path / "data"
    codes = folder.codes
    assert [folder.number_of(code.lower()) for code in codes] == [0, 1, 2, 3]
    with pytest.raises(ConfigError, match="the code P01"):
        folder.number_of("P01")
    assert (path / "codes.txt").read_text().split()[::2] == ["P01", "P02", "P03", "P04"]
    assert (path / "codes.txt").stat().st_mode & 0o077 == 0, "others on this machine may not read it"
    walk(folder, 0, until="block1.game1")
    assert not [one for one in path.rglob("*") for code in codes if code in one.name]
    folder.close()
    with contextlib.closing(StudyFolder.begin(file, path)) as again:
        assert again.codes == codes
    for text in ("P01 A\n", (path / "codes.txt").read_text() + "P05\n", "P02 A\nP01 B\nP03 C\nP04 D\n"):
        (path / "codes.txt").write_text(text)
        with pytest.raises(ConfigError, match=r"codes\.txt"):
            StudyFolder(path)


def test_a_game_that_was_over_when_the_power_went_counts(folder):
    step = walk(folder, 0, until="block1.game1")
    record(folder.recording(0, step), ticks=30, outcome="red")
    folder.settle(0)
    line = {name: value for name, value in folder.progress(0).done[step.id].items() if name not in ("step", "at")}
    assert line == {
        "condition": "drawing",
        "system": "ergodic",
        "opponent": "uniform",
        "side": "red",
        "seed": folder.study.seed_of(0),
        "outcome": "win",
        "won": True,
        "seconds": 1.0,
        "ended_by": "time",
        "recording": "games/P01.block1.game1.jsonl",
    }
    assert folder.summary(0)["won"] == 1 and folder.recording(0, step).exists()


@pytest.mark.parametrize("outcome", ["red", "draw"])
def test_of_two_each_has_their_side_their_outcome_and_their_delays_and_practice_counts_nowhere(outcome, tmp_path):
    with begun(tmp_path, PAIR) as folder:
        for number in (0, 1):
            practice = folder.progress(number).next
            step = walk(folder, number, until="block1.game1")
            assert folder.players(number, practice) == (number,) and folder.players(number, step) == (0, 1)
            line = folder.progress(number).done[practice.id]
            assert (line["opponent"], line["seed"]) == ("corners", folder.study.seed_of(0, practice=True))
            assert folder.summary(number)["played"] == folder.summary(number)["won"] == 0
        for number, side in enumerate(("red", "blue")):
            walk(folder, number, outcome=outcome)
            line = folder.progress(number).done["block1.game1"]
            result = "draw" if outcome == "draw" else "win" if side == outcome else "loss"
            assert (line["side"], line["outcome"], line["won"]) == (side, result, side == outcome)
            assert (line["opponent"], line["delays"]["display"]["count"]) == ("person", number)
            assert line["recording"] == "games/P01.block1.game1.jsonl"


@pytest.mark.parametrize(("lines", "rest"), [(1, b"{"), (5, b"{"), (None, b"")])
def test_a_game_that_was_not_over_is_kept_aside_and_played_again(lines, rest, folder, tmp_path):
    step = walk(folder, 0, until="block1.game1")
    path = folder.recording(0, step)
    assert not folder.was_broken_off(0, step)
    for count in (1, 2):
        record(path, ticks=30, outcome="stopped")
        path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:lines]) + rest)
        folder.settle(0)
        assert folder.progress(0).next == step and not path.exists()
        assert (tmp_path / "data" / "interrupted" / f"P01.block1.game1.{count}.jsonl").exists()
        assert folder.was_broken_off(0, step)


def test_to_look_on_changes_nothing(folder, tmp_path):
    walk(folder, 0, until="block1.game1")
    path = tmp_path / "data" / "participants" / "P01.jsonl"
    with path.open("a") as file:
        file.write('{"half')
    before = path.read_bytes()
    rows = [StudyFolder(tmp_path / "data").summary(number) for number in range(4)]
    assert [row["step"] for row in rows] == ["block1.game1", *["has not come"] * 3]
    assert path.read_bytes() == before and not (tmp_path / "data" / "participants" / "P02.jsonl").exists()
    path.write_text("{}\n")
    assert StudyFolder(tmp_path / "data").summary(0)["step"] == "corrupt"
    with pytest.raises(RecordingError):
        StudyFolder(tmp_path / "data").progress(0)


def test_a_disk_that_is_full_spoils_no_line(folder, tmp_path, monkeypatch):
    step = folder.progress(0).next
    path = tmp_path / "data" / "participants" / "P01.jsonl"
    before = path.read_bytes()

    def refuse(_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr("os.fsync", refuse)
        with pytest.raises(OutputError, match="no space left"):
            folder.progress(0).finish(step)
    assert path.read_bytes() == before and folder.progress(0).next == step
    folder.progress(0).finish(step)
    assert Progress(folder.study, path, 0).done.keys() == {step.id}
