"""The controllers: from a team's command and its drones' past to accelerations, as kernels.

===============  ======================================================
`ergodic`        receding-horizon control towards a density
`communication`  the same where not everybody hears everybody
`flocking`       alignment, cohesion, separation, and an attractor
===============  ======================================================
"""
