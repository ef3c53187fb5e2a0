"""Studies as files: what they may say, and who meets what in which order."""

import itertools
import os
from collections import Counter

import pytest

from swarm_pz.errors import ConfigError
from swarm_pz.play.studies.design import Condition, Study, balanced_order, check_code, draw_codes
from tests.play.studies.playing import PLAIN, written

ONE = 'title = "t"\nparticipants = 1\n[[conditions]]\ntitle = "a"\n'


def orders(study, count):
    return [[one.title for one in study.order_of(person)] for person in range(count)]


@pytest.mark.parametrize("count", range(1, 6))
def test_a_balanced_order_has_all_at_each_place_and_after_each_other_equally_often(count):
    rows = balanced_order(count)
    assert len(rows) == (count if count % 2 == 0 or count == 1 else 2 * count)
    assert all(sorted(row) == list(range(count)) for row in rows)
    for place in range(count):
        assert set(Counter(row[place] for row in rows).values()) == {len(rows) // count}
    followed = Counter(pair for row in rows for pair in itertools.pairwise(row))
    assert set(followed.values()) <= {len(rows) // count}
    assert len(followed) == count * (count - 1)


def test_a_file_becomes_a_study_in_which_everybody_meets_the_same_games(tmp_path):
    study = written(tmp_path)
    assert study.conditions[1].game(study.rules).team_sizes == (4, 3)
    assert study.conditions[0].game(study.rules).time_limit == 6.0
    assert study.text(study.consent) == "# Will you?"
    assert orders(study, 3) == [["drawing", "late"], ["late", "drawing"], ["drawing", "late"]]
    assert [form.when for form in study.forms] == ["block", "start"]
    ordered = study.replace(order=(("late", "drawing"), ("drawing",)))
    assert orders(ordered, 3) == [["late", "drawing"], ["drawing"], ["late", "drawing"]]
    seeds = [study.seed_of(game) for game in range(50)]
    assert len(set(seeds)) == 50
    assert not set(seeds) & {study.seed_of(game, practice=True) for game in range(50)}
    assert seeds != [study.replace(seed=8).seed_of(game) for game in range(50)]
    (tmp_path / "study.toml").write_bytes(b"\xef\xbb\xbf" + ONE.replace("\n", "\r\n").encode())
    assert Study.read(tmp_path / "study.toml").title == "t", "of Windows, with its mark of bytes"
    with pytest.raises(ConfigError, match=r"begun by \[\[forms\]\]"):
        written(tmp_path, f'forms = "sus"\n{ONE}')


@pytest.mark.parametrize(("side", "flown"), [("red", ("direct", "ergodic")), ("blue", ("ergodic", "direct"))])
def test_a_conditions_system_flies_its_participant_and_a_policy_is_flown_as_ever(side, flown):
    assert Condition(title="x", system="direct", side=side).game({}).team_controllers == flown


def test_two_who_meet_go_the_same_way(tmp_path):
    text = PLAIN.replace('title = "late"', 'title = "late"\nopponent = "person"\nsystem = "flocking"')
    with pytest.raises(ConfigError, match="a multiple of 4"):
        written(tmp_path, text.replace("participants = 4", "participants = 6"))
    study = written(tmp_path, text)
    assert orders(study, 4) == [["drawing", "late"]] * 2 + [["late", "drawing"]] * 2
    assert study.conditions[1].game(study.rules).team_controllers == ("flocking", "flocking")
    assert orders(study.replace(order=(("late",), ("drawing",))), 4) == [["late"]] * 2 + [["drawing"]] * 2
    with pytest.raises(ConfigError, match="even"):
        study.replace(order=(("late",),), participants=3, codes=())


def conditions(*rows):
    return tuple(Condition(title=f"c{number}", **fields) for number, fields in enumerate(rows))


def test_whatever_conditions_vary_is_a_factor_and_all_combinations_make_a_factorial_design():
    late, helped = {"command_delay_ms": 300.0}, {"share": 0.5, "helper": "ring"}
    study = Study(title="t", participants=4, conditions=conditions({}, late, helped, late | helped))
    assert list(study.factors) == ["command_delay_ms", "share", "helper"] and list(study.crossed) == [
        "command_delay_ms",
        "share",
    ], "the helper follows from its share"
    assert study.crossed["command_delay_ms"] == {"c0": "0", "c1": "300", "c2": "0", "c3": "300"}
    assert study.between == () and study.replace(order=(("c0", "c1"), ("c3", "c2"))).between == ("share", "helper")
    assert Study(title="t", participants=6, conditions=conditions({}, late, helped)).crossed == {}, (
        "one cell is missing"
    )
    nested = {"rules": {"capture": {"threshold": 0.5}}, "hide": ("opponents", "trails")}
    study = Study(title="t", participants=2, conditions=conditions({}, nested))
    assert {name: of["c1"] for name, of in study.factors.items()} == {
        "hide": "opponents+trails",
        "capture_threshold": "0.5",
    }
    fields = [{"levels": {"advice": word}} | more for word, more in (("no", late), ("yes", {}))]
    study = Study(title="t", participants=2, conditions=conditions(*fields))
    assert list(study.factors) == ["command_delay_ms", "advice"] and list(study.crossed) == ["advice"]
    with pytest.raises(ConfigError, match="levels must be of every condition"):
        study.replace(conditions=conditions(fields[0], {}))


MANY = "".join(f'[[conditions]]\ntitle = "{n}"\n' for n in range(51))


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("participants = 4", "participants = 3", "a multiple of 2"),
        ("participants = 4", 'order = [["drawing", "lat"]]\nparticipants = 3', "'lat'; did you mean 'late'"),
        ('title = "late"', 'title = "late"\nsystem = "flocking"\nshare = 0.5\nhelper = "ring"', "cannot share"),
        ('title = "late"', 'title = "drawing"', "different titles"),
        ("command_delay_ms = 300", "command_delay_ms = -1", "condition 'late': command_delay_ms"),
        ("time_limit = 6.0", "time_limit = 3601.0", "at most an hour"),
        ('"consent.md"', '"agree.md"', "'agree.md' cannot be read"),
        ('"sus"', '"suss"', "no form 'suss'; did you mean 'sus'"),
        ("games = 2", "x = " + "[" * 100_000, "too deep"),
        ("games = 2", "#" + "a" * 2**20, "too large"),
        ("games = 2", 'folder = "/etc"', "folder must be left out"),
        ("games = 2", "games = 2\ncodes = ['a', 'A', 'b', 'c']", "4 different"),
    ],
)
def test_what_cannot_be_is_refused_by_name(before, after, said, tmp_path):
    assert before in PLAIN
    with pytest.raises(ConfigError, match=said):
        written(tmp_path, PLAIN.replace(before, after))


@pytest.mark.parametrize("code", ["", "..", "a/b", "a.b", "-a", "ä", "x" * 33, "Monitor", None])
def test_a_code_is_no_path(code):
    assert check_code("P-01_b") == "P-01_b"
    with pytest.raises(ConfigError, match="code"):
        check_code(code)


def test_codes_that_are_drawn_differ_and_are_long_whatever_the_studys_seed(tmp_path):
    """Anybody who reads the study's file could compute codes that follow from it."""
    first, second = draw_codes(1000), draw_codes(1000)
    assert len({*first, *second}) == 2000
    assert all(check_code(code) and len(code) == 10 and not set(code) & set("01OILAEU") for code in first)
    study = written(tmp_path)
    assert study.codes == () and study.name_of(2) == "P03" and study.replace(participants=1000).name_of(2) == "P0003"


@pytest.mark.parametrize("name", ["{0}/words.md", "../{1}/words.md", "sub/../words.md", "a\\u0000b", "link", "pipe"])
def test_texts_are_named_as_they_stand_beside_the_file_and_no_pipe_is_waited_for(tmp_path, name):
    plan = tmp_path / "plan"
    (plan / "sub").mkdir(parents=True)
    (plan / "words.md").write_text("Hello")
    (tmp_path / "secret").write_text("secret")
    (plan / "link").symlink_to(tmp_path / "secret")
    os.mkfifo(plan / "pipe")
    welcome = f'welcome = "{name.format(plan.as_posix(), plan.name)}"\n'
    with pytest.raises(ConfigError, match=r"by its name there|a regular file"):
        written(plan, welcome + ONE)
