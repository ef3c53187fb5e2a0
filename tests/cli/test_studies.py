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
from tests.cli.test_table import refused
from tests.play.recordings.test_format import record
from tests.play.studies.test_design import PLAIN, written


@pytest.fixture
def served(monkeypatch):
    """Give what the server is called with; it ends at once."""
    calls = []
    monkeypatch.setattr("swarm_pz.cli.studies.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(module, "serve", lambda loader, policies, **how: calls.append((loader, policies, how)))
    return calls


def test_a_study_is_served_from_its_folder(served, tmp_path, capsys):
    written(tmp_path)
    arguments = ["study", "run", str(tmp_path / "study.toml"), "--folder", str(tmp_path / "data"), "--port", "0"]
    main([*arguments, "--host", "127.0.0.2", "--countdown", "1"])
    ((loader, _, how),) = served
    assert loader is load and how["study"].study.title == "Two interfaces"
    assert (how["folder"], how["host"], how["countdown_s"]) == (tmp_path / "data" / "games", "127.0.0.2", 1.0)
    assert not how["record_labels"]
    told = capsys.readouterr()
    assert f"study: Two interfaces; the participants' codes are in {tmp_path / 'data' / 'codes.txt'}" in told.out
    assert "warning" not in told.err
    main(arguments)  # the folder was let go of
    assert len(served) == 2
    written(tmp_path, PLAIN.replace("games = 2", 'games = 2\ncodes = ["A1", "A2", "A3", "A4"]'))
    main([*arguments[:4], str(tmp_path / "guessable")])
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
    told = refused(capsys, "study", "run", str(tmp_path / "study.toml"), "--folder", str(tmp_path / "data"))
    assert re.search(said, told), told
    assert not served and not (tmp_path / "data").exists()


def test_status_says_how_far_everybody_is(tmp_path, capsys):
    written(tmp_path)
    opened = StudyFolder.begin(tmp_path / "study.toml", tmp_path / "data")
    opened.progress(1).finish(opened.progress(1).next)
    (tmp_path / "data" / "participants" / "P04.jsonl").write_text("{\n")
    main(["study", "status", str(tmp_path / "data")])
    printed = capsys.readouterr().out
    assert "Two interfaces" in printed and "0 of 4 participants have done all" in printed
    assert "has not come" in printed and "start.form" in printed and "line 1" in printed
    opened.close()
    assert "no study has run in" in refused(capsys, "study", "status", str(tmp_path))


def test_what_a_study_found_is_exported_where_it_was_asked(tmp_path, capsys):
    written(tmp_path)
    opened = StudyFolder.begin(tmp_path / "study.toml", tmp_path / "data")
    opened.progress(0).finish(opened.progress(0).next)
    opened.close()
    (tmp_path / "data" / "participants" / "P02.jsonl").write_text("{\n")
    export = ["study", "export", str(tmp_path / "data"), "--out", str(tmp_path / "out")]
    main(export)
    printed = capsys.readouterr()
    assert "1 participants, 0 games" in printed.out and "report.md" in printed.out and "left out: line 1" in printed.err
    assert (tmp_path / "out" / "tables" / "participants.csv").exists()
    assert "--overwrite" in refused(capsys, *export)
    main([*export, "--overwrite"])


def test_who_withdraws_is_named_with_what_the_study_lacks(tmp_path, capsys):
    written(tmp_path)
    opened = StudyFolder.begin(tmp_path / "study.toml", tmp_path / "data")
    opened.progress(2).finish(opened.progress(2).next)
    call = ["study", "withdraw", opened.codes[2].lower(), "--folder", str(tmp_path / "data")]
    assert "may be in session" in refused(capsys, *call)
    opened.close()
    main(call)
    printed = capsys.readouterr().out
    assert "P03 has withdrawn: deleted are their answers, times and results, and 0 recordings" in printed
    assert "the order drawing > late has 1 of 2 participants; it lacks P03" in printed
    main(["study", "status", str(tmp_path / "data")])
    assert "withdrawn" in capsys.readouterr().out


def test_commands_of_studies_are_named(tmp_path, capsys):
    said = refused(capsys, "study", "rum")
    assert "there is no command study 'rum'; did you mean 'run'" in said
    assert "made by study tables FOLDER" in refused(capsys, "study", str(tmp_path))
    assert "leave out --preset" in refused(capsys, "--preset", "paper", "study", "status", str(tmp_path))
    with pytest.raises(SystemExit, match="0"):
        main(["study", "--help"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in ("run", "status", "tables", "export"))


@pytest.mark.parametrize("options", [[], ["--parquet"]])
def test_a_study_writes_tables_and_says_what_it_left_out(options, tmp_path, capsys):
    record(tmp_path / "a.jsonl", ticks=30, outcome="red", player="ring")
    shutil.copy(tmp_path / "a.jsonl", tmp_path / "b.jsonl")
    (tmp_path / "bad.jsonl").write_text("{}\n")
    main(["study", "tables", str(tmp_path), "--out", "tables", *options])
    printed = capsys.readouterr()
    suffix = "parquet" if options else "csv"
    names = [f"seats.{suffix}", f"summary.{suffix}", "schema.json"]
    assert printed.out.splitlines()[:3] == [f"tables/{name}" for name in names]
    assert sorted(path.name for path in Path("tables").iterdir()) == sorted(names)
    assert "2-0-0" in printed.out and "P1" in printed.out
    assert printed.err.startswith("left out: ") and "bad.jsonl" in printed.err
    assert json.loads(Path("tables/schema.json").read_text())["command"].startswith(f"swarm-pz study tables {tmp_path}")
    if not options:
        assert len(list(csv.DictReader(Path("tables/seats.csv").read_text().splitlines()))) == 4
