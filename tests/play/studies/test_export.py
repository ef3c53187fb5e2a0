"""What is published of a study: tables, data sets of two standards, a report; whole or not at all."""

import csv
import hashlib
import html
import io
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from markdown_it import MarkdownIt

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import ConfigError, MissingExtraError, OutputError, RecordingError
from swarm_pz.play.recordings.format import CapturedLine, CommandLine, InForceLine, Recording
from swarm_pz.play.studies import export as module
from swarm_pz.play.studies.analysis import compare, conditions
from swarm_pz.play.studies.bids import LEVELS
from swarm_pz.play.studies.export import export
from swarm_pz.play.studies.psychds import write_psychds
from swarm_pz.play.studies.reading import read_study
from swarm_pz.play.studies.report import counted_games, write_report
from swarm_pz.play.studies.rows import TABLES, codebook
from swarm_pz.play.studies.tables import codebook_text, labels, markdown
from tests.play.recordings.test_format import record
from tests.play.studies import playing


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Give the folder of a study in which one participant has done all, and another is in the middle."""
    folder = tmp_path_factory.mktemp("ran") / "study"
    study = playing.begin(folder)
    playing.run(folder, study, 0)
    playing.run(folder, study, 1, until="block2.game1")
    with (folder / "participants" / "P02.jsonl").open("ab") as file:
        file.write(b'{"step": "block2.ga')  # it is being written
    aside = folder / "interrupted"
    aside.mkdir()
    for attempt in (1, 2):
        record(aside / f"P02.block2.game1.{attempt}.jsonl", ticks=90, outcome="stopped")
    whole = (aside / "P02.block2.game1.2.jsonl").read_bytes().splitlines(keepends=True)
    (aside / "P02.block2.game1.2.jsonl").write_bytes(b"".join(whole[:-20]) + b"{")  # the power went
    return folder


@pytest.fixture(scope="module")
def out(ran, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out") / "published"
    export(ran, folder, command="swarm-pz study export ran")
    return folder


def table(out, name):
    with (out / "tables" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_tables_hold_a_row_for_each_thing_that_happened(ran, out):
    games = table(out, "games")
    assert [(game["participant"], game["step"]) for game in games] == [
        *(("P01", f"block{block}.{step}") for block in (1, 2) for step in ("practice1", "game1", "game2")),
        *(("P02", step) for step in ("block1.practice1", "block1.game1", "block1.game2", "block2.practice1")),
    ]
    for game in games:
        recording, key = Recording.read(ran / game["recording"]), (game["participant"], game["step"])
        is_late = game["condition"].startswith("late")
        sizes = int(game["drones"]), int(game["opponent_drones"])
        assert sizes == ((3, 4) if is_late else (3, 3)), "the late ones are blue, against four"
        drones = sum(sizes)
        commands = [row for row in table(out, "commands") if (row["participant"], row["step"]) == key]
        told = [(line.number, line.tick, line.density) for line in recording.of(CommandLine)]
        assert [(int(row["number"]), int(row["tick"]), json.loads(row["values"])) for row in commands] == told
        assert sum(row["by"] == "participant" for row in commands) == int(game["commands"])
        assert {row["side"] for row in commands if row["by"] == "participant"} == {game["side"]}
        captures = [row for row in table(out, "captures") if (row["participant"], row["step"]) == key]
        taken = [(line.tick, line.drone) for line in recording.of(CapturedLine)]
        assert [(int(row["tick"]), int(row["drone"])) for row in captures] == taken
        if captures:
            assert int(captures[-1]["drones"]) / drones == pytest.approx(float(game["final_share"]), abs=1e-6)
        ended = recording.end.outcome
        assert (game["decided"], game["won"]) == (str(ended != "draw").lower(), str(ended == game["side"]).lower())
        assert float(game["command_delay_got_ms"]) == 301.5
        assert float(game["command_delay_asked_ms"]) == (300 if is_late else 0)
        assert float(game["display_delay_asked_ms"]) == (100 if is_late else 0)
    by_start = {(game["condition"], game["practice"], game["game"]): game["seed"] for game in games}
    assert len(set(by_start.values())) == 3  # the same in each condition
    assert {row["finished"] for row in table(out, "participants")} == {"true", "false"}


def test_games_that_were_broken_off_have_a_table_of_their_own(ran, out):
    """Else nobody who reads the data knows that a participant has seen a start before."""
    rows = table(out, "interrupted")
    assert [(row["participant"], row["step"], row["attempt"]) for row in rows] == [
        ("P02", "block2.game1", "1"),
        ("P02", "block2.game1", "2"),
    ]
    assert {(row["block"], row["game"], row["practice"], row["condition"]) for row in rows} == {
        ("2", "1", "false", "drawing")
    }
    assert {(row["side"], row["opponent"]) for row in rows} == {("red", "uniform")}
    assert [(row["ended_by"], row["commands"]) for row in rows] == [("server", "2"), ("", "1")]
    assert float(rows[1]["seconds"]) < float(rows[0]["seconds"]) == 3.0
    assert all((ran / row["recording"]).exists() and row["started"] for row in rows)
    assert "block2.game1" not in {game["step"] for game in table(out, "games") if game["participant"] == "P02"}


def test_a_participant_has_the_consent_that_they_gave(ran, out):
    """A board asks who agreed to which text, and when."""
    lines = [json.loads(line) for line in (ran / "participants" / "P01.jsonl").read_text().splitlines()]
    row = table(out, "participants")[0]
    assert row["consent_sha256"] == hashlib.sha256((ran / "study" / "consent.md").read_bytes()).hexdigest()
    assert row["consent_version"] == "2026-03"
    assert lines[1]["step"] == "consent" and float(row["consent_at"]) == pytest.approx(lines[1]["at"], abs=1e-6)


def test_a_command_tells_when_it_was_followed_and_where_it_points(out):
    own = next(row for row in table(out, "commands") if row["by"] == "participant")
    assert (own["in_force_tick"], float(own["to_in_force_ms"]), float(own["drawing_ms"])) == ("0", 20.0, 500.0)
    assert (float(own["centre_x"]), float(own["centre_y"])) == (pytest.approx(0.75), pytest.approx(0.35))

    for row in table(out, "commands"):
        assert float(row["seconds"]) == pytest.approx(int(row["tick"]) / 30, abs=1e-6)
        assert row["to_painted_ms"] == ("48.0" if row["by"] == "participant" and row["to_in_force_ms"] else "")


def test_a_capture_tells_when_it_was_and_whose(ran, out):
    games = {(game["participant"], game["step"]): game for game in table(out, "games")}
    captures = table(out, "captures")
    assert captures, "or these games show nothing"
    for row in captures:
        assert float(row["seconds"]) == pytest.approx(int(row["tick"]) / 30, abs=1e-6)
        assert (row["side"] == games[row["participant"], row["step"]]["side"]) == (row["by_participant"] == "true")


def test_a_participant_has_their_order_their_times_and_the_wins_that_count(tmp_path):
    playing.begin(tmp_path)
    outcomes = {"practice1": "win", "game1": "loss", "game2": "win"}
    lines = [{"type": "participant", "number": 1, "study": "Two interfaces, tried", "seed": 7}]
    lines += [{"step": f"block1.{name}", "outcome": told, "at": 5.0 + len(name)} for name, told in outcomes.items()]
    (tmp_path / "participants").mkdir()
    (tmp_path / "participants" / "P02.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (row,) = read_study(tmp_path).participants
    assert (row.participant, row.number, row.order) == ("P02", 1, "late (300 ms) > drawing")
    assert (row.games, row.practice_games, row.wins) == (2, 1, 1)
    assert (row.began_at, row.ended_at) == (10.0, 14.0)


def test_forms_hold_answers_and_scores(out):
    forms = {(row["participant"], row["step"], row["item"]): row for row in table(out, "forms")}
    score = forms["P01", "block1.form.sus", "sus"]
    assert (score["kind"], float(score["value"]), score["condition"]) == ("score", 75.0, "drawing")
    age, words = forms["P01", "start.form.background", "age"], forms["P01", "start.form.background", "words"]
    assert (age["value"], age["block"], age["condition"], age["question"]) == ("40.0", "", "", "Your age?")
    assert words["answer"] == "'" + playing.ANSWERS["background"]["words"]  # no spreadsheet's formula
    assert words["value"] == ""


def test_parquet_holds_what_csv_holds_with_types(out):
    for name, kind in TABLES.items():
        read = pyarrow.parquet.read_table(out / "tables" / f"{name}.parquet")
        rows = table(out, name)
        assert read.column_names == list(rows[0]) == list(kind.__dataclass_fields__)
        assert read.num_rows == len(rows)
    forms = pyarrow.parquet.read_table(out / "tables" / "forms.parquet")
    assert str(forms.schema.field("value").type) == "double"
    assert playing.ANSWERS["background"]["words"] in forms["answer"].to_pylist()  # as it was


def test_the_pages_snippets_read_it(out, capsys):
    text = (Path(__file__).parents[3] / "docs" / "data.md").read_text()
    programs = [one for one in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S) if ">>>" not in one]
    for program in programs:
        exec(compile(program.replace("OUT/", f"{out}/"), "docs/data.md", "exec"), {})  # noqa: S102  (our own page)
    told = capsys.readouterr().out
    assert len(programs) == 2
    assert "500.0" in told and "75.0" in told


def test_the_codebook_names_every_column_with_its_unit(out):
    book, text = json.loads((out / "codebook.json").read_text()), (out / "codebook.md").read_text()
    assert book["tables"] == codebook()
    for name, told in book["tables"].items():
        assert list(told["columns"]) == list(table(out, name)[0])
        assert all(column["about"] for column in told["columns"].values())
        for column, one in told["columns"].items():
            assert f"| `{column}` |" in text
            if re.search(r"_(ms|s)$", column):
                assert one["unit"], f"{name}.{column} has no unit"


def test_events_are_as_bids_has_them(out):
    bids = out / "bids"
    description = json.loads((bids / "dataset_description.json").read_text())
    assert {"Name", "BIDSVersion", "DatasetType"} <= set(description)
    people = list(csv.DictReader(io.StringIO((bids / "participants.tsv").read_text()), dialect="excel-tab"))
    assert next(iter(people[0])) == "participant_id"
    assert [one["participant_id"] for one in people] == ["sub-P01", "sub-P02"]
    assert set(json.loads((bids / "participants.json").read_text())) == set(people[0]) - {"participant_id"}
    events = sorted(bids.rglob("*_events.tsv"))
    assert len(events) == len(table(out, "games"))
    name = re.compile(r"sub-[a-zA-Z0-9]+/beh/sub-[a-zA-Z0-9]+_task-[a-zA-Z0-9]+(_acq-practice)?_run-[0-9]+_events\.tsv")
    for path in events:
        assert name.fullmatch(path.relative_to(bids).as_posix())
        sidecar = json.loads(path.with_suffix(".json").read_text())
        assert all(isinstance(told, dict) for told in sidecar.values())
        rows = list(csv.DictReader(io.StringIO(path.read_text()), dialect="excel-tab"))
        assert list(rows[0])[:2] == ["onset", "duration"]
        assert set(rows[0]) <= set(sidecar)
        assert {row["trial_type"] for row in rows} <= set(sidecar["trial_type"]["Levels"])
        onsets = [float(row["onset"]) for row in rows]
        assert onsets == sorted(onsets)
        assert all(value for row in rows for value in row.values())  # n/a, never nothing
    listed = {path.relative_to(bids).as_posix() for path in bids.rglob("*") if path.is_file()} - {"README"}
    assert all(
        re.search(r"(_events\.(tsv|json)|participants\.(tsv|json)|dataset_description\.json)$", one) for one in listed
    )


def test_events_are_of_the_clock_whatever_the_speed(ran, out):
    for game in table(out, "games"):
        task = "late300ms" if game["condition"].startswith("late") else "drawing"
        practice = "_acq-practice" if game["practice"] == "true" else ""
        who = f"sub-{game['participant']}"
        name = f"{who}_task-{task}{practice}_run-{game['game']}_events.tsv"
        text = (out / "bids" / who / "beh" / name).read_text(encoding="utf-8")
        rows = list(csv.DictReader(io.StringIO(text), dialect="excel-tab"))
        speed, recording = (2.0 if task == "late300ms" else 1.0), Recording.read(ran / game["recording"])
        of = {kind: [row for row in rows if row["trial_type"] == kind] for kind in LEVELS["trial_type"]}
        (whole,) = of["game"]
        assert float(whole["onset"]) == 0.0 and whole["side"] == game["side"]
        assert float(whole["duration"]) == pytest.approx(recording.end.tick / 30 / speed, abs=1e-5)
        for row, line in zip(of["capture"], recording.of(CapturedLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.tick / 30 / speed, abs=1e-5)
            assert (row["actor"] == "participant") == (TEAM_NAMES[line.team] == game["side"])
        for row, line in zip(of["command_received"], recording.of(CommandLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.received_ms / 1000, abs=1e-5)
        for row, line in zip(of["command_in_force"], recording.of(InForceLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.ms / 1000, abs=1e-5)


def test_tables_are_as_psych_ds_has_them(out):
    folder = out / "psychds"
    described = json.loads((folder / "dataset_description.json").read_text())
    assert described["@type"] == "Dataset"
    assert described["@context"] == "https://schema.org/"
    assert all(described[field] for field in ("name", "description", "variableMeasured"))
    known = [one["name"] for one in described["variableMeasured"]]
    assert len(set(known)) == len(known)
    files = sorted((folder / "data").iterdir())
    assert len(files) == len(TABLES)
    for path in files:
        # The validator's expression for names.
        assert re.fullmatch(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv", path.name)
        header, *rows = csv.reader(io.StringIO(path.read_text(encoding="utf-8")))
        assert len(set(header)) == len(header)
        assert set(header) <= set(known)
        assert {len(row) for row in rows} <= {len(header)}


def test_the_report_compares_and_shows(out):
    text = (out / "report.md").read_text()
    assert "| drawing | 1 | 2 |" in text
    assert "| late (300 ms) | 2 | 4 |" in text
    assert "| share won | drawing less late (300 ms) | 1 |" in text
    assert "too few participants" in text
    assert "| `sus` | drawing less late (300 ms) | 1 |" in text
    assert "swarm-pz study export ran" in text
    assert (out / "comparison.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("sign", ["<b>a</b>", "[a](b)", "a|b", "*a*", "`a`", "&amp;", "# a", "![a](b)", "a_b_"])
def test_a_title_is_text_and_neither_markdown_nor_html(sign):
    """Titles stood in report.md as they were."""
    page = MarkdownIt("commonmark").enable("table")
    assert page.render(f"# {markdown(sign)}\n") == f"<h1>{html.escape(sign)}</h1>\n"
    assert f"<td>{html.escape(sign)}</td>" in page.render(f"| a |\n|---|\n| {markdown(sign)} |\n")


def test_titles_are_escaped_wherever_they_stand(ran, tmp_path):
    data = read_study(ran)
    data = replace(data, study=data.study.replace(title="<b>"), faults=["a <b>"])
    write_report(data, tmp_path)
    write_psychds(data, tmp_path / "psychds")
    texts = [(tmp_path / name).read_text() for name in ("report.md", "psychds/README.md")]
    for text in (*texts, codebook_text("<b>")):
        assert "\\<b\\>" in text and "<b" not in text.replace("\\<b", "")


def test_the_report_tells_what_was_found_in_percent_and_seconds(ran, out):
    text, data = (out / "report.md").read_text(), read_study(ran)
    assert "2 of 2 participants, of whom 1 did all of it; 6 games count, and 4 of practice do not." in text
    games = counted_games(data)
    for row in conditions(games):
        ends = f"{100 * row.low:.0f} to {100 * row.high:.0f} %"
        assert row.low < row.high
        assert f"| {row.games} | {100 * row.win_rate:.0f} % | {ends} |" in text
    won, lasted = compare(games)
    assert f"| share won | drawing less late (300 ms) | 1 | {100 * won.difference:+.1f} % |" in text
    assert f"| mean length | drawing less late (300 ms) | 1 | {lasted.difference:+.1f} s |" in text
    assert "- `sus`: drawing 75.0, late (300 ms) 75.0" in text


def test_a_difference_of_shares_is_told_in_percent_and_who_is_not_done_is_not_counted_as_done(tmp_path):
    study = playing.begin(tmp_path, playing.TEXT.replace("participants = 2", "participants = 8"))
    playing.simulate(tmp_path, study, 0.4, 1)
    won = write_report(read_study(tmp_path), tmp_path)[0]
    text = (tmp_path / "report.md").read_text()
    assert abs(won.difference) > 0.1 and f"| 8 | {100 * won.difference:+.1f} % |" in text
    assert "8 of 8 participants, of whom 0 did all of it" in text


def test_games_count_by_the_order_of_the_study_but_practice_and_those_that_a_fault_ended(ran):
    data = read_study(ran)
    assert [game.condition for game in counted_games(data)] == ["drawing"] * 2 + ["late (300 ms)"] * 4
    backwards = replace(data, games=data.games[::-1])
    assert [game.condition for game in counted_games(backwards)] == ["drawing"] * 2 + ["late (300 ms)"] * 4
    for fault in ("server", "forfeit"):
        assert counted_games(replace(data, games=[replace(game, ended_by=fault) for game in data.games])) == []
    left = replace(data, games=[replace(game, ended_by="left") for game in data.games])
    assert len(counted_games(left)) == 6, "who leaves may have been made to by the condition"


def test_nothing_of_the_study_is_changed(ran, tmp_path):
    before = {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()}
    export(ran, tmp_path / "out")
    assert {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()} == before


def test_an_export_is_replaced_only_if_told_and_nothing_else_ever(ran, tmp_path):
    goal = tmp_path / "out"
    export(ran, goal)
    (goal / "tables" / "mine.txt").write_text("")
    with pytest.raises(OutputError, match=r"holds an export: replace it \(--overwrite\)"):
        export(ran, goal)
    export(ran, goal, overwrite=True)
    assert not (goal / "tables" / "mine.txt").exists()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("")
    with pytest.raises(OutputError, match=r"holds 'thesis\.txt' and is no export"):
        export(ran, other, overwrite=True)
    with pytest.raises(OutputError, match="is a file, not a folder"):
        export(ran, other / "thesis.txt")
    with pytest.raises(OutputError, match="must lie outside of it"):
        export(ran, ran / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "out"]


def test_an_export_that_fails_leaves_what_was_there(ran, tmp_path, monkeypatch):
    goal = tmp_path / "out"
    export(ran, goal)
    before = sorted(goal.rglob("*"))

    def fail(*given):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "write_report", fail)
    with pytest.raises(OutputError, match="cannot be written: no space left on device"):
        export(ran, goal, overwrite=True)
    with pytest.raises(OutputError):
        export(ran, tmp_path / "another")
    assert sorted(goal.rglob("*")) == before
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_what_is_corrupt_is_left_out_and_told(tmp_path):
    study = playing.begin(tmp_path / "s")
    playing.run(tmp_path / "s", study, 0, until="block1.form.sus")
    people, games = tmp_path / "s" / "participants", tmp_path / "s" / "games"
    (people / "P02.jsonl").write_text('{"type": "participant", "number": 1, "study": "another"}\n')
    (people / "P03.jsonl").write_text("{\n")
    (people / "P04.jsonl").write_text("")
    (games / "P01.block1.game1.jsonl").write_text("{}\n")
    lines = (people / "P01.jsonl").read_text().split("\n")
    lines[-2] = json.dumps(json.loads(lines[-2]) | {"recording": "../../secret.jsonl"})
    lines[-1] = json.dumps({"step": "block9.game1"}) + "\n"
    (people / "P01.jsonl").write_text("\n".join(lines))
    found = export(tmp_path / "s", tmp_path / "out")
    told = "\n".join(found.data.faults)
    assert len(found.data.faults) == 6
    for fault in ("P02.jsonl is no participant", "line 1 of", "P04.jsonl is empty", "not one of a recorded game"):
        assert fault in told
    assert "is not in the study's folder" in told
    assert "P01: block9.game1 is no step of the study" in told
    assert [game.commands is None for game in found.data.games] == [False, True, True]
    assert all(markdown(fault) in (tmp_path / "out" / "report.md").read_text() for fault in found.data.faults)


def test_an_outcome_that_its_recording_contradicts_is_told(tmp_path):
    study = playing.begin(tmp_path)
    playing.run(tmp_path, study, 0, until="block1.game1")
    path = tmp_path / "participants" / "P01.jsonl"
    told = json.loads(path.read_text().split("\n")[-2])["outcome"]
    path.write_text(path.read_text().replace(f'"outcome": "{told}"', '"outcome": "loss"'))
    assert read_study(tmp_path).faults == [
        f"P01: block1.practice1: the outcome was 'loss', its recording says '{told}'"
    ]


def test_scores_that_answers_do_not_come_to_and_steps_out_of_turn_are_told(tmp_path):
    study = playing.begin(tmp_path)
    playing.run(tmp_path, study, 0, until="block2.game1")
    assert read_study(tmp_path).faults == []
    path = tmp_path / "participants" / "P01.jsonl"
    lines = path.read_text().splitlines()
    place = next(place for place, line in enumerate(lines) if ".form.sus" in line)
    step = json.loads(lines[place])
    lines[place] = json.dumps(step | {"scores": {"sus": 99.0}})
    path.write_text("\n".join([*lines, lines[2], ""]))
    second = json.loads(lines[2])["step"]
    assert read_study(tmp_path).faults == [
        f"P01: {second} does not stand in its turn, or twice; the last one counts",
        f"P01: {step['step']}: the answers come to {step['scores']}, but {{'sus': 99.0}} stands there",
    ]


def test_a_folder_without_a_study_or_without_participants_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no study has run in"):
        export(tmp_path / "s", tmp_path / "out")
    playing.begin(tmp_path / "s")
    with pytest.raises(RecordingError, match="nobody has taken part"):
        export(tmp_path / "s", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_missing_is_named_before_anything_is_read(ran, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match="pyarrow is not installed"):
        export(ran, tmp_path / "out")


def test_labels_are_plain_and_differ():
    names = ["Drawing!", "drawing", "Größe 1", "…", "draw-ing"]
    assert list(labels(names, "condition").values()) == ["Drawing", "drawingx2", "Groe1", "condition", "drawingx3"]


def test_from_folders_a_planted_difference_is_found_and_none_where_none_was_planted(tmp_path):
    text = playing.TEXT.replace("participants = 2", "participants = 8").replace("games = 2", "games = 6")
    study = playing.begin(tmp_path, text)

    def found(gain, seed):
        playing.simulate(tmp_path, study, gain, seed)
        return next(one for one in compare(counted_games(read_study(tmp_path))) if one.measure == "win_rate")

    planted = [found(0.4, seed) for seed in range(50)]
    nothing = [found(0.0, 1000 + seed) for seed in range(50)]
    assert np.sum([one.p <= 0.05 and one.difference > 0 for one in planted]) >= 40
    assert np.sum([one.p <= 0.05 for one in nothing]) <= 5
