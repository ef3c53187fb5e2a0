"""Pictures of a game: the board, overlays on it, and a window to show them."""
