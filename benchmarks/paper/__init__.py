"""The paper's evidence, made again: one claim, one picture, one verdict each.

A claim is a module of `benchmarks.paper.claims` with a `FIGURE`: `measure` plays the games under a preset and judges
the parts of the claim by rules that are fixed before the first look; `draw` shows the result.
"""
