"""Design of a study: its conditions and their order for each participant, its games, its forms.

A study is one TOML file, beside the texts that it names; see `docs/studies.md`.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import re
import secrets
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from swarm_pz.config import TEAM_NAMES, GameConfig
from swarm_pz.config.base import Config, Range, check, check_choice
from swarm_pz.errors import ConfigError, nearest
from swarm_pz.files import read_text, read_toml
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.studies.forms import Form, check_words

PERSON = "person"
"""The opponent of a condition in which two participants play each other."""
_STUDY = 21
"""Sets the seeds of studies apart from those of training and matches."""
_NO_FACTORS = ("title", "text", "rules", "levels")
_MOST_TEXT = 200_000
_MOST_CONDITIONS = 50
_CODE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")
_SIGNS = "BCDFGHJKMNPQRSTVWXYZ23456789"
"""Characters of drawn codes: none looks like another one, and without vowels they make no words."""
_CODE_LENGTH = 10
"""Characters of a drawn code: 48 bits."""


@dataclass(frozen=True, kw_only=True)
class Condition(Factors):
    """A condition: the rules of a block of games, and what the seat can do and see.

    It inherits the seat's factors from `Factors`. Tables name it by its `title`. `opponent` is a policy, or "person" if
    two participants play each other. `side` and `system` are those of the participant's seat. `rules` are fields of
    `GameConfig` that differ from the study's. `text` is a Markdown file that is shown before the block. `levels` has
    the level of each factor that no field shows, such as an instruction.
    """

    title: str
    opponent: str = "uniform"
    side: Literal["red", "blue"] = "red"
    system: str = "ergodic"
    rules: dict[str, Any] = field(default_factory=dict)
    text: str = ""
    levels: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        with _named(f"condition {self.title!r}"):
            super().__post_init__()
            check(bool(self.opponent), "opponent", self.opponent, "a policy")
            for name, level in self.levels.items():
                check(name.isidentifier(), "levels", name, "names of letters, digits and _")
                check_words(level, f"levels: {name}")
        check_words(self.title, "condition: title")

    @property
    def is_of_two(self) -> bool:
        """True if two participants play each other."""
        return self.opponent == PERSON

    def game(self, rules: dict[str, Any]) -> GameConfig:
        """Return its games' rules: the study's, overridden by its own. Its `system` flies all participants' drones."""
        other = self.system if self.is_of_two else "ergodic"
        systems = (self.system, other) if self.side == TEAM_NAMES[0] else (other, self.system)
        return GameConfig.from_dict({"controllers": systems, **rules, **self.rules})


@dataclass(frozen=True, kw_only=True)
class Practice(Config):
    """Games before a block that do not count: until `wins` are won (0: no practice), and at most `most`."""

    _section: ClassVar[str] = "practice"

    wins: Annotated[int, Range(0, 100)] = 0
    most: Annotated[int, Range(1, 100)] = 5
    opponent: str = "corners"

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.most >= self.wins, "practice.most", self.most, f"at least practice.wins, {self.wins}")
        check(bool(self.opponent), "practice.opponent", self.opponent, "a policy")


@dataclass(frozen=True, kw_only=True)
class Plan(Config):
    """A plan made before the data: hypotheses, confirmatory tests as "MEASURE: EFFECT", and when to stop."""

    _section: ClassVar[str] = "plan"

    hypotheses: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    stopping: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        for line in (*self.hypotheses, self.stopping):
            check_words(line, "plan", may_be_empty=True)


@dataclass(frozen=True, kw_only=True)
class Study(Config):
    """A whole study; docs/studies.md describes its fields.

    `order` is "balanced", or rows of conditions' titles: participants (or pairs) take the rows in turn, and start again
    after the last one. `consent`, `welcome`, `debriefing` and the conditions' texts are Markdown files in `folder`.
    `completion` is a code that is shown at the end, or an https address to which the last page leads. `words` is a file
    of the pages' phrases in another language.
    """

    title: str
    conditions: tuple[Condition, ...] = ()
    participants: Annotated[int, Range(1, 10_000)]
    games: Annotated[int, Range(1, 1000)] = 4
    order: str | tuple[tuple[str, ...], ...] = "balanced"
    rules: dict[str, Any] = field(default_factory=dict)
    practice: Practice = field(default_factory=Practice)
    break_s: Annotated[float, Range(0.0, 86_400.0)] = 0.0
    forms: tuple[Form, ...] = ()
    plan: Plan = field(default_factory=Plan)
    consent: str = ""
    welcome: str = ""
    debriefing: str = ""
    completion: str = ""
    words: str = ""
    seed: Annotated[int, Range(0, 2**63)] = 0
    codes: tuple[str, ...] = ()
    folder: Path = Path()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_words(self.title, "title")
        titles = [condition.title for condition in self.conditions]
        check(0 < len(titles) <= _MOST_CONDITIONS, "conditions", titles, f"1 to {_MOST_CONDITIONS} [[conditions]]")
        check(len(set(titles)) == len(titles), "conditions", titles, "conditions of different titles")
        names = [form.name for form in self.forms]
        check(len(set(names)) == len(names), "forms", names, "forms of different names")
        check_words(self.completion, "completion", may_be_empty=True)
        self._check_order(titles)
        for code in self.codes:
            check_code(code)
        fits = len({code.upper() for code in self.codes}) == len(self.codes) == self.participants
        count = f"{self.participants} different ones, one a participant; upper and lower case count as the same"
        check(fits or self.codes == (), "codes", self.codes, count)
        named = sorted(self.conditions[0].levels)
        for condition in self.conditions:
            self._check_condition(condition)
            check(sorted(condition.levels) == named, "levels", condition.levels, f"of every condition, here of {named}")
        for name in self.texts:
            self.text(name)
        _ = self.phrases  # which checks their file
        pairs = [f"{first} less {second}" for first, second in itertools.combinations(titles, 2)]
        scores = [score for form in self.forms if form.when == "block" for score in form.score_names]
        for test in self.plan.tests:
            measure, _, effect = test.partition(": ")
            check_choice(measure, f"plan.tests: {test!r}: measure", ("win_rate", "restricted_mean_s", *scores))
            check_choice(effect, f"plan.tests: {test!r}: effect", (*self.effects, *pairs))

    def name_of(self, number: int) -> str:
        """Return the name of a participant (number, from 0) in files and tables, such as P01; it opens no session."""
        return f"P{number + 1:0{max(2, len(str(self.participants)))}d}"

    @property
    def texts(self) -> tuple[str, ...]:
        """Names of the files of texts."""
        names = [self.consent, self.welcome, self.debriefing, self.words]
        return tuple(dict.fromkeys(filter(None, names + [condition.text for condition in self.conditions])))

    @functools.cached_property
    def phrases(self) -> dict[str, Any]:
        """The content of the file `words`: a language, and translations of the pages' English phrases."""
        if not self.words:
            return {}
        with _named(self.words):
            content = read_toml(self.folder / self.words)
            words, expected = content.get("words"), "a line `language = ...` and a table [words] of texts"
            check(isinstance(words, dict) and len(content) == 2, "the file", [*content], expected)
            texts = [content.get("language"), *content["words"].values()]
            check(all(isinstance(one, str) for one in texts), "the file", [*content], expected)
        return content

    @property
    def is_of_pairs(self) -> bool:
        """True if participants 2k and 2k + 1 play each other, and so have the same order."""
        return any(condition.is_of_two for condition in self.conditions)

    @functools.cached_property
    def factors(self) -> dict[str, dict[str, str]]:
        """All that varies among conditions: the level of each condition, by factor and title."""
        rules = {name for condition in self.conditions for name in _flat(condition.rules)}
        levels: dict[str, dict[str, str]] = {}
        for condition in self.conditions:
            game = _flat(condition.game(self.rules).to_dict())
            fields = {name: value for name, value in condition.to_dict().items() if name not in _NO_FACTORS}
            fields |= {name: game.get(name) for name in sorted(rules)} | condition.levels
            for name, value in fields.items():
                levels.setdefault(name, {})[condition.title] = _level(value)
        return {name: of for name, of in levels.items() if len(set(of.values())) > 1}

    @functools.cached_property
    def crossed(self) -> dict[str, dict[str, str]]:
        """The factors of a factorial design, in which each combination of levels is one condition; else empty.

        If conditions have `levels`, only these are factors. A factor that another one determines, as a share does its
        helper, is left out.
        """
        named = self.conditions[0].levels
        factors = {name: of for name, of in self.factors.items() if name in named or not named}
        for name, of in [*factors.items()][::-1]:
            others = [other for other in factors if other != name]
            if any(
                len({*zip(factors[other].values(), of.values(), strict=True)}) == len({*factors[other].values()})
                for other in others
            ):
                del factors[name]
        count = math.prod(len(set(of.values())) for of in factors.values())
        cells = {*zip(*(of.values() for of in factors.values()), strict=True)}
        return factors if count == len(cells) == len(self.conditions) > 1 else {}

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the main effects and interactions of a factorial design."""
        sizes = range(1, len(self.crossed) + 1)
        return tuple(" x ".join(one) for size in sizes for one in itertools.combinations(self.crossed, size))

    @functools.cached_property
    def between(self) -> tuple[str, ...]:
        """The factors between people: each participant meets only one of their levels."""
        orders = [[one.title for one in self.order_of(number)] for number in range(self.participants)]
        return tuple(
            name for name, of in self.factors.items() if all(len({of[one] for one in own}) == 1 for own in orders)
        )

    def _check_order(self, titles: list[str]) -> None:
        together = 2 if self.is_of_pairs else 1
        if self.order == "balanced":
            rows = together * len(balanced_order(len(titles)))
            expected = f"a multiple of {rows}, for {len(titles)} conditions in balanced order"
            expected += ", met by two participants each" if self.is_of_pairs else ""
            check(self.participants % rows == 0, "participants", self.participants, expected)
            return
        check(self.participants % together == 0, "participants", self.participants, "even: they play in pairs")
        is_rows = isinstance(self.order, tuple) and bool(self.order)
        check(is_rows, "order", self.order, '"balanced", or rows of conditions\' titles')
        for row in self.order:
            for name in row:
                if name not in titles:
                    raise ConfigError(f"order: there is no condition {name!r}; {nearest(str(name), titles)}")
            check(len(set(row)) == len(row) and bool(row), "order", row, "each condition once in a row, at least one")

    def _check_condition(self, condition: Condition) -> None:
        with _named(f"condition {condition.title!r}"):
            game, own = condition.game(self.rules), condition.bare
            other = own if condition.is_of_two else Factors(speed=own.speed)
            TableConfig(game=game, factors=(own, other) if condition.side == TEAM_NAMES[0] else (other, own))
            check(game.time_limit <= 3600.0, "time_limit", game.time_limit, "at most an hour")

    @classmethod
    def read(cls, path: Path) -> Study:
        """Read a study's file; if it is invalid, raise ConfigError, which names what is wrong."""
        try:
            plain = read_toml(path)
        except ConfigError as error:
            raise ConfigError(f"{path} is no study: it {error}") from error
        with _named(str(path)):
            check("folder" not in plain, "folder", plain.get("folder"), "left out: texts are beside the study's file")
            for name in ("conditions", "forms"):
                tables = plain.get(name, [])
                fits = isinstance(tables, list) and all(isinstance(one, dict) for one in tables)
                check(fits, name, tables, f"tables, each begun by [[{name}]]")
            return cls.from_dict(plain | {"folder": path.parent})

    def text(self, name: str) -> str:
        """Return a text of the study; raise ConfigError if it is not in its folder, not readable, or too long."""
        expected = "a file in the study's folder, by its name there"
        place = PurePath(name)
        check(not place.is_absolute() and ".." not in place.parts and "\0" not in name, "text", name, expected)
        path = (self.folder / name).resolve()
        check(path.is_relative_to(self.folder.resolve()), "text", name, expected)
        try:
            text = read_text(path)
        except ConfigError as error:
            raise ConfigError(f"the text {name!r} {error}") from error
        check(len(text) <= _MOST_TEXT, "text", name, f"a text of at most {_MOST_TEXT} characters")
        return text

    def order_of(self, participant: int) -> tuple[Condition, ...]:
        """Return the conditions of a participant (number, from 0), in order."""
        place = participant // 2 if self.is_of_pairs else participant
        if self.order == "balanced":
            rows = balanced_order(len(self.conditions))
            return tuple(self.conditions[which] for which in rows[place % len(rows)])
        by_title = {condition.title: condition for condition in self.conditions}
        return tuple(by_title[title] for title in self.order[place % len(self.order)])

    def seed_of(self, game: int, *, practice: bool = False) -> int:
        """Return the seed of a block's game, counted from 0: the same in all conditions and for everybody."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(_STUDY, int(practice), game))
        return int(sequence.generate_state(1, np.uint32)[0])


def _flat(plain: dict[str, Any]) -> dict[str, Any]:
    """Return nested fields as a flat dict, with names such as `capture_threshold`."""
    flat: dict[str, Any] = {}
    for name, value in plain.items():
        flat |= (
            {f"{name}_{key}": one for key, one in _flat(value).items()} if isinstance(value, dict) else {name: value}
        )
    return flat


def _level(value: Any) -> str:
    """Return a field's value as the name of a level."""
    if isinstance(value, tuple | list):
        return "+".join(map(_level, value)) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value) or "none"


@contextlib.contextmanager
def _named(name: str) -> Iterator[None]:
    """Put a name before the message of a ConfigError."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from error


def check_code(code: str) -> str:
    """Return a participant's code.

    Raises ConfigError if it is not of letters, digits, _ and -, or is 'monitor': codes are parts of addresses.
    """
    fits = isinstance(code, str) and _CODE.fullmatch(code) is not None and code.lower() != "monitor"
    check(fits, "code", code, "1 to 32 letters, digits, _ or -, the first no sign, and not 'monitor'")
    return code


def draw_codes(count: int) -> tuple[str, ...]:
    """Return `count` different codes, random and independent of the study's seed: nobody can guess one."""
    drawn: set[str] = set()
    while len(drawn) < count:
        drawn.add("".join(secrets.choice(_SIGNS) for _ in range(_CODE_LENGTH)))
    return tuple(drawn)


@functools.lru_cache(maxsize=8)
def balanced_order(count: int) -> tuple[tuple[int, ...], ...]:
    """Return rows in which each condition takes each place, and follows each other one, equally often.

    There are `count` rows, or twice as many if `count` is odd and above 1 (E. J. Williams, Experimental designs
    balanced for the estimation of residual effects of treatments, 1949).
    """
    zigzag = [(step + 1) // 2 if step % 2 else -(step // 2) for step in range(count)]
    rows = tuple(tuple((place + shift) % count for place in zigzag) for shift in range(count))
    return rows if count % 2 == 0 or count == 1 else rows + tuple(row[::-1] for row in rows)
