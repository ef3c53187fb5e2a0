"""Ratings and pictures of policies, for the page."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

FILE = Path(__file__).with_suffix(".json")


@dataclass(frozen=True)
class Card:
    """One policy's card."""

    rating: float
    """On the ladder, where `uniform` is 1000."""
    target: tuple[str, ...]
    """Its density at one moment of a game as blue: rows from the bottom up, digits from 0 to the maximum 9."""
    drones: tuple[tuple[int, int], ...]
    """Its drones then, in hundredths of a map width."""


def cards() -> dict[str, Card]:
    """Return the cards of the policies on the ladder, by name; `python -m benchmarks.policy_cards` makes them."""
    return {
        name: Card(rating=card["rating"], target=tuple(card["target"]), drones=tuple((x, y) for x, y in card["drones"]))
        for name, card in json.loads(FILE.read_text()).items()
    }
