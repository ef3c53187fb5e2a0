"""Commands of studies: what they check before anybody plays, what they say, and the tables of recordings."""

import csv
import json
import re
import shutil
from pathlib import Path

import pytest

from swarm_pz.cli import main
from swarm_pz.play.server import serve as module
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.policies import load
from tests.cli.test_cli import refused
from tests.play.recordings.test_format import record
from tests.play.studies.test_design import PLAIN, written


@pytest.fixture
def served(monkeypatch):
    """Give what the server is called with; it ends at once."""
    calls = []
    monkeypatch.setattr("swarm_pz.cli.studies.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(module, "serve", lambda loader, policies, **how: calls.append((loader, policies, how)))
    return calls


@pytest.fixture
def study(tmp_path):
    """A study that has begun: its first participant has done a step, and the file of the second is torn."""
    written(tmp_path)
    opened = StudyFolder.begin(tmp_path / "study.toml", tmp_path / "data")
    opened.progress(0).finish(opened.progress(0).next)
    (tmp_path / "data" / "participants" / "P02.jsonl").write_text("{\n")
    yield opened
    opened.close()


def test_a_study_is_served_from_its_folder(served, tmp_path, capsys):
    written(tmp_path)
    run = ["study", "run", "study.toml", "--port", "0", "--folder"]
    main([*run, "data", "--host", "127.0.0.2", "--countdown", "1"])
    ((loader, _, how),) = served
    assert loader is load and how["study"].study.title == "Two interfaces" and not how["record_labels"]
    assert (how["folder"], how["host"], how["countdown_s"]) == (Path("data/games"), "127.0.0.2", 1.0)
    told = capsys.readouterr()
    assert "the participants' codes are in data/codes.txt" in told.out and "warning" not in told.err
    main([*run, "data"])  # the folder was let go of
    assert len(served) == 2
    written(tmp_path, PLAIN.replace("games = 2", 'games = 2\ncodes = ["A1", "A2", "A3", "A4"]'))
    main([*run, "guessable"])
    assert "are easy to guess" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("participants = 4", "participants = 5", "participants must be a multiple of 2, for 2 conditions"),
        ('title = "late"', 'title = "late"\nopponent = "rign"', "condition 'late': opponent: .*did you mean 'ring'"),
        ("most = 3", 'most = 3\nopponent = "cornrs"', "practice.opponent: .*did you mean 'corners'"),
        ('title = "late"', 'title = "late"\nsystem = "flocing"', "condition 'late': .*did you mean 'flocking'"),
    ],
)
def test_a_study_that_cannot_be_run_is_refused_before_anything_is_made(before, after, said, served, tmp_path, capsys):
    (tmp_path / "consent.md").write_text("?")
    (tmp_path / "study.toml").write_text(PLAIN.replace(before, after))
    told = refused(capsys, "study", "run", "study.toml", "--folder", "data")
    assert re.search(said, told), told
    assert not served and not (tmp_path / "data").exists()


def test_status_says_how_far_everybody_is(study, capsys):
    main(["study", "status", "data"])
    printed = capsys.readouterr().out
    for said in ("Two interfaces", "0 of 4 participants", "has not come", "start.form", "line 1"):
        assert said in printed, said
    assert "no study has run in" in refused(capsys, "study", "status", ".")


def test_the_data_of_a_study_are_exported_where_it_was_asked(study, capsys):
    export = ["study", "export", "data", "--out", "out"]
    main(export)
    printed = capsys.readouterr()
    assert "1 participants, 0 games" in printed.out and "report.md" in printed.out and "left out: line 1" in printed.err
    assert Path("out/tables/participants.csv").exists()
    assert "--overwrite" in refused(capsys, *export)
    main([*export, "--overwrite"])


def test_a_participant_who_withdraws_is_named_with_what_the_study_lacks(study, capsys):
    call = ["study", "withdraw", study.codes[0].lower(), "--folder", "data"]
    assert "may be in session" in refused(capsys, *call)
    study.close()
    main(call)
    printed = capsys.readouterr().out
    assert "P01 has withdrawn" in printed and "and 0 recordings" in printed
    assert "the order drawing > late has 1 of 2 participants; it lacks P01" in printed
    main(["study", "status", "data"])
    assert "withdrawn" in capsys.readouterr().out


def test_commands_of_studies_are_named(tmp_path, capsys):
    assert "there is no command study 'rum'; did you mean 'run'" in refused(capsys, "study", "rum")
    assert "made by study tables FOLDER" in refused(capsys, "study", str(tmp_path))
    assert "leave out --preset" in refused(capsys, "--preset", "paper", "study", "status", ".")
    with pytest.raises(SystemExit, match="0"):
        main(["study", "--help"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("run", "status", "withdraw", "tables", "export"))


@pytest.mark.parametrize(("suffix", "options"), [("csv", []), ("parquet", ["--parquet"])])
def test_recordings_become_tables_and_what_is_left_out_is_said(suffix, options, tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=30, outcome="red", player="ring")
    shutil.copy(tmp_path / "a.jsonl", tmp_path / "b.jsonl")
    (tmp_path / "bad.jsonl").write_text("{}\n")
    main(["study", "tables", ".", "--out", "tables", *options])
    printed = capsys.readouterr()
    names = [f"seats.{suffix}", f"summary.{suffix}", "schema.json"]
    assert printed.out.splitlines()[:3] == [f"tables/{name}" for name in names]
    assert sorted(path.name for path in Path("tables").iterdir()) == sorted(names)
    assert "2-0-0" in printed.out and "P1" in printed.out
    assert printed.err.startswith("left out: ") and "bad.jsonl" in printed.err
    assert json.loads(Path("tables/schema.json").read_text())["command"].startswith("swarm-pz study tables .")
    if suffix == "csv":
        assert len(list(csv.DictReader(Path("tables/seats.csv").read_text().splitlines()))) == 4
