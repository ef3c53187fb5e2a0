"""The paper's evidence, made again, and ours: one claim, one picture, one verdict each.

A claim is a module with a `FIGURE`, of `benchmarks.paper.claims` where the paper says it, of `benchmarks.paper.ours`
where we do: `measure` plays the games under a preset and says which parts of the claim hold, by rules that stand there
before anybody looks; `draw` shows what was found.
"""
