"""The export of a study: a Psych-DS data set with a report; whole or not at all."""

import csv
import datetime
import html
import io
import json
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from swarm_pz.errors import MissingExtraError, OutputError, RecordingError
from swarm_pz.play.protocol import CapturedMessage, SeatCommand
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.studies import export as module
from swarm_pz.play.studies.analysis import conditions
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.export import export
from swarm_pz.play.studies.reading import read_study
from swarm_pz.play.studies.report import counted_games, markdown, write_report
from swarm_pz.play.studies.rows import TABLES
from tests.play.studies.playing import ANSWERS, PLAIN, begun, walk


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """Give the folder of a study in which one participant has done all, and another is in the middle."""
    place = tmp_path_factory.mktemp("ran")
    with begun(place, PLAIN.replace("most = 3", "most = 1")) as folder:
        walk(folder, 0, ticks=1000, outcome=None)
        walk(folder, 1, until="block2.game1", ticks=1000, outcome=None)
    with (place / "data" / "participants" / "P02.jsonl").open("ab") as file:
        file.write(b'{"step": "block2.ga')  # it is being written
    return place / "data"


@pytest.fixture(scope="module")
def out(ran, tmp_path_factory):
    """Give the study's export, which left the study unchanged."""
    folder = tmp_path_factory.mktemp("out") / "published"
    before = {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()}
    export(ran, folder, command="swarm-pz study export ran")
    assert {path: path.read_bytes() for path in ran.rglob("*") if path.is_file()} == before
    return folder


def table(out, name):
    with (out / "data" / f"description-{name}_data.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


# --- tables ---------------------------------------------------------------------------------------


def test_tables_hold_a_row_for_each_thing_that_happened(ran, out):
    games, commands, captures = (table(out, name) for name in ("games", "commands", "captures"))
    assert [(game["participant"], game["step"]) for game in games] == [
        *(("P01", f"block{block}.{step}") for block in (1, 2) for step in ("practice1", "game1", "game2")),
        *(("P02", step) for step in ("block1.practice1", "block1.game1", "block1.game2", "block2.practice1")),
    ]
    for game in games:
        recording, key = Recording.read(ran / game["recording"]), (game["participant"], game["step"])
        is_late = game["condition"] == "late"
        sizes = int(game["drones"]), int(game["opponent_drones"])
        assert sizes == ((3, 4) if is_late else (3, 3)), "the late ones are blue, against four"
        own = [row for row in commands if (row["participant"], row["step"]) == key]
        recorded = [(line.number, line.tick, line.density) for line in recording.of(SeatCommand)]
        assert [(int(row["number"]), int(row["tick"]), json.loads(row["values"])) for row in own] == recorded
        assert sum(row["by"] == "participant" for row in own) == int(game["commands"])
        assert {row["side"] for row in own if row["by"] == "participant"} == {game["side"]}
        taken = [row for row in captures if (row["participant"], row["step"]) == key]
        lines = recording.of(CapturedMessage)
        assert [(int(row["tick"]), int(row["drone"])) for row in taken] == [(line.tick, line.drone) for line in lines]
        assert [row["by_participant"] for row in taken] == [str(row["side"] == game["side"]).lower() for row in taken]
        share = int(taken[-1]["drones"]) / sum(sizes) if taken else sizes[0] / sum(sizes)
        assert share == pytest.approx(float(game["final_share"]), abs=1e-6)
        ended = recording.end.outcome
        assert (game["decided"], game["won"]) == (str(ended != "draw").lower(), str(ended == game["side"]).lower())
        delays = [float(game[f"{name}_delay_asked_ms"]) for name in ("command", "display")]
        assert delays == ([300.0, 100.0] if is_late else [0.0, 0.0]) and float(game["command_delay_got_ms"]) == 301.5
        assert game["display_delay_count"] == str(int(is_late))
    assert captures, "or these games show nothing"
    by_start = {(game["condition"], game["practice"], game["game"]): game["seed"] for game in games}
    assert len(set(by_start.values())) == 3  # the same in each condition
    one = next(row for row in commands if row["by"] == "participant")
    assert (one["in_force_tick"], float(one["drawing_ms"])) == ("0", 500.0)
    assert (float(one["centre_x"]), float(one["centre_y"])) == (pytest.approx(0.35), pytest.approx(0.05))
    assert all(float(row["seconds"]) == pytest.approx(int(row["tick"]) / 30, abs=1e-6) for row in commands)
    first, second = table(out, "participants")
    assert (first["participant"], first["number"], first["order"]) == ("P01", "0", "drawing > late")
    assert (first["finished"], second["finished"]) == ("true", "false")
    lines = lines_of(ran / "participants" / "P01.jsonl")[1:]
    day = datetime.datetime.fromtimestamp(lines[0]["at"], datetime.UTC).date().isoformat()
    assert first["consent_day"] == day, "a board asks who agreed, and when"
    seconds = {line["step"]: round(line["at"] - lines[0]["at"]) for line in lines}
    assert all(float(game["after_s"]) == seconds[game["step"]] for game in games if game["participant"] == "P01")


def test_forms_hold_answers_and_scores(out):
    forms = {(row["participant"], row["step"], row["item"]): row for row in table(out, "forms")}
    score, written = forms["P01", "block1.form.sus", "sus"], ANSWERS["background"]["words"]
    assert (score["kind"], float(score["value"]), score["condition"]) == ("score", 75.0, "drawing")
    age, words = forms["P01", "start.form.background", "age"], forms["P01", "start.form.background", "words"]
    assert (age["value"], age["block"], age["condition"], age["question"]) == ("40.0", "", "", "Your age?")
    assert words["answer"] == f"'{written}", "no spreadsheet's formula"


def test_whatever_conditions_vary_is_a_column_of_every_table(out):
    names = ["command_delay_ms", "display_delay_ms", "side", "speed", "drones_per_team"]
    levels = {"drawing": ["0", "0", "red", "1", "3"], "late": ["300", "100", "blue", "2", "4+3"]}
    for name in TABLES:
        for row in table(out, name):
            factors = {key.removeprefix("factor_"): value for key, value in row.items() if key.startswith("factor_")}
            assert factors == dict(zip(names, levels.get(row.get("condition"), [""] * 5), strict=True))


def test_what_was_asked_of_participants_is_published_without_their_codes(tmp_path):
    codes = "codes = [\n  'aa',  # Ann\n  'bb', 'cc', 'dd',\n]"
    for line in (codes, f'"{codes[:5]}"{codes[5:]}'):
        with begun(tmp_path / "in", PLAIN.replace("games = 2", f"games = 2\n{line}")) as folder:
            walk(folder, 0, until="block1.practice1")
        exported = export(tmp_path / "in" / "data", tmp_path / "out", overwrite=True)
        assert (tmp_path / "out" / "materials" / "consent.md").read_text() == "# Will you?"
        file = tmp_path / "out" / "materials" / "study.toml"
        if exported.faults:
            assert "codes" in exported.faults[0] and not file.exists()
        else:
            assert Study.read(file).title == "Two interfaces" and "'aa'" not in file.read_text()
        shutil.rmtree(tmp_path / "in")
    assert exported.faults, "of a file that hides them"


def test_the_pages_snippets_read_it(out, capsys):
    text = (Path(__file__).parents[3] / "docs" / "data.md").read_text()
    programs = [one for one in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S) if ">>>" not in one]
    for program in programs:
        exec(compile(program.replace("OUT/", f"{out}/"), "docs/data.md", "exec"), {})  # noqa: S102  (our own page)
    printed = capsys.readouterr().out
    assert len(programs) == 2
    assert "500.0" in printed and "75.0" in printed


def test_it_is_a_psych_ds_data_set_that_describes_every_column(out):
    described = json.loads((out / "dataset_description.json").read_text())
    assert (described["@type"], described["@context"]) == ("Dataset", "https://schema.org/")
    assert described["name"] and described["description"]
    known = {one["name"]: one for one in described["variableMeasured"]}
    assert len(known) == len(described["variableMeasured"])
    assert [name for name, one in known.items() if re.search(r"_(ms|s)$", name) and not one.get("unitText")] == []
    files = sorted((out / "data").iterdir())
    assert len(files) == len(TABLES)
    for path in files:
        # The validator's expression for names.
        assert re.fullmatch(r"([a-z]+-[a-zA-Z0-9]+)(_[a-z]+-[a-zA-Z0-9]+)*_data\.csv", path.name)
        header, *rows = csv.reader(io.StringIO(path.read_text(encoding="utf-8")))
        assert len(set(header)) == len(header) and set(header) <= set(known)
        assert {len(row) for row in rows} <= {len(header)}


# --- the report -----------------------------------------------------------------------------------


def test_the_report_tells_what_was_found_in_percent_and_seconds(ran, out, tmp_path):
    text, data = (out / "report.md").read_text(), read_study(ran)
    games = counted_games(data)
    assert "2 of 4 participants, of whom 1 did all of it; 6 games count, and 4 of practice do not." in text
    for row, start in zip(conditions(games), ("| drawing | 1 | 2 ", "| late | 2 | 4 "), strict=True):
        assert row.low < row.high
        assert f"{start}| {100 * row.win_rate:.0f} % | {100 * row.low:.0f} to {100 * row.high:.0f} %" in text
    with (out / "results.csv").open(newline="") as file:
        *effects, won, lasted, score = csv.DictReader(file)
    assert [one["effect"] for one in effects] == ["command_delay_ms"] * 3, "of which all else follows"
    assert float(effects[1]["difference"]) == -float(lasted["difference"])
    assert f"| share won | drawing less late | 1 | {100 * float(won['difference']):+.1f} % | any: too few" in text
    assert f"| mean length | drawing less late | 1 | {float(lasted['difference']):+.1f} s |" in text
    assert "- `sus`: drawing 75.0, late 75.0" in text and "| `sus` | drawing less late | 1 |" in text
    assert score["difference"] == "0.0" and "3 effects and 3 pairs" in text and "swarm-pz study export ran" in text
    many = [
        replace(game, participant=f"P{number}", won=(game.condition == "late") == (number > 0))
        for number in range(8)
        for game in games
    ]
    won = next(one for one in write_report(replace(data, games=many), tmp_path) if one.kind == "pair")
    row = f"| {100 * won.low:+.1f} to {100 * won.high:+.1f} % | 0.070 | 0.070 |"
    assert row in (tmp_path / "report.md").read_text()


def test_who_gave_wrong_answers_or_stopped_is_named_and_the_first_is_in_no_comparison(tmp_path):
    checked = PLAIN.replace('{ id = "words"', '{ id = "check", text = "Choose 7", correct = 7 },\n    { id = "words"')
    with begun(tmp_path, checked.replace("wins = 1", "wins = 0").replace("games = 2", "games = 1")) as folder:
        for number, check in enumerate((7, 1, 7)):
            progress = folder.progress(number)
            progress.finish(progress.next)
            progress.finish(progress.next, answers=ANSWERS["background"] | {"check": check})
            walk(folder, number, until="block1.form.sus")
        folder.progress(2).stop()
    data = export(tmp_path / "data", tmp_path / "out")
    people = [(row["failed"], row["stopped"], row["finished"]) for row in table(tmp_path / "out", "participants")]
    assert people == [("", "false", "false"), ("background", "false", "false"), ("", "true", "false")]
    assert {game.participant for game in counted_games(data)} == {"P01", "P03"}
    report = (tmp_path / "out" / "report.md").read_text()
    assert "Stopped before the end: P03." in report and "not right: P02 (background)" in report
    right = {row["participant"]: row["correct"] for row in table(tmp_path / "out", "forms") if row["item"] == "check"}
    assert right == {"P01": "true", "P02": "false", "P03": "true"}


def test_a_title_is_text_and_neither_markdown_nor_html():
    page, title = MarkdownIt("commonmark").enable("table"), "# a <b>a</b> [a](b) a|b *a* `a` &amp; ![a](b) _a_"
    assert page.render(f"# {markdown(title)}\n") == f"<h1>{html.escape(title)}</h1>\n"
    assert f"<td>{html.escape(title)}</td>" in page.render(f"| a |\n|---|\n| {markdown(title)} |\n")


def test_games_count_by_the_order_of_the_study_but_practice_and_those_that_a_fault_ended(ran):
    data = read_study(ran)
    for games in (data.games, data.games[::-1]):
        counted = counted_games(replace(data, games=games))
        assert [game.condition for game in counted] == ["drawing"] * 2 + ["late"] * 4
    for ended_by, count in (("server", 0), ("forfeit", 0), ("left", 6)):  # the condition may have made them leave
        ended = replace(data, games=[replace(game, ended_by=ended_by) for game in data.games])
        assert len(counted_games(ended)) == count


# --- whole or not at all --------------------------------------------------------------------------


def test_an_export_is_replaced_whole_if_told_and_nothing_else_ever(tmp_path, monkeypatch):
    goal, other = tmp_path / "out", tmp_path / "other"
    with begun(tmp_path / "in") as folder:
        walk(folder, 0, until="block1.game1")
    small = folder.path
    export(small, goal)
    (goal / "data" / "mine.txt").write_text("")
    with pytest.raises(OutputError, match="--overwrite"):
        export(small, goal)
    export(small, goal, overwrite=True)
    assert not (goal / "data" / "mine.txt").exists()
    before = sorted(goal.rglob("*"))
    other.mkdir()
    (other / "thesis.txt").write_text("")
    for wrong, message in ((other, "is no export"), (other / "thesis.txt", "a file"), (small / "out", "outside")):
        with pytest.raises(OutputError, match=message):
            export(small, wrong, overwrite=True)

    def fail(*given):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(module, "write_report", fail)
        for folder in (goal, tmp_path / "another"):
            with pytest.raises(OutputError, match="no space left"):
                export(small, folder, overwrite=True)
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(MissingExtraError, match="jinja2"):
        export(small, tmp_path / "another")
    assert sorted(goal.rglob("*")) == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "other", "out"]


def test_what_is_corrupt_is_left_out_and_told_and_titles_are_escaped_wherever_they_stand(tmp_path):
    with begun(tmp_path, PLAIN.replace("Two interfaces", "<b>")) as opened:
        walk(opened, 0, until="block1.form.sus")
    people, games = tmp_path / "data" / "participants", tmp_path / "data" / "games"
    (people / "P02.jsonl").write_text('{"type": "participant", "number": 1, "study": "another"}\n')
    (people / "P03.jsonl").write_text("{\n")
    (people / "P04.jsonl").write_text("")
    (people / "P05.jsonl").write_text("")
    (games / "P01.block1.game1.jsonl").write_text("{}\n")
    lines = lines_of(people / "P01.jsonl")
    lines[-1] |= {"recording": "../../secret.jsonl"}
    (people / "P01.jsonl").write_text("".join(f"{json.dumps(line)}\n" for line in (*lines, {"step": "block9.game1"})))
    exported, out = export(tmp_path / "data", tmp_path / "out"), tmp_path / "out"
    assert len(exported.faults) == 7
    for fault in (
        "P02.jsonl is of another study",
        "P05.jsonl is no participant",
        "line 1 of",
        "P04.jsonl is empty",
        "not one of a recorded game",
        "is not in the study's folder",
        "P01: block9.game1 is no step",
    ):
        assert any(fault in message for message in exported.faults), fault
    assert [game.commands is None for game in exported.games] == [False, True, True]
    report, *others = [(out / name).read_text() for name in ("report.md", "README.md")]
    assert all(f"- `{name}`: " in others[0] for name in (out / "results.csv").read_text().splitlines()[0].split(","))
    assert all(markdown(fault) in report for fault in exported.faults)
    for text in (report, *others):
        assert "\\<b\\>" in text and "<b" not in text.replace("\\<b", "")
    with begun(tmp_path / "begun") as opened:
        walk(opened, 0, until="block1.practice1")
    write_report(read_study(opened.path), tmp_path)
    assert "No game that counts is over yet." in (tmp_path / "report.md").read_text()


def test_a_study_without_participants_is_refused(tmp_path):
    with begun(tmp_path):
        pass
    with pytest.raises(RecordingError, match="nobody"):
        export(tmp_path / "data", tmp_path / "out")
    assert not (tmp_path / "out").exists()
