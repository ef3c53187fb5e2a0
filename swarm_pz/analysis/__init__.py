"""One game looked at: as a film, and as curves."""
