"""Questions, answers, the scores of known forms, and the texts that participants read."""

import pytest

from swarm_pz.errors import ConfigError
from swarm_pz.play.studies.forms import KNOWN_FORMS, TLX_SCALES, Form, Item, tlx_scores
from swarm_pz.play.studies.texts import html_of

SUS, TLX, RAW = KNOWN_FORMS["sus"], KNOWN_FORMS["nasa-tlx"], KNOWN_FORMS["nasa-tlx-raw"]


@pytest.mark.parametrize(
    ("points", "score"),
    [
        ([5, 1] * 5, 100.0),
        ([1, 5] * 5, 0.0),
        ([5, 4, 2, 1, 2, 3, 2, 4, 5, 2], 55.0),  # the sheet in Brooke's paper: 22 points
    ],
)
def test_the_usability_score_is_that_of_its_sheet(points, score):
    answers = SUS.read({f"sus_{place}": point for place, point in enumerate(points, 1)})
    assert SUS.scores(answers) == {"sus": score}


def test_a_known_form_is_asked_when_the_study_says_so():
    """Catches a form that is named with its time, and is asked after every block all the same."""
    assert Form.from_dict({"name": "sus", "when": "end"}) == SUS.replace(when="end")
    assert Form.from_dict({"name": "sus"}) == SUS


def test_the_task_load_is_weighed_by_the_choices_as_in_the_manual():
    # The worked example of the manual (NASA TLX 1.0): ratings and weights, 640 / 15.
    ratings = {"mental": 30, "physical": 15, "temporal": 60, "performance": 40, "effort": 30, "frustration": 40}
    weights = {"mental": 3, "physical": 0, "temporal": 5, "performance": 1, "effort": 3, "frustration": 3}
    chosen = [TLX_SCALES[scale][0] for scale, weight in weights.items() for _ in range(weight)]
    assert tlx_scores(ratings, chosen) == {"tlx": pytest.approx(640 / 15), "tlx_raw": pytest.approx(215 / 6)}


def test_the_task_load_has_six_scales_and_all_fifteen_pairs_each_of_which_weighs_the_chosen_one():
    """The second of each pair is chosen, so the scales weigh 0, 1, 2, 3, 4 and 5."""
    pairs = [item for item in TLX.items if item.kind == "pair"]
    assert (len(TLX.items), len(RAW.items), len({frozenset(pair.choices) for pair in pairs})) == (21, 6, 15)
    ratings = dict(zip(TLX_SCALES, (100, 80, 60, 40, 20, 5), strict=True))
    scores = TLX.scores(TLX.read(ratings | {pair.id: pair.choices[1] for pair in pairs}))
    assert scores["tlx"] == pytest.approx((80 + 2 * 60 + 3 * 40 + 4 * 20 + 5 * 5) / 15)
    assert scores["tlx_raw"] == RAW.scores(RAW.read(ratings))["tlx_raw"] == pytest.approx(305 / 6)


def test_scales_run_as_on_their_sheets():
    ends = {item.id: (item.low, item.high) for item in RAW.items}
    assert ends.pop("performance") == ("perfect", "failure"), "failure is the load"
    assert set(ends.values()) == {("very low", "very high")} and len(ends) == 5
    complaints = ("complex", "support", "inconsistency", "cumbersome", "needed to learn")
    assert [any(word in item.text for word in complaints) for item in SUS.items] == [False, True] * 5
    assert {(item.low, item.high) for item in SUS.items} == {("strongly disagree", "strongly agree")}


OWN = Form(
    name="own",
    items=(
        Item(id="age", text="Your age?", kind="number", least=18, most=99),
        Item(id="odd", text="?", least=1, most=9, step=2),
        Item(id="hand", text="Your hand?", kind="choice", choices=("left", "right")),
        Item(id="words", text="Anything else?", kind="text", optional=True),
    ),
)
FINE = {"age": 30, "odd": 3, "hand": "left"}


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        (FINE | {"age": 17}, "from 18 to 99, got 17"),
        (FINE | {"hand": "both"}, "'left' or 'right'"),
        ({"age": 30, "odd": 1}, "hand must be an answer"),
        (FINE | {"words": "x" * 4001}, "4000"),
    ],
)
def test_answers_are_checked_by_question(answers, said):
    assert OWN.read(FINE) == FINE | {"words": None} and OWN.scores(FINE) == {}
    with pytest.raises(ConfigError, match=said):
        OWN.read(answers)


def test_words_are_kept_without_what_cannot_be_written():
    """Control characters are dropped; half of a surrogate pair, cut by a page, is replaced."""
    read = OWN.items[-1].read
    assert read("a\0b\n\tc\x1b") == "ab\n\tc"
    assert read("a\ud83d") == "a\ufffd" and read("\ud83d\ude00") == "\N{GRINNING FACE}"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"kind": "slider"}, "kind"),
        ({"least": 5, "most": 1}, "most"),
        ({"kind": "choice", "choices": ("x", "x")}, "different"),
        ({"kind": "pair", "choices": ("x", "y", "z")}, "must be two"),
        ({"correct": 8}, "q must be a number from 1 to 7"),
        ({"correct": 7, "optional": True}, "correct must be left out"),
    ],
)
def test_a_question_that_no_page_could_show_is_refused(wrong, said):
    with pytest.raises(ConfigError, match=said):
        Item(**{"id": "q", "text": "?"} | wrong)


ODD_PAIR = Item(id="x", text="?", kind="pair", choices=("a", "b"))
Q = Item(id="q", text="?")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"score": "sus", "items": tuple(item.replace(most=7) for item in SUS.items)}, "ten scales"),
        ({"score": "nasa-tlx", "items": (*RAW.items, ODD_PAIR)}, "mental, physical"),
        ({"score": "nasa-tlx", "items": tuple(item.replace(optional=True) for item in RAW.items)}, "mental, physical"),
        ({"items": (Q, Q)}, "different ids"),
        ({"items": ()}, "at least one question"),
    ],
)
def test_a_form_whose_answers_could_not_be_added_up_is_refused_before_anybody_answers(more, said):
    with pytest.raises(ConfigError, match=said):
        Form(**{"name": "own", "items": (Q,)} | more)


def test_a_text_is_shown_with_its_headings_below_the_pages_and_brings_nothing_that_acts_or_is_fetched():
    shown = html_of("# Will you?\n\nTake *part*.\n\n### Data\n\n- one\n\n## More\n\n| a | b |\n|---|---|\n| 1 | 2 |\n")
    for part in ("<h2>Will you?</h2>", "<em>part</em>", "<h3>Data</h3>", "<li>one</li>", "<h3>More</h3>", "<td>2</td>"):
        assert part in shown
    shown = html_of('<script>alert(1)</script>\n\n<b onclick="x">b</b>\n\n[go](javascript:alert(1)) ![p](p.png)')
    assert "<script" not in shown and "<b" not in shown and 'href="javascript' not in shown and "<img" not in shown
    assert "&lt;script&gt;" in shown
