"""A report is the same however it was made, and an invalid entry is refused."""

import json
import shlex
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, KindError, PolicyError, ResultsError, Stopped, WorkerError
from swarm_pz.policy import allow_files, load
from swarm_pz.standard import Entry, attacks, run
from swarm_pz.standard.report import COST, GAMES, REPORT, read_report
from swarm_pz.standard.running import cost_of
from swarm_pz.training.search import Target
from tests.elsewhere import Elsewhere

BOTS = Path(__file__).parents[2] / "examples" / "bots"
TWO = Entry(policies=("champion", "ring"), name="two")


def read(folder):
    """Return the report and the lines of its games."""
    return read_report(folder), [json.loads(line) for line in (folder / GAMES).read_text().splitlines()]


def without_costs(report):
    return {name: value for name, value in report.items() if name != COST}


def test_a_report_holds_all_that_others_need(reported):
    report, lines = read(reported)
    trials, attackers = 5, 1 + 3 + 1 + 2  # itself, those searched for, learned ones, and public ones
    assert report["games"] == len(lines) == 2 * (trials * (4 + 2) + attackers * 4 + 6)
    kinds = {line["opponent"].partition(":")[0].split()[0] for line in lines if line["track"] == "choice"}
    assert kinds >= {"itself", "pattern", "learned", "ring"}
    assert set(report["figures"]["tracks"]) == {"uniform", "field", "generated", "systems", "robust"}
    assert report[COST]["policies"][0]["commands"] > 10**6 and report[COST]["policies"][0]["parameters"] > 1000
    assert report[COST]["policies"][1] == dict.fromkeys(report[COST]["policies"][0]) | {"at_least": []}
    assert str(reported) not in json.dumps(without_costs(report))


def test_costs_of_ancestors_add_up_and_are_a_bound_where_one_is_unknown():
    game = GameConfig()
    hunter, champion, finisher = (cost_of(load(name, game)) for name in ("hunter", "champion", "finisher"))
    assert (hunter["commands"], hunter["at_least"]) == (3_000_320, [])
    assert champion["commands"] == 10_223_616 + 3_000_000 + 3_000_320 and "commands" in champion["at_least"]
    assert finisher["commands"] > champion["commands"] + 28_000_000 and finisher["seconds"] > champion["seconds"]
    foreign = SimpleNamespace(card={"steps": 5, "training": {"start_from": "runs/lost"}})
    assert (cost_of(foreign)["commands"], cost_of(foreign)["at_least"]) == (5, ["commands"])


def test_a_run_that_was_stopped_again_and_again_makes_the_same_report(reported, tiny, tmp_path):
    for questions in (4, 30):
        answers = iter([False] * questions)
        with pytest.raises(Stopped):
            run(TWO, tmp_path, protocol=tiny, should_stop=lambda answers=answers: next(answers, True))
    run(TWO, tmp_path, protocol=tiny)
    (again, games), (once, once_games) = read(tmp_path), read(reported)
    assert games == once_games and without_costs(again) == without_costs(once)


def test_other_machines_make_the_same_report_and_nothing_is_learned_twice(reported, tiny, tmp_path):
    (empty := tmp_path / "empty").mkdir()
    pool = Elsewhere(empty)
    run(TWO, Path("there"), protocol=tiny, pool=pool)
    assert set(pool.submitted) == {"learn", "play_block", "worth"} and pool.submitted.count("learn") == 2
    assert (Path("there") / GAMES).read_bytes() == (reported / GAMES).read_bytes()
    assert without_costs(read(Path("there"))[0]) == without_costs(read(reported)[0])
    assert not list(empty.iterdir()) and not list(Path("there/work").glob("exploiter-*"))
    for place in ("exploiters/0", "exploiters/1"):
        for file in (reported / place).iterdir():
            assert (Path("there") / place / file.name).read_bytes() == file.read_bytes()
    run(TWO, Path("there"), protocol=tiny, pool=(after := Elsewhere(empty)))
    assert after.submitted == [], "nothing is left to be done"


def test_a_program_can_be_measured(tiny, tmp_path):
    shutil.copy(BOTS / "ring.py", tmp_path)
    name = f"exec:{sys.executable} {tmp_path / 'ring.py'}"
    allow_files([name])
    few = replace(tiny.attacks_alone(320), robust=replace(tiny.robust, exploiters=1, candidates=2))
    report = run(Entry(policies=(name,), name="robot"), tmp_path / "out", protocol=few)
    assert [policy["kind"] for policy in report["policies"]] == ["program"]
    assert not any(line["forfeit"] for line in read(tmp_path / "out")[1])


def test_a_program_that_fails_is_refused_before_games_are_played(tiny, tmp_path):
    greets = "import sys; print('{\"swarm_pz\": 1}', flush=True); [sys.exit(3) for line in sys.stdin if 'see' in line]"
    for text, message in (("0", "must answer the greeting"), (greets, "but ended with status 3")):
        name = f"exec:{sys.executable} -c {shlex.quote(text)}"
        allow_files([name])
        with pytest.raises(PolicyError, match=message):
            run(Entry(policies=(name,), name="robot"), tmp_path / message[:3], protocol=tiny)
    assert not list(tmp_path.glob("*/work/uniform"))


def test_a_worker_with_another_policy_of_the_name_learns_nothing(tiny):
    with pytest.raises(WorkerError, match=r"expected digest 0{32}"):
        attacks.learn(Target("champion", tiny.game, "0" * 32), 0, tiny, None, lambda: False)


@pytest.mark.parametrize(
    ("policy", "error", "message"),
    [
        ("halo", ResultsError, "holds the report of other policies"),
        ("prowl", KindError, "policies that answer densities"),
        ("rong", PolicyError, "no policy 'rong'"),
    ],
)
def test_another_entry_or_a_policy_that_cannot_play_is_refused(policy, error, message, reported, tiny):
    with pytest.raises(error, match=message):
        run(Entry(policies=(policy,), name=policy), reported, protocol=tiny)


@pytest.mark.parametrize(
    "fields", [{"policies": ()}, {"policies": ("ring", "ring")}, {"name": "two\nlines"}, {"name": ""}]
)
def test_an_entry_that_cannot_be_is_refused(fields):
    with pytest.raises(ConfigError, match=next(iter(fields))):
        Entry(**{"policies": ("ring",), "name": "ring"} | fields)


@pytest.mark.parametrize(
    "content", [b"", b"[" * 100_000, b"[1]", b"\xff\xfe", b'{"format": 2}'],
    ids=["empty", "deep", "a list", "no text", "an old format"],
)  # fmt: skip
def test_a_file_that_is_no_report_is_refused(tmp_path, content):
    with pytest.raises(ResultsError, match="there is no report in"):
        read_report(tmp_path)
    (tmp_path / REPORT).write_bytes(content)
    with pytest.raises(ResultsError, match=r"is corrupt|is no report of format"):
        read_report(tmp_path)
