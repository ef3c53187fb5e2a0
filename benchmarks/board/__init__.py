"""The board: entries in ``docs/board/entries``, what is checked of them, and the pages that are made of them."""

from pathlib import Path

ENTRIES = Path(__file__).parents[2] / "docs" / "board" / "entries"
