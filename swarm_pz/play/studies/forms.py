"""Questionnaires as data, and the scores of the standard ones.

| form | source |
|---|---|
| `nasa-tlx` | Hart and Staveland, 1988: six scales from 0 to 100, and fifteen pairs that give their weights |
| `nasa-tlx-raw` | the same scales without the pairs: their mean (Byers, Bittner and Hill 1989) |
| `sus` | Brooke, SUS: a quick and dirty usability scale, 1996: ten statements, five points each |
"""

from __future__ import annotations

import itertools
import random
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self

from swarm_pz.config.base import Config, Range, check, check_choice
from swarm_pz.errors import ConfigError, nearest

When = Literal["start", "welcome", "block", "end"]
Kind = Literal["scale", "choice", "number", "text", "pair"]
Number = Annotated[int, Range(-(10**9), 10**9)]
MOST_TEXT = 4000
"""Characters of a free answer."""
_MOST_WORDS = 200


def check_words(value: object, name: str, *, may_be_empty: bool = False) -> None:
    """Check that a value is one line of text that tables, terminals and pages can show."""
    is_line = isinstance(value, str) and len(value) <= _MOST_WORDS and value.isprintable()
    fits = is_line and (may_be_empty or bool(str(value).strip()))
    least = "0 to " if may_be_empty else "1 to "
    check(fits, name, value, f"a line of text of {least}{_MOST_WORDS} characters")


@dataclass(frozen=True, kw_only=True)
class Item(Config):
    """A question, which tables name by its `id`.

    The answer to a scale is `least` plus a multiple of `step`, at most `most`; `low` and `high` label its ends. A
    number is any from `least` to `most`; a choice is one of `choices`; a text is free; a pair is the one of two
    `choices` that counts more. `correct` is the right answer, if there is one.
    """

    id: str
    text: str
    kind: Kind = "scale"
    least: Number = 1
    most: Number = 7
    step: Annotated[int, Range(1, 2 * 10**9)] = 1
    low: str = ""
    high: str = ""
    choices: tuple[str, ...] = ()
    optional: bool = False
    correct: str | float | None = None

    def _path(self, field: str) -> str:
        return "item.id" if field == "id" else f"item {self.id}: {field}"

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.id.isidentifier(), "item.id", self.id, "a name of letters and digits")
        where = f"item {self.id}"
        words = bool(self.text.strip()) and len(self.text) <= MOST_TEXT
        check(words, f"{where}: text", self.text, f"words, {MOST_TEXT} characters at most")
        for name in ("low", "high"):
            check_words(getattr(self, name), f"{where}: {name}", may_be_empty=True)
        for choice in self.choices:
            check_words(choice, f"{where}: choices")
        check(self.most >= self.least, f"{where}: most", self.most, f"at least {self.least}")
        check(self.step <= max(1, self.most - self.least), f"{where}: step", self.step, "no longer than the scale")
        if self.kind in ("choice", "pair"):
            fits = len(self.choices) >= 2 and len(set(self.choices)) == len(self.choices)
            check(fits, f"{where}: choices", self.choices, "at least two different ones")
        check(self.kind != "pair" or len(self.choices) == 2, f"{where}: choices", self.choices, "two")
        if self.correct is not None:
            check(self.kind != "text" and not self.optional, f"{where}: correct", self.correct, "left out here")
            self.read(self.correct)

    def read(self, answer: Any) -> Any:
        """Return an answer as it is stored, or None if it was left out.

        Raises ConfigError if it is no valid answer to this question.
        """
        if answer is None or answer == "":
            check(self.optional, self.id, answer, "an answer: this question may not be left out")
            return None
        if self.kind in ("choice", "pair"):
            check_choice(answer, self.id, self.choices)
            return answer
        if self.kind == "text":
            expected = f"a text of at most {MOST_TEXT} characters"
            check(isinstance(answer, str) and len(answer) <= MOST_TEXT, self.id, answer, expected)
            answer = "".join(sign for sign in answer if sign in "\n\t" or unicodedata.category(sign) != "Cc")
            # A page may cut a character in half; the half (a lone surrogate) cannot be written, and is replaced.
            return answer.encode("utf-16", "surrogatepass").decode("utf-16", "replace")
        is_number = isinstance(answer, int | float) and not isinstance(answer, bool)
        within = is_number and self.least <= answer <= self.most
        fits = within and (self.kind == "number" or (answer - self.least) % self.step == 0)
        steps = "" if self.kind == "number" or self.step == 1 else f" in steps of {self.step}"
        check(fits, self.id, answer, f"a number from {self.least} to {self.most}{steps}")
        return answer


@dataclass(frozen=True, kw_only=True)
class Form(Config):
    """A page of questions; `score` names the method that scores its answers, if any.

    It is asked at the start, after the welcome, after each block, or at the end, as `when` says. A form of
    `KNOWN_FORMS` needs only its name.

    While answers are not right (see `Item`), the form is asked again, up to `tries` times in all. Participants who fail
    the last try are left out of comparisons; if `fails` is "end", the study also ends for them. `shuffle` gives each
    participant the questions in a random order.
    """

    name: str
    title: str = ""
    items: tuple[Item, ...] = field(default=())
    score: Literal["", "nasa-tlx", "sus"] = ""
    tries: Annotated[int, Range(1, 10)] = 1
    fails: Literal["exclude", "end"] = "exclude"
    shuffle: bool = False
    when: When = "block"

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build the form from plain values; raise ConfigError if it has no questions and is no known one."""
        if "name" in values and set(values) <= {"name", "when"}:
            name = str(values["name"])
            if name not in KNOWN_FORMS:
                raise ConfigError(f"forms: there is no form {name!r}; {nearest(name, KNOWN_FORMS)}")
            values = KNOWN_FORMS[name].to_dict() | dict(values)
        return super().from_dict(values)

    def _path(self, field: str) -> str:
        return "form.name" if field == "name" else f"form {self.name}: {field}"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_words(self.name, "form.name")
        check_words(self.title, f"form {self.name}: title", may_be_empty=True)
        check(bool(self.items), f"form {self.name}: items", self.items, "at least one question")
        ids = [item.id for item in self.items]
        check(len(set(ids)) == len(ids), f"form {self.name}: items", ids, "questions of different ids")
        self._check_score()

    def _check_score(self) -> None:
        """Check that the score can be computed from any answers; after the answers it would be too late."""
        pairs = [item for item in self.items if item.kind == "pair"]
        counted = [item for item in self.items if item.kind in ("scale", "number") and not item.optional]
        titles = [title for title, *_ in TLX_SCALES.values()]
        if self.score == "sus":
            points = {(item.kind, item.least, item.most, item.step) for item in counted}
            fits = len(self.items) == len(counted) == 10 and points == {("scale", 1, 5, 1)}
            expected = "ten scales from 1 to 5, as score 'sus' adds them up"
        else:
            fits = set(TLX_SCALES) <= {item.id for item in counted}
            fits = fits and not any(pair.optional or not set(pair.choices) <= set(titles) for pair in pairs)
            scales = f"{', '.join(TLX_SCALES)} as scales"
            expected = f"{scales}, and pairs of {', '.join(titles)}, as score 'nasa-tlx' weighs them"
        check(not self.score or fits, f"form {self.name}: items", [item.id for item in self.items], expected)

    def read(self, answers: Mapping[str, Any]) -> dict[str, Any]:
        """Return the checked answers to all questions, by their ids.

        Raises ConfigError if an answer is missing, invalid, or to no question of the form.
        """
        if not isinstance(answers, Mapping):
            raise ConfigError(f"form {self.name}: answers come by question, got {answers!r}")
        known = {item.id for item in self.items}
        for name in answers:
            check(name in known, f"form {self.name}", name, f"answers to its questions; {nearest(str(name), known)}")
        return {item.id: item.read(answers.get(item.id)) for item in self.items}

    def passes(self, answers: Mapping[str, Any]) -> bool:
        """Return True if all questions that have a right answer are answered right."""
        return all(item.correct in (None, answers.get(item.id)) for item in self.items)

    def order(self, seed: str) -> list[Item]:
        """Return the questions in the order in which they are asked."""
        items = list(self.items)
        if self.shuffle:
            random.Random(seed).shuffle(items)  # noqa: S311  (no secret)
        return items

    @property
    def score_names(self) -> tuple[str, ...]:
        """Names of its scores."""
        is_weighed = any(item.kind == "pair" for item in self.items)
        return {"sus": ("sus",), "nasa-tlx": ("tlx_raw", "tlx") if is_weighed else ("tlx_raw",)}.get(self.score, ())

    def scores(self, answers: Mapping[str, Any]) -> dict[str, float]:
        """Return the scores of the answers; empty for forms without a score."""
        if self.score == "sus":
            points = [int(answers[item.id]) for item in self.items]
            return {"sus": 2.5 * (sum(points[::2]) - 5 + 25 - sum(points[1::2]))}  # answer - 1 and 5 - answer in turn
        if self.score == "nasa-tlx":
            ratings = {scale: float(answers[scale]) for scale in TLX_SCALES}
            chosen = [answers[item.id] for item in self.items if item.kind == "pair"]
            return tlx_scores(ratings, chosen or None)
        return {}


TLX_SCALES = {
    "mental": ("Mental demand", "How mentally demanding was the task?"),
    "physical": ("Physical demand", "How physically demanding was the task?"),
    "temporal": ("Temporal demand", "How hurried or rushed was the pace of the task?"),
    "performance": ("Performance", "How successful were you in accomplishing what you were asked to do?"),
    "effort": ("Effort", "How hard did you have to work to accomplish your level of performance?"),
    "frustration": ("Frustration", "How insecure, discouraged, irritated, stressed and annoyed were you?"),
}
"""Title and question of each scale."""
_SUS = (
    "I think that I would like to use this system frequently.",
    "I found the system unnecessarily complex.",
    "I thought the system was easy to use.",
    "I think that I would need the support of a technical person to be able to use this system.",
    "I found the various functions in this system were well integrated.",
    "I thought there was too much inconsistency in this system.",
    "I would imagine that most people would learn to use this system very quickly.",
    "I found the system very cumbersome to use.",
    "I felt very confident using the system.",
    "I needed to learn a lot of things before I could get going with this system.",
)


def tlx_scores(ratings: Mapping[str, float], chosen: list[str] | None) -> dict[str, float]:
    """Return the task load index: the mean of six ratings, and the mean weighted by choices if there are any.

    A scale's weight is how often its title was chosen; for the standard fifteen pairs, the weights sum to 15.
    """
    raw = sum(ratings.values()) / len(ratings)
    if chosen is None:
        return {"tlx_raw": raw}
    weighed = sum(chosen.count(title) * ratings[scale] for scale, (title, _) in TLX_SCALES.items())
    return {"tlx_raw": raw, "tlx": weighed / len(chosen)}


def _tlx(name: str, *, weighed: bool) -> Form:
    ends = dict.fromkeys(TLX_SCALES, ("very low", "very high")) | {"performance": ("perfect", "failure")}
    items = [
        Item(id=scale, text=f"{title}: {question}", least=0, most=100, step=5, low=ends[scale][0], high=ends[scale][1])
        for scale, (title, question) in TLX_SCALES.items()
    ]
    for one, other in itertools.combinations(TLX_SCALES, 2) if weighed else ():
        titles, words = (TLX_SCALES[one][0], TLX_SCALES[other][0]), "Which contributed more to the workload?"
        items.append(Item(id=f"{one}_or_{other}", text=words, kind="pair", choices=titles))
    return Form(name=name, title="How demanding was it?", items=tuple(items), score="nasa-tlx")


KNOWN_FORMS: dict[str, Form] = {
    "nasa-tlx": _tlx("nasa-tlx", weighed=True),
    "nasa-tlx-raw": _tlx("nasa-tlx-raw", weighed=False),
    "sus": Form(
        name="sus",
        title="How usable was it?",
        items=tuple(
            Item(id=f"sus_{place}", text=text, most=5, low="strongly disagree", high="strongly agree")
            for place, text in enumerate(_SUS, 1)
        ),
        score="sus",
    ),
}
"""Forms that a study may name without writing them out."""
