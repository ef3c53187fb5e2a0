"""The controllers that are compiled: from a team's command and its drones' past to accelerations.

=================  ======================================================
`ergodic`          receding-horizon control towards a density
`communication`    the same where not everybody hears everybody
`plans`            the same where solves begin with what the last one planned
`flocking`         alignment, cohesion, separation, and an attractor
`coverage`         towards the centroids of Voronoi cells
`potential_field`  repulsion between drones, and images of charges
=================  ======================================================

A controller's file holds its kernel, its numbers as a named tuple, and what makes them of a configuration. The
ergodic one flies in the games' own loop; others are called by their control systems in `swarm_pz.systems`.
"""
