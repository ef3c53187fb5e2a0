"""What works unwrapped.

Every row of this page is a few lines of
[`benchmarks/compatibility/`](../benchmarks/compatibility/__init__.py), written as a user of the library would
write them and run in a process of its own; the page is what came of it.

```bash
scripts/compatibility     # makes the environments that it needs, runs every row, writes this page
```

*Keywords* are what our faces had to be told; each such row was also tried without them, and what the library said
then stands beside it. Where a library cannot do something with this game, the row says why. Games are tiny and runs
a few steps long: a row says that something runs, not that it learns. The rows of Stable-Baselines3, Gymnasium and
PettingZoo are tests as well.

What the keywords mean is told in [the environment](environment.md).
"""
