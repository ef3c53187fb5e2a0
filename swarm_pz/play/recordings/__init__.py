"""Recorded games: their files, the games played again, and studies of many."""
