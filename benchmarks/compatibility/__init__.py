"""Supported libraries.

What works with the game as it is, what needs a keyword, and what a library cannot do. Each line was run by
`scripts/compatibility`, from [`benchmarks/compatibility/`](../benchmarks/compatibility/__init__.py), in games of a
few steps: it shows that something runs, not that it learns. A line with keywords also names the error that comes
without them. [The environment](environment.md) explains the keywords.
"""
