"""Questions, answers, and the scores of the forms that are known."""

import pytest

from swarm_pz.errors import ConfigError
from swarm_pz.play.studies.forms import KNOWN_FORMS, TLX_SCALES, Form, Item, sus_score, tlx_scores

SUS, TLX, RAW = KNOWN_FORMS["sus"], KNOWN_FORMS["nasa-tlx"], KNOWN_FORMS["nasa-tlx-raw"]


@pytest.mark.parametrize(("kind", "missing"), [(Form, "name"), (Item, "id")])
def test_what_lacks_a_field_is_told_which(kind, missing):
    with pytest.raises(ConfigError, match=f"{kind.__name__} needs the field '{missing}'"):
        kind.from_dict({})


def test_words_keep_no_control_characters_but_new_lines_and_tabs():
    assert Item(id="why", text="Why?", kind="text").read("a\0b\n\tc\x1b") == "ab\n\tc"


@pytest.mark.parametrize(
    ("points", "score"),
    [
        ([3] * 10, 50.0),
        ([5, 1] * 5, 100.0),
        ([1, 5] * 5, 0.0),
        ([5, 4, 2, 1, 2, 3, 2, 4, 5, 2], 55.0),  # the sheet in that paper: 22 points
    ],
)
def test_the_usability_score_is_that_of_its_sheet(points, score):
    assert sus_score(points) == score
    answers = SUS.read({f"sus_{place}": point for place, point in enumerate(points, 1)})
    assert SUS.scores(answers) == {"sus": score}


def test_the_task_load_is_weighed_by_the_choices_as_in_the_manual():
    # The worked example of the manual (NASA TLX 1.0): ratings and weights, 640 / 15.
    ratings = {"mental": 30, "physical": 15, "temporal": 60, "performance": 40, "effort": 30, "frustration": 40}
    weights = {"mental": 3, "physical": 0, "temporal": 5, "performance": 1, "effort": 3, "frustration": 3}
    chosen = [TLX_SCALES[scale][0] for scale, weight in weights.items() for _ in range(weight)]
    scores = tlx_scores(ratings, chosen)
    assert scores["tlx"] == pytest.approx((90 + 0 + 300 + 40 + 90 + 120) / 15)
    assert scores["tlx_raw"] == pytest.approx(215 / 6)
    assert tlx_scores(ratings, None) == {"tlx_raw": scores["tlx_raw"]}


def test_the_task_load_has_six_scales_and_all_fifteen_pairs():
    pairs = [set(item.choices) for item in TLX.items if item.kind == "pair"]
    assert len(TLX.items) == 21 and len(RAW.items) == 6
    assert len({frozenset(pair) for pair in pairs}) == 15
    answers = dict.fromkeys(TLX_SCALES, 50) | {item.id: item.choices[0] for item in TLX.items if item.kind == "pair"}
    assert TLX.scores(TLX.read(answers)) == {"tlx_raw": 50.0, "tlx": 50.0}
    assert RAW.scores(RAW.read(dict.fromkeys(TLX_SCALES, 5))) == {"tlx_raw": 5.0}


def test_a_scale_weighs_as_often_as_it_was_chosen_itself():
    """Of each pair the second counts more, so the scales weigh 0, 1, 2, 3, 4 and 5."""
    ratings = dict(zip(TLX_SCALES, (100, 80, 60, 40, 20, 5), strict=True))
    answers = ratings | {item.id: item.choices[1] for item in TLX.items if item.kind == "pair"}
    scores = TLX.scores(TLX.read(answers))
    assert scores["tlx"] == pytest.approx((80 + 2 * 60 + 3 * 40 + 4 * 20 + 5 * 5) / 15)
    assert scores["tlx_raw"] == pytest.approx(305 / 6)


def test_more_points_of_the_task_load_are_more_of_a_load():
    for form in (TLX, RAW):
        ends = {item.id: (item.low, item.high) for item in form.items if item.kind == "scale"}
        assert ends.pop("performance") == ("perfect", "failure"), "as on the sheet: failure is the load"
        assert set(ends.values()) == {("very low", "very high")} and len(ends) == 5


def test_every_second_statement_of_the_usability_scale_is_a_complaint_and_all_agree_at_the_right():
    complaints = ("complex", "support", "inconsistency", "cumbersome", "needed to learn")
    assert [any(word in item.text for word in complaints) for item in SUS.items] == [False, True] * 5
    assert {(item.low, item.high) for item in SUS.items} == {("strongly disagree", "strongly agree")}


def test_steps_are_counted_from_the_least():
    item = Item(id="a", text="?", least=1, most=9, step=2)
    assert [item.read(answer) for answer in (1, 3, 9)] == [1, 3, 9]
    with pytest.raises(ConfigError, match="from 1 to 9 in steps of 2, got 4"):
        item.read(4)


def test_answers_are_checked_by_question():
    form = Form(
        name="own",
        items=(
            Item(id="age", text="Your age?", kind="number", least=18, most=99),
            Item(id="hand", text="Your hand?", kind="choice", choices=("left", "right")),
            Item(id="words", text="Anything else?", kind="text", optional=True),
        ),
    )
    assert form.read({"age": 30, "hand": "left"}) == {"age": 30, "hand": "left", "words": None}
    assert form.scores({}) == {}
    for answers, said in (
        ({"age": 17, "hand": "left"}, "age must be a number from 18 to 99, got 17"),
        ({"age": True, "hand": "left"}, "age must be a number"),
        ({"age": 30, "hand": "both"}, "hand must be 'left' or 'right'"),
        ({"age": 30}, "hand must be an answer"),
        ({"age": 30, "hand": "left", "wrds": ""}, "did you mean 'words'"),
        ({"age": 30, "hand": "left", "words": "x" * 4001}, "at most 4000 characters"),
        ([1], "answers come by question"),
    ):
        with pytest.raises(ConfigError, match=said):
            form.read(answers)
    with pytest.raises(ConfigError, match="in steps of 5, got 52"):
        RAW.read(dict.fromkeys(TLX_SCALES, 52))


@pytest.mark.parametrize(
    ("item", "said"),
    [
        ({"id": "a b", "text": "?"}, "item.id must be a name"),
        ({"id": "a", "text": " "}, "item a: text must be words"),
        ({"id": "a", "text": "?", "kind": "slider"}, "item a: kind must be 'scale' or"),
        ({"id": "a", "text": "?", "least": 5, "most": 1}, "item a: most must be"),
        ({"id": "a", "text": "?", "kind": "choice", "choices": ("x",)}, "at least two different"),
        ({"id": "a", "text": "?", "kind": "pair", "choices": ("x", "y", "z")}, "choices must be two"),
    ],
)
def test_an_impossible_question_is_refused(item, said):
    with pytest.raises(ConfigError, match=said):
        Item(**item)
    with pytest.raises(ConfigError, match="questions of different ids"):
        Form(name="f", items=(Item(id="a", text="?"), Item(id="a", text="!")))
    with pytest.raises(ConfigError, match="at least one question"):
        Form(name="f")


@pytest.mark.parametrize(
    ("said", "more"),
    [
        ("score must be", {"score": "both"}),
        ("ten scales from 1 to 5", {"score": "sus"}),
        ("mental, physical", {"score": "nasa-tlx"}),
        (
            "mental, physical",
            {"score": "nasa-tlx", "items": (*RAW.items, Item(id="x", text="?", kind="pair", choices=("a", "b")))},
        ),
        ("mental, physical", {"score": "nasa-tlx", "items": tuple(item.replace(optional=True) for item in RAW.items)}),
        ("ten scales from 1 to 5", {"score": "sus", "items": tuple(item.replace(most=7) for item in SUS.items)}),
        ("name must be a line", {"name": "a\nb"}),
        ("title must be a line", {"title": ("a",)}),
    ],
)
def test_a_form_whose_answers_could_not_be_added_up_is_refused_before_anybody_answers(said, more):
    plain = {"name": "own", "items": (Item(id="q", text="?"),)}
    with pytest.raises(ConfigError, match=said):
        Form(**plain | more)


@pytest.mark.parametrize(
    "wrong",
    [
        {"kind": "choice", "choices": "ab"},
        {"kind": "choice", "choices": (1, 2)},
        {"kind": "choice", "choices": ({"a": 1}, {"a": 2})},
        {"low": 1},
        {"high": "a\nb"},
        {"optional": "no"},
        {"text": "?" * 4001},
    ],
)
def test_a_question_that_no_page_could_show_is_refused(wrong):
    with pytest.raises(ConfigError, match="item q"):
        Item(**{"id": "q", "text": "?"} | wrong)


def test_half_a_sign_that_a_page_cut_off_is_kept_as_one_that_can_be_written():
    item = Item(id="q", text="?", kind="text")
    assert item.read("a\ud83d") == "a\ufffd" and item.read("\ud83d\ude00") == "\N{GRINNING FACE}"
