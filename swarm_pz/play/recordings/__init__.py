"""Recorded games: their files, playback, verification, and tables of many games."""
