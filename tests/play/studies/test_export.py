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

import pyarrow.parquet
import pytest
from markdown_it import MarkdownIt

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import ConfigError, MissingExtraError, OutputError, RecordingError
from swarm_pz.play.recordings.format import CapturedLine, CommandLine, InForceLine, Recording
from swarm_pz.play.studies import export as module
from swarm_pz.play.studies.analysis import compare, conditions
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
    """Give its export, which has left the study as it was."""
    folder = tmp_path_factory.mktemp("out") / "published"
    before = {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()}
    export(ran, folder, command="swarm-pz study export ran")
    assert {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()} == before
    return folder


@pytest.fixture
def small(tmp_path):
    """Give the folder of a study of which hardly anything was done."""
    folder = tmp_path / "small"
    study = playing.begin(folder)
    playing.run(folder, study, 0, until="block1.practice1")
    return folder


def rows_of(path, dialect="excel"):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file, dialect=dialect))


def table(out, name):
    return rows_of(out / "tables" / f"{name}.csv")


# --- tables ---------------------------------------------------------------------------------------


def test_tables_hold_a_row_for_each_thing_that_happened(ran, out):
    games = table(out, "games")
    assert [(game["participant"], game["step"]) for game in games] == [
        *(("P01", f"block{block}.{step}") for block in (1, 2) for step in ("practice1", "game1", "game2")),
        *(("P02", step) for step in ("block1.practice1", "block1.game1", "block1.game2", "block2.practice1")),
    ]
    captures = 0
    for game in games:
        recording, key = Recording.read(ran / game["recording"]), (game["participant"], game["step"])
        is_late = game["condition"].startswith("late")
        sizes = int(game["drones"]), int(game["opponent_drones"])
        assert sizes == ((3, 4) if is_late else (3, 3)), "the late ones are blue, against four"
        own = [row for row in table(out, "commands") if (row["participant"], row["step"]) == key]
        told = [(line.number, line.tick, line.density) for line in recording.of(CommandLine)]
        assert [(int(row["number"]), int(row["tick"]), json.loads(row["values"])) for row in own] == told
        assert sum(row["by"] == "participant" for row in own) == int(game["commands"])
        assert {row["side"] for row in own if row["by"] == "participant"} == {game["side"]}
        taken = [row for row in table(out, "captures") if (row["participant"], row["step"]) == key]
        lines = recording.of(CapturedLine)
        assert [(int(row["tick"]), int(row["drone"])) for row in taken] == [(line.tick, line.drone) for line in lines]
        assert [row["by_participant"] for row in taken] == [str(row["side"] == game["side"]).lower() for row in taken]
        share = int(taken[-1]["drones"]) / sum(sizes) if taken else sizes[0] / sum(sizes)
        assert share == pytest.approx(float(game["final_share"]), abs=1e-6)
        captures += len(taken)
        ended = recording.end.outcome
        assert (game["decided"], game["won"]) == (str(ended != "draw").lower(), str(ended == game["side"]).lower())
        delays = [float(game[f"{name}_delay_asked_ms"]) for name in ("command", "display")]
        assert delays == ([300.0, 100.0] if is_late else [0.0, 0.0]) and float(game["command_delay_got_ms"]) == 301.5
    assert captures, "or these games show nothing"
    by_start = {(game["condition"], game["practice"], game["game"]): game["seed"] for game in games}
    assert len(set(by_start.values())) == 3  # the same in each condition
    assert [row["finished"] for row in table(out, "participants")] == ["true", "false"]


def test_games_that_were_broken_off_have_a_table_of_their_own(ran, out):
    """Else nobody who reads the data knows that a participant has seen a start before."""
    rows = table(out, "interrupted")
    both = {"participant": "P02", "step": "block2.game1", "block": "2", "game": "1", "practice": "false"}
    both |= {"condition": "drawing", "side": "red", "opponent": "uniform"}
    assert all(both.items() <= row.items() and row["started"] for row in rows)
    assert [(row["attempt"], row["ended_by"]) for row in rows] == [("1", "server"), ("2", "")]
    assert [row["commands"] for row in rows] == ["2", "1"]
    assert float(rows[1]["seconds"]) < float(rows[0]["seconds"]) == 3.0
    assert all((ran / row["recording"]).exists() for row in rows)


def test_a_participant_has_their_consent_their_order_their_times_and_the_wins_that_count(ran, out, tmp_path):
    """A board asks who agreed to which text, and when."""
    lines = [json.loads(line) for line in (ran / "participants" / "P01.jsonl").read_text().splitlines()]
    row = table(out, "participants")[0]
    assert row["consent_sha256"] == hashlib.sha256((ran / "study" / "consent.md").read_bytes()).hexdigest()
    assert row["consent_version"] == "2026-03" and float(row["consent_at"]) == pytest.approx(lines[1]["at"], abs=1e-6)
    playing.begin(tmp_path)
    outcomes = {"practice1": "win", "game1": "loss", "game2": "win"}
    lines = [{"type": "participant", "number": 1, "study": "Two interfaces, tried", "seed": 7}]
    lines += [{"step": f"block1.{name}", "outcome": told, "at": 5.0 + len(name)} for name, told in outcomes.items()]
    (tmp_path / "participants").mkdir()
    (tmp_path / "participants" / "P02.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (row,) = read_study(tmp_path).participants
    assert (row.participant, row.number, row.order) == ("P02", 1, "late (300 ms) > drawing")
    assert (row.games, row.practice_games, row.wins, row.began_at, row.ended_at) == (2, 1, 1, 10.0, 14.0)


def test_a_command_tells_when_it_was_followed_and_where_it_points(out):
    own = next(row for row in table(out, "commands") if row["by"] == "participant")
    assert (own["in_force_tick"], float(own["to_in_force_ms"]), float(own["drawing_ms"])) == ("0", 28.0, 500.0)
    assert (float(own["centre_x"]), float(own["centre_y"])) == (pytest.approx(0.35), pytest.approx(0.05))
    for row in table(out, "commands"):
        assert float(row["seconds"]) == pytest.approx(int(row["tick"]) / 30, abs=1e-6)
        assert row["to_painted_ms"] == ("48.0" if row["by"] == "participant" and row["to_in_force_ms"] else "")


def test_forms_hold_answers_and_scores_and_columns_of_parquet_have_types_where_they_are_empty(out):
    forms = {(row["participant"], row["step"], row["item"]): row for row in table(out, "forms")}
    score = forms["P01", "block1.form.sus", "sus"]
    assert (score["kind"], float(score["value"]), score["condition"]) == ("score", 75.0, "drawing")
    age, words = forms["P01", "start.form.background", "age"], forms["P01", "start.form.background", "words"]
    assert (age["value"], age["block"], age["condition"], age["question"]) == ("40.0", "", "", "Your age?")
    assert words["answer"] == "'" + playing.ANSWERS["background"]["words"]  # no spreadsheet's formula
    read = {name: pyarrow.parquet.read_table(out / "tables" / f"{name}.parquet") for name in TABLES}
    assert {name: len(one) for name, one in read.items()} == {name: len(table(out, name)) for name in TABLES}
    assert str(read["forms"].schema.field("value").type) == "double"
    assert playing.ANSWERS["background"]["words"] in read["forms"]["answer"].to_pylist()  # as it was


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


# --- data sets ------------------------------------------------------------------------------------


def test_events_are_as_bids_has_them(out):
    bids = out / "bids"
    assert {"Name", "BIDSVersion", "DatasetType"} <= set(json.loads((bids / "dataset_description.json").read_text()))
    people = rows_of(bids / "participants.tsv", "excel-tab")
    assert [next(iter(one.items())) for one in people] == [("participant_id", "sub-P01"), ("participant_id", "sub-P02")]
    assert set(json.loads((bids / "participants.json").read_text())) == set(people[0]) - {"participant_id"}
    events = sorted(bids.rglob("*_events.tsv"))
    assert len(events) == len(table(out, "games"))
    name = re.compile(r"sub-[a-zA-Z0-9]+/beh/sub-[a-zA-Z0-9]+_task-[a-zA-Z0-9]+(_acq-practice)?_run-[0-9]+_events\.tsv")
    for path in events:
        assert name.fullmatch(path.relative_to(bids).as_posix())
        sidecar = json.loads(path.with_suffix(".json").read_text())
        assert all(isinstance(told, dict) for told in sidecar.values())
        rows = rows_of(path, "excel-tab")
        assert list(rows[0])[:2] == ["onset", "duration"] and set(rows[0]) <= set(sidecar)
        assert {row["trial_type"] for row in rows} <= set(sidecar["trial_type"]["Levels"])
        onsets = [float(row["onset"]) for row in rows]
        assert onsets == sorted(onsets)
        assert all(value for row in rows for value in row.values())  # n/a, never nothing
    known = r"(README|_events\.(tsv|json)|participants\.(tsv|json)|dataset_description\.json)$"
    assert all(re.search(known, path.name) for path in bids.rglob("*") if path.is_file())


def test_events_are_of_the_clock_whatever_the_speed(ran, out):
    for game in table(out, "games"):
        task = "late300ms" if game["condition"].startswith("late") else "drawing"
        practice, who = "_acq-practice" if game["practice"] == "true" else "", f"sub-{game['participant']}"
        path = out / "bids" / who / "beh" / f"{who}_task-{task}{practice}_run-{game['game']}_events.tsv"
        rows, recording = rows_of(path, "excel-tab"), Recording.read(ran / game["recording"])
        speed = 2.0 if task == "late300ms" else 1.0
        of = {row["trial_type"]: [one for one in rows if one["trial_type"] == row["trial_type"]] for row in rows}
        (whole,) = of["game"]
        assert float(whole["onset"]) == 0.0 and whole["side"] == game["side"]
        assert float(whole["duration"]) == pytest.approx(recording.end.tick / 30 / speed, abs=1e-5)
        for row, line in zip(of.get("capture", []), recording.of(CapturedLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.tick / 30 / speed, abs=1e-5)
            assert (row["actor"] == "participant") == (TEAM_NAMES[line.team] == game["side"])
        for row, line in zip(of["command_received"], recording.of(CommandLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.received_ms / 1000, abs=1e-5)
        for row, line in zip(of["command_in_force"], recording.of(InForceLine), strict=True):
            assert float(row["onset"]) == pytest.approx(line.ms / 1000, abs=1e-5)


def test_tables_are_as_psych_ds_has_them(out):
    folder = out / "psychds"
    described = json.loads((folder / "dataset_description.json").read_text())
    assert (described["@type"], described["@context"]) == ("Dataset", "https://schema.org/")
    assert all(described[field] for field in ("name", "description", "variableMeasured"))
    known = [one["name"] for one in described["variableMeasured"]]
    assert len(set(known)) == len(known)
    files = sorted((folder / "data").iterdir())
    assert len(files) == len(TABLES)
    for path in files:
        # The validator's expression for names.
        assert re.fullmatch(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv", path.name)
        header, *rows = csv.reader(io.StringIO(path.read_text(encoding="utf-8")))
        assert len(set(header)) == len(header) and set(header) <= set(known)
        assert {len(row) for row in rows} <= {len(header)}


def test_labels_are_plain_and_differ():
    names = ["Drawing!", "drawing", "Größe 1", "…", "draw-ing"]
    assert list(labels(names, "condition").values()) == ["Drawing", "drawingx2", "Groe1", "condition", "drawingx3"]


# --- the report -----------------------------------------------------------------------------------


def test_the_report_tells_what_was_found_in_percent_and_seconds(ran, out):
    text, games = (out / "report.md").read_text(), counted_games(read_study(ran))
    assert "2 of 2 participants, of whom 1 did all of it; 6 games count, and 4 of practice do not." in text
    for row, start in zip(conditions(games), ("| drawing | 1 | 2 ", "| late (300 ms) | 2 | 4 "), strict=True):
        assert row.low < row.high
        assert f"{start}| {100 * row.win_rate:.0f} % | {100 * row.low:.0f} to {100 * row.high:.0f} %" in text
    won, lasted = compare(games)
    assert f"| share won | drawing less late (300 ms) | 1 | {100 * won.difference:+.1f} % | any: too few" in text
    assert f"| mean length | drawing less late (300 ms) | 1 | {lasted.difference:+.1f} s |" in text
    assert "- `sus`: drawing 75.0, late (300 ms) 75.0" in text and "| `sus` | drawing less late (300 ms) | 1 |" in text
    assert "3 comparisons" in text and "swarm-pz study export ran" in text
    assert (out / "comparison.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("sign", ["<b>a</b>", "[a](b)", "a|b", "*a*", "`a`", "&amp;", "# a", "![a](b)", "a_b_"])
def test_a_title_is_text_and_neither_markdown_nor_html(sign):
    page = MarkdownIt("commonmark").enable("table")
    assert page.render(f"# {markdown(sign)}\n") == f"<h1>{html.escape(sign)}</h1>\n"
    assert f"<td>{html.escape(sign)}</td>" in page.render(f"| a |\n|---|\n| {markdown(sign)} |\n")


def test_titles_are_escaped_wherever_they_stand(small, tmp_path):
    data = read_study(small)
    data = replace(data, study=data.study.replace(title="<b>"), faults=["a <b>"])
    write_report(data, tmp_path)
    write_psychds(data, tmp_path / "psychds")
    texts = [(tmp_path / name).read_text() for name in ("report.md", "psychds/README.md")]
    for text in (*texts, codebook_text("<b>")):
        assert "\\<b\\>" in text and "<b" not in text.replace("\\<b", "")
    assert "No game that counts is over yet." in texts[0]


def test_games_count_by_the_order_of_the_study_but_practice_and_those_that_a_fault_ended(ran):
    data = read_study(ran)
    for games in (data.games, data.games[::-1]):
        counted = counted_games(replace(data, games=games))
        assert [game.condition for game in counted] == ["drawing"] * 2 + ["late (300 ms)"] * 4
    for ended_by, count in (("server", 0), ("forfeit", 0), ("left", 6)):  # the condition may have made them leave
        ended = replace(data, games=[replace(game, ended_by=ended_by) for game in data.games])
        assert len(counted_games(ended)) == count


def test_a_planted_difference_is_found_and_told(tmp_path):
    study = playing.begin(tmp_path, playing.TEXT.replace("participants = 2", "participants = 8"))
    playing.simulate(tmp_path, study, 0.6, 1)
    won, _ = write_report(read_study(tmp_path), tmp_path)
    text = (tmp_path / "report.md").read_text()
    assert won.p < 0.05 and won.low > 0.0
    assert f"| 8 | {100 * won.difference:+.1f} % | {100 * won.low:+.1f} to {100 * won.high:+.1f} % |" in text
    assert "8 of 8 participants, of whom 0 did all of it" in text


# --- whole or not at all --------------------------------------------------------------------------


def test_an_export_is_replaced_only_if_told_and_nothing_else_ever(small, tmp_path):
    goal, other = tmp_path / "out", tmp_path / "other"
    export(small, goal)
    (goal / "tables" / "mine.txt").write_text("")
    with pytest.raises(OutputError, match="--overwrite"):
        export(small, goal)
    export(small, goal, overwrite=True)
    assert not (goal / "tables" / "mine.txt").exists()
    other.mkdir()
    (other / "thesis.txt").write_text("")
    for wrong, said in ((other, "is no export"), (other / "thesis.txt", "a file"), (small / "out", "outside")):
        with pytest.raises(OutputError, match=said):
            export(small, wrong, overwrite=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other", "out", "small"]


def test_an_export_that_fails_leaves_what_was_there(small, tmp_path, monkeypatch):
    goal = tmp_path / "out"
    export(small, goal)
    before = sorted(goal.rglob("*"))

    def fail(*given):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(module, "write_report", fail)
        for folder in (goal, tmp_path / "another"):
            with pytest.raises(OutputError, match="no space left"):
                export(small, folder, overwrite=True)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match="pyarrow"):
        export(small, tmp_path / "another")
    assert sorted(goal.rglob("*")) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "small"]


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
    assert len(found.data.faults) == 6
    for fault in (
        "P02.jsonl is no participant",
        "line 1 of",
        "P04.jsonl is empty",
        "not one of a recorded game",
        "is not in the study's folder",
        "P01: block9.game1 is no step",
    ):
        assert any(fault in told for told in found.data.faults), fault
    assert [game.commands is None for game in found.data.games] == [False, True, True]
    assert all(markdown(fault) in (tmp_path / "out" / "report.md").read_text() for fault in found.data.faults)


def test_what_its_own_data_contradict_is_told(tmp_path):
    study = playing.begin(tmp_path)
    playing.run(tmp_path, study, 0, until="block2.game1")
    assert read_study(tmp_path).faults == []
    path = tmp_path / "participants" / "P01.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    game, form = (next(line for line in lines[1:] if name in line["step"]) for name in (".game1", ".form.sus"))
    told, scores = game["outcome"], form["scores"]
    game["outcome"], form["scores"] = "draw", {"sus": 99.0}
    path.write_text("".join(json.dumps(line) + "\n" for line in [*lines, lines[2]]))
    assert read_study(tmp_path).faults == [
        f"P01: {lines[2]['step']} does not stand in its turn, or twice; the last one counts",
        f"P01: {game['step']}: the outcome was 'draw', its recording says {told!r}",
        f"P01: {form['step']}: the answers come to {scores}, but {{'sus': 99.0}} stands there",
    ]


def test_a_folder_without_a_study_or_without_participants_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no study has run"):
        export(tmp_path / "s", tmp_path / "out")
    playing.begin(tmp_path / "s")
    with pytest.raises(RecordingError, match="nobody"):
        export(tmp_path / "s", tmp_path / "out")
    assert not (tmp_path / "out").exists()
