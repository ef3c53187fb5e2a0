"""The paper's evidence, reproduced: one picture and one verdict for each claim.

A claim is a module of `benchmarks.paper.claims` with a `FIGURE`: `measure` plays the games under a preset and judges
the parts of the claim; `draw` shows the result.
"""
