"""Algorithms side by side: the same game, opponents and number of commands, what learns differs."""
