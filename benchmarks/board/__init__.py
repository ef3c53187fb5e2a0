"""The board: entries in ``docs/board/entries``, the checks of them, and the pages made from them."""

from pathlib import Path

ENTRIES = Path(__file__).parents[2] / "docs" / "board" / "entries"
