"""A season: a tournament of players that strangers submit as folders.

Policies are safetensors or ONNX, which run no code. Programs run code, and play only if the host allows them.
"""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from swarm_pz.config import TEAM_NAMES, GameConfig
from swarm_pz.errors import PolicyError, ResultsError, SwarmError, require_extra
from swarm_pz.evaluation.ledger import PlayedGame, recorded_digests
from swarm_pz.files import read_toml
from swarm_pz.policy import Player, Program, digest_of, load, registered

ENTRIES, CARD, PAGE = "entries", "entry.toml", "index.html"
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
FIELDS = {"by": 60, "link": 200, "exec": 300, "digest": 32}
"""Fields of a card, and their maximum lengths."""
_MOST_REASONS, _MOST_LETTERS, _MOST_UPSETS = 3, 300, 5
"""Limits of the page: reasons for a player's forfeits, letters of a reason, and games to watch."""


@dataclass(frozen=True)
class Entries:
    """The entries of a season by name; a call loads an entry or an installed policy."""

    folders: dict[str, Path] = field(default_factory=dict)
    cards: dict[str, dict[str, str]] = field(default_factory=dict)
    """The `entry.toml` of each."""
    left_out: dict[str, str] = field(default_factory=dict)
    """Folders that do not play, with reasons."""

    @classmethod
    def read(cls, season: Path, game: GameConfig, *, allow_programs: bool) -> Entries:
        """Read the folders in `entries`, leaving out those that cannot play; raise a ResultsError if it is missing."""
        place, entries, played = season / ENTRIES, cls(), recorded_digests(season)
        if not place.is_dir():
            raise ResultsError(f"{season} must hold a folder {ENTRIES}, with a folder of each entry in it")
        for folder in sorted(path for path in place.iterdir() if not path.name.startswith(".")):
            try:
                card = _check(folder, allow_programs=allow_programs)
                entries.folders[folder.name], entries.cards[folder.name] = folder, card
                digest = digest_of(folder.name, entries(folder.name, game))
                if played.get(folder.name, digest) != digest:
                    raise ResultsError("it changed since its games were played: send a new version under another name")
            except (SwarmError, OSError) as error:
                entries.left_out[folder.name] = str(error)
                entries.folders.pop(folder.name, None)
        return entries

    def __call__(self, name: str, game: GameConfig) -> Player:
        """Make a player."""
        if name not in self.folders:
            return load(name, game)
        folder, card = self.folders[name], self.cards[name]
        player = Program(game, card["exec"], folder) if "exec" in card else load(folder, game)
        made = str(getattr(player, "digest", ""))
        if made != card.get("digest", made):
            raise PolicyError(f"{name} must have the digest {card['digest']} of its {CARD}, got {made}")
        return player

    def folder_of(self, name: str) -> Path | None:
        """Return an entry's folder."""
        return self.folders.get(name)


def _check(folder: Path, *, allow_programs: bool) -> dict[str, str]:
    """Return an entry's card; raise a SwarmError if the folder is no entry."""
    if folder.is_symlink() or not folder.is_dir() or not _NAME.fullmatch(folder.name):
        raise ResultsError("an entry is a folder, no link, named by 1 to 40 of a to z, 0 to 9 and '-'")
    if folder.name in registered():
        raise ResultsError("an installed player has that name: choose another one")
    card = read_toml(folder / CARD) if (folder / CARD).is_file() else {}
    for key, value in card.items():
        if key not in FIELDS or not isinstance(value, str) or len(value) > FIELDS[key] or not value.isprintable():
            raise ResultsError(
                f"{CARD} must hold texts alone, in letters: {', '.join(f'{k} {n}' for k, n in FIELDS.items())}; got "
                f"{key} = {value!r:.80}"
            )
    if not card.get("link", "https://").startswith("https://"):
        raise ResultsError(f"a link must begin with https://, got {card['link']!r}")
    if "exec" in card and not allow_programs:
        raise PolicyError("it is a program, and programs play only with --allow-programs")
    return card


def reasons_of(games: Iterable[PlayedGame]) -> dict[str, list[tuple[str, int]]]:
    """Return the most frequent reasons for each player's forfeits, with numbers of games."""
    by_loser: dict[str, Counter[str]] = {}
    for game in games:
        if game.forfeit:
            loser = game.one if game.outcome == "loss" else game.other
            by_loser.setdefault(loser, Counter())[game.forfeit.removeprefix(f"{loser}: ")[:_MOST_LETTERS]] += 1
    return {name: counts.most_common(_MOST_REASONS) for name, counts in by_loser.items()}


def upsets(
    ladder: dict[str, Any], entries: Entries, games: Iterable[PlayedGame]
) -> list[tuple[str, str, str, PlayedGame]]:
    """Return winner, loser, command and game of the greatest upsets, at most one of two players, without programs."""
    programs = {name for name, card in entries.cards.items() if "exec" in card}
    ratings = {entry["player"]: entry["rating"] for entry in ladder["players"]}
    by_pair: dict[tuple[str, str], PlayedGame] = {}
    for game in sorted(games, key=lambda game: game.seconds):
        winner, loser = (game.one, game.other) if game.outcome == "win" else (game.other, game.one)
        if (
            game.outcome != "draw"
            and not game.forfeit
            and not programs & {winner, loser}
            and ratings[winner] < ratings[loser]
        ):
            by_pair.setdefault((winner, loser), game)
    greatest = sorted(by_pair, key=lambda pair: ratings[pair[0]] - ratings[pair[1]])[:_MOST_UPSETS]
    return [(*pair, _command(by_pair[pair], ladder["seed"], entries), by_pair[pair]) for pair in greatest]


def _command(game: PlayedGame, seed: int, entries: Entries) -> str:
    """Return the command that renders a game as a film."""
    options = ["--seed", seed, "--pair", game.number // 2, "--side", TEAM_NAMES[game.number % 2], "--out", "game.mp4"]
    players = (entries.folders.get(name, name) for name in (game.one, game.other))
    return shlex.join(["swarm-pz", "render", *map(str, [*players, *options])])


def render(title: str, ladder: dict[str, Any], entries: Entries, games: Collection[PlayedGame] = ()) -> str:
    """Return the page of a season or tournament: one file that loads only the picture beside it."""
    page: str = _template().render(
        title=title, ladder=ladder, entries=entries, reasons=reasons_of(games), upsets=upsets(ladder, entries, games)
    )
    return page


@cache
def _template() -> Any:
    jinja2 = require_extra("jinja2", "cli")
    text = Path(__file__).with_name("season.html.jinja").read_text()
    return jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text)
