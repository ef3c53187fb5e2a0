"""The table, measured; see `__main__`."""
